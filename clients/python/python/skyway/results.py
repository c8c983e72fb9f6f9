"""What the engine answers: frozen dataclasses, each with its table and its picture."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

from .geojson import geojson_text
from .picture import Map

if TYPE_CHECKING:
    import pandas as pd

NodeId = int | str
"""The id of a node: an integer where the network's file writes integers, else text."""


class _Native(Protocol):
    def document(self) -> dict[str, Any]: ...
    def certificate(self) -> str: ...
    def svg(self, width_px: int, title: str | None, labels: str, whole: bool, buildings: str | None) -> str: ...


class _Drawn:
    """What can be drawn on its network."""

    _answer: _Native

    def map(
        self,
        *,
        width_px: int = 720,
        title: str | None = None,
        labels: str = "ends",
        whole: bool = False,
        buildings: object = None,
    ) -> Map:
        """A map of it. `labels` is none, ends, paths or all; `buildings` is GeoJSON, as text or as a mapping."""
        return Map(self._answer.svg(width_px, title, labels, whole, geojson_text(buildings)))

    def document(self) -> dict[str, Any]:
        """All of it under the names of the API (docs/strategies.md, docs/flights.md). Ids are text there."""
        return self._answer.document()

    def certificate(self) -> str:
        """The proof, as text, for `Network.verify` and `skyway verify`.

        Raises `RequestError` or `FlightError` with the code `no_proof` or `no_plan` where there is nothing to prove.
        """
        return self._answer.certificate()


@dataclass(frozen=True)
class Stage:
    """One area that a strategy looked at: asked for with `explain=True`."""

    stage: str
    skipped: bool
    searched: bool
    path_found: bool
    nodes: tuple[str, ...]
    area: dict[str, Any] | None
    """The area as a GeoJSON geometry."""


@dataclass(frozen=True, kw_only=True)
class Recomposition(_Drawn):
    """The answer to a failure report; lengths are in metres. docs/strategies.md has the meaning of each field."""

    outcome: str = "rerouted"
    """rerouted, unaffected, hold, diverted or no_route."""
    nodes: tuple[NodeId, ...]
    """The whole remaining path; empty for no_route."""
    remaining_length_m: float | None = None
    recomposed_length_m: float | None = None
    first_stretch_m: float = 0.0
    strategy: str = "exact"
    strategy_used: str = "exact"
    fallback_reason: str | None = None
    stage: str = "global"
    searches: int = 1
    area_nodes: int
    area_segments: int
    settled_nodes: int
    local_optimum_m: float | None = None
    global_optimum_m: float | None = None
    remaining_optimum_m: float | None = None
    flags: tuple[str, ...] = ()
    warnings: tuple[tuple[str, str], ...] = ()
    """Each with its stable code and its text."""
    severed_by: tuple[str, ...] = ()
    """What cut the drone off: report, network, or a closure with its id."""
    checker_case: str | None = None
    """What was wrong with the answer that this one stands in for; None where the first one passed the check."""
    _answer: Any = field(repr=False, compare=False)

    @cached_property
    def segments(self) -> tuple[str, ...]:
        """The segments between the nodes, by their ids."""
        return self._answer.segments()

    @property
    def stages(self) -> tuple[Stage, ...]:
        """The areas in their order; empty unless asked for with `explain=True`."""
        told = self.document().get("stages") or []
        return tuple(
            Stage(one["stage"], one["skipped"], one["searched"], one["path_found"], tuple(one["nodes"]), one.get("area"))
            for one in told
        )

    def to_frame(self) -> pd.DataFrame:
        """The path as a DataFrame, a row for each leg: from_node, to_node, segment. Needs pandas."""
        import pandas as pd

        return pd.DataFrame({"from_node": self.nodes[:-1], "to_node": self.nodes[1:], "segment": self.segments})


@dataclass(frozen=True)
class Composition(_Drawn):
    """A plan from a source to a destination. Times are nominal and energy unchecked without a `Flight`."""

    outcome: str
    """composed or no_route."""
    nodes: tuple[NodeId, ...]
    segments: tuple[str, ...]
    length_m: float | None
    duration_s: float | None
    energy_wh: float | None
    """None without a `Flight`."""
    battery_at_arrival_fraction: float | None
    legs: tuple[dict[str, Any], ...]
    """Each with its times, and with what to do where it closes (docs/flight-composition.md)."""
    stops: tuple[dict[str, Any], ...]
    """Stays on pads: what for, from when until when, and the battery before and after."""
    causes: tuple[dict[str, Any], ...]
    """For no_route of a flight: what cuts the drone off."""
    _answer: _Native = field(repr=False, compare=False)

    @classmethod
    def _of(cls, answer: _Native, has_integer_ids: bool) -> Composition:
        return cls(**_plan_fields(answer.document(), has_integer_ids), _answer=answer)

    def to_frame(self) -> pd.DataFrame:
        """The plan as a DataFrame, a row for each leg. Needs pandas."""
        return _legs_frame(self.legs)


@dataclass(frozen=True)
class FlownRecomposition(_Drawn):
    """The answer to a drone in flight, with the battery that it has."""

    outcome: str
    nodes: tuple[NodeId, ...]
    segments: tuple[str, ...]
    remaining_length_m: float | None
    first_stretch_m: float
    battery_fraction: float
    battery_at_arrival_fraction: float | None
    duration_s: float | None
    energy_wh: float | None
    reserve_used: bool
    strategy: str
    strategy_used: str
    fallback_reason: str | None
    legs: tuple[dict[str, Any], ...]
    stops: tuple[dict[str, Any], ...]
    causes: tuple[dict[str, Any], ...]
    warnings: tuple[tuple[str, str], ...]
    _answer: _Native = field(repr=False, compare=False)

    @classmethod
    def _of(cls, answer: _Native, has_integer_ids: bool) -> FlownRecomposition:
        told = answer.document()
        plan = _plan_fields(told.get("plan") or {"outcome": told["outcome"]}, has_integer_ids)
        return cls(
            outcome=told["outcome"],
            nodes=plan["nodes"],
            segments=plan["segments"],
            remaining_length_m=told["remaining_length_m"],
            first_stretch_m=told["first_stretch_m"],
            battery_fraction=told["battery_fraction"],
            battery_at_arrival_fraction=plan["battery_at_arrival_fraction"],
            duration_s=plan["duration_s"],
            energy_wh=plan["energy_wh"],
            reserve_used=told["reserve_used"],
            strategy=told["strategy"],
            strategy_used=told["strategy_used"],
            fallback_reason=told["fallback_reason"],
            legs=plan["legs"],
            stops=plan["stops"],
            causes=tuple(told["causes"]),
            warnings=tuple((warning["code"], warning["message"]) for warning in told["warnings"]),
            _answer=answer,
        )

    def to_frame(self) -> pd.DataFrame:
        """The plan as a DataFrame, a row for each leg. Needs pandas."""
        return _legs_frame(self.legs)


def _plan_fields(told: dict[str, Any], has_integer_ids: bool) -> dict[str, Any]:
    def id_of(text: str) -> NodeId:
        return int(text) if has_integer_ids else text

    path = told.get("path") or {"nodes": (), "segments": ()}
    legs = [leg | {"from": id_of(leg["from"]), "to": id_of(leg["to"])} for leg in told.get("legs", ())]
    stops = [stop | {"node": id_of(stop["node"])} for stop in told.get("stops", ())]
    return {
        "outcome": told.get("outcome", "composed"),
        "nodes": tuple(map(id_of, path["nodes"])),
        "segments": tuple(path["segments"]),
        "length_m": told.get("length_m"),
        "duration_s": told.get("duration_s", told.get("flight_time_s")),
        "energy_wh": told.get("energy_wh"),
        "battery_at_arrival_fraction": told.get("battery_at_arrival_fraction"),
        "legs": tuple(legs),
        "stops": tuple(stops),
        "causes": tuple(told.get("causes", ())),
    }


def _legs_frame(legs: tuple[dict[str, Any], ...]) -> pd.DataFrame:
    import pandas as pd

    nested = {"if_closed", "alternate", "geometry"}
    rows = [{name: value for name, value in leg.items() if name not in nested} for leg in legs]
    return pd.DataFrame(rows).rename(columns={"from": "from_node", "to": "to_node"})


@dataclass(frozen=True)
class Verdict:
    """What a certificate is worth, by code that shares nothing with the searches."""

    holds: bool
    text: str
    length_m: float | None
