"""Asks an edge in both dialects, and reads their answers as one shape: that of REST."""

import json
import pathlib
import sys

from planted import Planted

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "contract"))

from dialects import Grpc, Rest  # noqa: E402  (the clients of the contract tests)
from edge_process import EdgeProcess  # noqa: E402

ENUMS = {
    "outcome": "OUTCOME_",
    "strategy": "STRATEGY_",
    "strategy_used": "STRATEGY_",
    "stage": "STAGE_",
    "state": "PUBLICATION_STATE_",
    "cause": "SEVERANCE_CAUSE_",
    "kind": "",
    "reservation": "PAD_RESERVATION_",
    "freshness": "FRESHNESS_",
    "clock": "CLOCK_KIND_",
}
# What the harness of the contract says of an edge whose checker has had a case.
REFUSED_ANSWER = "did not let an answer pass"
KINDS = ("leg", "straight", "none", "start", "charge", "swap")
MEMBERS_OF_ANSWER = ("answer", "stamp")


def plain(value, name: str = ""):
    """A message as REST would tell it: names of enumerations in lower case, what is not said left out."""
    if isinstance(value, dict):
        return {key: plain(member, key) for key, member in value.items()}
    if isinstance(value, list) and name == "geometry":
        return [position(point) for point in value]
    if isinstance(value, list) and name == "flags":
        return [flag.removeprefix("FLAG_").lower() for flag in value]
    if isinstance(value, list):
        return [plain(member, name) for member in value]
    if isinstance(value, str) and name in ENUMS and value.isupper():
        if name == "kind":
            return next((kind for kind in KINDS if value.endswith("_" + kind.upper())), value.lower())
        return value.removeprefix(ENUMS[name]).lower()
    return value


def position(point) -> list:
    """A point of a line: two coordinates and a height."""
    if not isinstance(point, dict):
        return point
    if "position" in point:
        return position(point["position"])
    names = ("lon", "lat") if "lon" in point else ("x", "y")
    return [point.get(name, 0.0) for name in names] + [point.get("height_m", 0.0)]


def flattened(message: dict) -> dict:
    """The answer of gRPC with the members that REST has at its top."""
    told = plain(message)
    for member in MEMBERS_OF_ANSWER:
        told |= told.pop(member, None) or {}
    airborne = told.get("if_airborne")
    if isinstance(airborne, dict) and "answer" in airborne:
        told["if_airborne"] = airborne | airborne.pop("answer")
    return told


def as_message(body: dict) -> dict:
    """A report as proto3 JSON."""
    message = dict(body)
    message["type"] = "FAILURE_TYPE_" + body["type"].upper()
    for name, prefix in (("strategy", "STRATEGY_"), ("scope", "SCOPE_"), ("detail", "OPERATIONAL_DETAIL_")):
        if name in body:
            message[name] = prefix + body[name].upper()
    for name in ("location", "cause_location"):
        if name in body:
            message[name] = as_place(body[name])
    if "service" in body:
        message["service"] = {
            key: str(value) if key in ("from", "to") else value for key, value in body["service"].items()
        }
    for name in ("destination", "node"):
        if name in body:
            message[name] = str(body[name])
    if "remaining_path" in body:
        message["remaining_path"] = [str(node) for node in body["remaining_path"]]
    return message


def as_place(place) -> dict:
    if isinstance(place, list):
        return {"lon_lat": {"lon": place[0], "lat": place[1]}}
    if "node" in place:
        return {"node": str(place["node"])}
    return {"planar": place}


class Edge:
    """An edge over one network, asked in both dialects."""

    def __init__(
        self,
        binary: pathlib.Path,
        network_file: pathlib.Path | None,
        flown: bool,
        planted: Planted | None,
        more: dict[str, str] | None = None,
    ) -> None:
        from world import HORIZON_S, NOW_TEXT

        settings = {
            "clock.start": NOW_TEXT,
            "clock.rate": "0.001",
            "airspace.horizon": f"{HORIZON_S:.0f}s",
            "log.filter": "error",
            "limits.body": "16MiB",
        }
        settings["flight.airframe"] = "phantom3" if flown else "none"
        if flown:
            settings["flight.airframes"] = "m100"
        arguments = [f"--network={network_file}"] if network_file is not None else []
        for name, value in (settings | (more or {})).items():
            arguments += ["--set", f"{name}={value}"]
        self._process = EdgeProcess(binary, *arguments)
        if planted is not None:
            self._process._command = ["env", *planted.environment(), *self._process._command]

    def __enter__(self) -> "Edge":
        self._process.__enter__()
        self.rest = Rest(self._process.url)
        self.grpc = Grpc(self._process.address)
        return self

    def __exit__(self, *error) -> None:
        self.grpc.close()
        try:
            self._process.__exit__(*error)
        except RuntimeError as refused:
            # The counter has told it.
            if REFUSED_ANSWER not in str(refused):
                raise

    def log(self) -> str:
        return self._process.log()

    def batch(self, bodies: list[dict]) -> list[dict]:
        answer = self.rest.call("POST", "/v1/failures:batch", {"failures": bodies})
        if answer.code is not None:
            raise RuntimeError(f"a batch is refused: {answer.told()}")
        return [entry.get("recomposition") or entry for entry in answer.body["answers"]]

    def single(self, body: dict) -> dict:
        answer = self.rest.call("POST", "/v1/failures", body)
        return answer.body if answer.code is None else {"problem": answer.body}

    def over_grpc(self, body: dict) -> dict:
        answer = self.grpc.call("skyway.v1.Recomposition", "ReportFailure", self.known(as_message(body)))
        return flattened(answer.body) if answer.code is None else {"problem": {"code": answer.code} | answer.body}

    def known(self, message: dict) -> dict:
        """The members that this edge's description has: an older one is asked without the others."""
        described = self.grpc._pool.FindMessageTypeByName("skyway.v1.FailureReport")
        return {name: value for name, value in message.items() if name in described.fields_by_name}

    def cases(self) -> list[str]:
        """The lines of its log that tell what the checker refused."""
        return [line for line in self.log().splitlines() if REFUSED_ANSWER in line]

    def checker_cases(self) -> float | None:
        """The checker's counter on the admin listener, once there is one."""
        import requests

        page = requests.get(f"http://127.0.0.1:{self._process.admin_port}/metrics", timeout=30).text
        lines = [line for line in page.splitlines() if line.startswith("skyway_checker_cases_total")]
        return sum(float(line.rsplit(" ", 1)[1]) for line in lines) if lines else None


def registry(binary: pathlib.Path, folder: pathlib.Path) -> EdgeProcess:
    """A registry over a file, as a process."""
    process = EdgeProcess(binary)
    process._command = [
        str(binary),
        "registry",
        f"--store={folder / 'registry.db'}",
        "--listen=127.0.0.1:0",
        "--admin-listen=127.0.0.1:0",
        f"--ports-file={process._ports_file}",
        "--log=error",
    ]
    return process


def told(value) -> str:
    return json.dumps(value, separators=(",", ":"))
