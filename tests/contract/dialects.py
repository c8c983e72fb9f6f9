"""Clients of both dialects: REST by requests, gRPC by what reflection tells, without generated code."""

import dataclasses

import grpc
import requests
from google.protobuf import json_format, message_factory
from google.protobuf.descriptor_pool import DescriptorPool
from google.rpc import error_details_pb2, status_pb2
from grpc_reflection.v1alpha.proto_reflection_descriptor_database import ProtoReflectionDescriptorDatabase

TIMEOUT_S = 30.0
STATUS_DETAILS = "grpc-status-details-bin"


@dataclasses.dataclass
class Answer:
    """What came back, in the same terms for both dialects."""

    # The code of the problem; none where there is an answer.
    code: str | None
    # The HTTP status, or the name of the gRPC code.
    status: str
    # The answer: JSON, or the message as proto3 JSON with the names of its fields.
    body: dict
    # Code and place of everything that was wrong.
    faults: list[tuple[str, str]]
    headers: dict

    def told(self) -> str:
        """For people who look for the difference."""
        return f"{self.status} {self.code or 'ok'} {self.faults} {str(self.body)[:600]}"


class Rest:
    """REST."""

    def __init__(self, url: str) -> None:
        self.url = url
        self._session = requests.Session()

    def call(self, method: str, path: str, body=None, headers: dict | None = None) -> Answer:
        """One request; `body` is JSON, or text that is sent as it is."""
        raw = body.encode() if isinstance(body, str) else None
        sent = {"content-type": "application/json"} if raw is not None else {}
        response = self._session.request(
            method,
            self.url + path,
            data=raw,
            json=body if raw is None else None,
            headers={**sent, **(headers or {})},
            timeout=TIMEOUT_S,
        )
        read = response.json()
        code = read.get("code") if response.status_code >= 400 else None
        faults = [(fault["code"], fault["pointer"]) for fault in read.get("errors", [])] if code else []
        return Answer(code, str(response.status_code), read, faults, dict(response.headers))


class Grpc:
    """gRPC: the services and messages are those that the server tells of itself."""

    def __init__(self, address: str) -> None:
        self._channel = grpc.insecure_channel(address)
        self._database = ProtoReflectionDescriptorDatabase(self._channel)
        self._pool = DescriptorPool(self._database)

    def close(self) -> None:
        """Ends the connection."""
        self._channel.close()

    def services(self) -> set[str]:
        """Names of all services."""
        return set(self._database.get_services())

    def methods(self, service: str) -> list[str]:
        """Names of a service's methods."""
        return [method.name for method in self._pool.FindServiceByName(service).methods]

    def call(self, service: str, method: str, request: dict) -> Answer:
        """One call; `request` is proto3 JSON."""
        invoke, message = self._invocation(service, method, request)
        try:
            reply, call = invoke.with_call(message, timeout=TIMEOUT_S)
        except grpc.RpcError as error:
            return refusal(error)
        return Answer(None, "OK", as_dict(reply), [], dict(call.trailing_metadata() or ()))

    def watch(self, service: str, method: str, request: dict, timeout_s: float = TIMEOUT_S):
        """A call that is answered by a stream of messages; to be cancelled."""
        invoke, message = self._invocation(service, method, request)
        return invoke(message, timeout=timeout_s)

    def _invocation(self, service: str, method: str, request: dict):
        described = self._pool.FindServiceByName(service).FindMethodByName(method)
        message = message_factory.GetMessageClass(described.input_type)()
        json_format.ParseDict(request, message)
        reply = message_factory.GetMessageClass(described.output_type)
        kind = self._channel.unary_stream if described.server_streaming else self._channel.unary_unary
        invoke = kind(
            f"/{service}/{method}",
            request_serializer=lambda sent: sent.SerializeToString(),
            response_deserializer=reply.FromString,
        )
        return invoke, message


def as_dict(message) -> dict:
    """A message as proto3 JSON, with fields that have no presence and say nothing."""
    return json_format.MessageToDict(
        message, preserving_proto_field_name=True, always_print_fields_with_no_presence=True
    )


def refusal(error: grpc.RpcError) -> Answer:
    """A status with its details; without `ErrorInfo` its code is empty, which equals no problem's."""
    code, faults = "", []
    metadata = dict(error.trailing_metadata() or ())
    for packed in status_pb2.Status.FromString(metadata.get(STATUS_DETAILS, b"")).details:
        info, bad = error_details_pb2.ErrorInfo(), error_details_pb2.BadRequest()
        if packed.Unpack(info) and info.domain == "skyway":
            code = info.reason
        if packed.Unpack(bad):
            faults = [(violation.reason, violation.field) for violation in bad.field_violations]
    return Answer(code, error.code().name, {"message": error.details()}, faults, metadata)
