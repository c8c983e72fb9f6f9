"""What is refused, as exceptions with a stable code, the place and the remedy."""

from __future__ import annotations

__all__ = [
    "AirspaceError",
    "ConnectionBroken",
    "FlightError",
    "InternalError",
    "NetworkError",
    "Problem",
    "ProgramError",
    "RequestError",
    "SkywayError",
]


class SkywayError(Exception):
    """Something that is refused.

    `code` is stable and for programs; `place` says which argument, member or feature is meant, and is empty where it is all of them;
    `hint` says what would set it right, and is None where that is unknown.
    """

    def __init__(self, message: str, code: str, place: str = "", hint: str | None = None) -> None:
        super().__init__(message, code, place, hint)
        self.message, self.code, self.place, self.hint = message, code, place, hint

    def __str__(self) -> str:
        text = f"{self.place}: {self.message}" if self.place else self.message
        return f"{text}; {self.hint}" if self.hint else text


class NetworkError(SkywayError):
    """A network that cannot be loaded, generated or taken over."""


class RequestError(SkywayError):
    """Arguments that name nothing, or that no search can work with."""


class AirspaceError(SkywayError):
    """A zone, a closure or a time that cannot be read."""


class FlightError(SkywayError):
    """A drone that cannot be flown with, or a plan that there is not."""


class InternalError(SkywayError):
    """A fault of the engine. No input should lead to it."""


class ProgramError(SkywayError):
    """The program `skyway` is not there, or does not serve."""


class ConnectionBroken(SkywayError):
    """A server that cannot be reached, or that does not answer in time."""


class Problem(SkywayError):
    """What a server refuses, after its problem document (RFC 9457).

    `status` is that of HTTP; `errors` has each fault with its `code`, its `pointer` and its `hint`; `document` is all that was told.
    `place` and `hint` are those of the first fault.
    """

    def __init__(self, status: int, document: dict[str, object]) -> None:
        faults = document.get("errors")
        self.errors: list[dict[str, object]] = (
            [fault for fault in faults if isinstance(fault, dict)] if isinstance(faults, list) else []
        )
        first = self.errors[0] if self.errors else {}
        message = str(document.get("detail") or document.get("title") or f"HTTP status {status}")
        hint = first.get("hint")
        place = first.get("pointer") or first.get("place") or ""
        super().__init__(message, str(document.get("code") or f"http_{status}"), str(place), None if hint is None else str(hint))
        self.args = (status, document)
        self.status, self.document = status, document

    @property
    def retry_after_s(self) -> float | None:
        """When to try again, in seconds, where the server says so."""
        after = self.document.get("retry_after_s")
        return float(after) if isinstance(after, (int, float)) else None
