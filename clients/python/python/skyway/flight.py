"""The drone that flies a plan: airframe, payload, battery, wind and times."""

from __future__ import annotations

import datetime
import json
import math
import pathlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from .errors import FlightError

BUNDLED = ("phantom3", "m100")


@dataclass(frozen=True)
class Flight:
    """With it times, battery and recharging stops are computed (docs/flight-model.md).

    Bad figures raise `FlightError`, which names the field.
    """

    airframe: str | Mapping[str, object] = "phantom3"
    """phantom3, m100, the path of a JSON file as in data/airframes, or its content."""
    payload_kg: float | None = None
    """None counts as 0."""
    battery_fraction: float | None = None
    """The battery at the start, or now in flight, 0 to 1; None is that of a full charge."""
    wind: tuple[float, float] | None = None
    """Where it comes from in degrees from north, and metres per second: (225, 7). None is calm."""
    objective: str = "distance"
    """What is made least: distance, time or energy."""
    start_time: str | datetime.datetime | None = None
    """When the plan starts, or the drone reports, with its offset from UTC; None is the time of the network's zones."""
    deadline_s: float | None = None
    """The latest landing, in seconds after the start; None is 2.5 hours."""
    reserve_fraction: float | None = None
    """No node is reached with less than this fraction of the battery; None is 0.2."""
    swap_stations: Sequence[int | str] = ()
    """Nodes that swap batteries instead of charging them."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "airframe", _airframe_text(self.airframe))
        object.__setattr__(self, "start_time", time_text(self.start_time, "flight.start_time"))
        object.__setattr__(self, "swap_stations", list(self.swap_stations))
        self._check("payload_kg", self.payload_kg, 0.0, math.inf, "give kilograms, 0 or more")
        self._check("battery_fraction", self.battery_fraction, 0.0, 1.0, "give a fraction between 0 and 1; 80 % is 0.8")
        self._check("reserve_fraction", self.reserve_fraction, 0.0, 1.0, "give a fraction between 0 and 1")
        self._check("deadline_s", self.deadline_s, 1e-9, math.inf, "give seconds above 0")
        if self.wind is not None:
            object.__setattr__(self, "wind", _wind(self.wind))

    @staticmethod
    def _check(name: str, value: float | None, least: float, most: float, hint: str) -> None:
        if value is not None and not (least <= value <= most and math.isfinite(value)):
            raise FlightError(f"it is {value}", "out_of_range", f"flight.{name}", hint)


def _airframe_text(given: str | Mapping[str, object]) -> str:
    if not isinstance(given, str):
        return json.dumps(dict(given))
    if given in BUNDLED or given.lstrip().startswith("{"):
        return given
    try:
        return pathlib.Path(given).read_text(encoding="utf-8")
    except OSError as fault:
        hint = f"the bundled airframes are {' and '.join(BUNDLED)}"
        raise FlightError(f"there is no airframe {given}", "unknown_airframe", "flight.airframe", hint) from fault


def _wind(given: Sequence[float]) -> tuple[float, float]:
    try:
        from_deg, speed_mps = map(float, given)
    except (TypeError, ValueError):
        from_deg = speed_mps = math.nan
    if 0.0 <= from_deg <= 360.0 and 0.0 <= speed_mps < math.inf:
        return from_deg, speed_mps
    hint = "give degrees from north, 0 to 360, and metres per second, as (225, 7)"
    raise FlightError(f"it is {given}", "out_of_range", "flight.wind", hint)


def time_text(given: str | datetime.datetime | None, place: str) -> str | None:
    """RFC 3339 of a time; one without an offset is refused, as it could mean any place on Earth."""
    if not isinstance(given, datetime.datetime):
        return given
    if given.tzinfo is None:
        hint = "give it an offset, as datetime.now(timezone.utc) has"
        raise FlightError(f"the time {given} has no offset from UTC", "time_without_offset", place, hint)
    return given.isoformat()
