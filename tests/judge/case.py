"""One answer beside the judge's reading of its report, and the faults that are found in it."""

import dataclasses

from reading import Reading, Start
from reports import Report
from world import World

OUTCOMES = ("rerouted", "unaffected", "hold", "diverted", "no_route")
FLAGS = ("leaving_zone", "cannot_stop", "unverified", "reserve_used", "pad_occupied", "unseparated")
WITHOUT_PADS = ("propulsion", "land_now")
# Lengths of flown plans are rounded to a millionth of a metre for each leg.
TOLERANCE_M = 0.01
# How far the clock of an edge goes while it is asked.
CLOCK_S = 0.03


@dataclasses.dataclass
class Fault:
    rule: str
    text: str

    def __str__(self) -> str:
        return f"{self.rule}: {self.text}"


class Verdict:
    """Collects what is wrong."""

    def __init__(self) -> None:
        self.faults: list[Fault] = []

    def expect(self, right, rule: str, text: str) -> bool:
        if not right:
            self.faults.append(Fault(rule, text))
        return bool(right)


class Case:
    """An answer beside its reading."""

    def __init__(self, world: World, report: Report, answer: dict, reading: Reading | None = None) -> None:
        self.world = world
        self.report = report
        self.answer = answer
        self.reading = reading or Reading(world, report)
        self.verdict = Verdict()
        self.outcome = answer.get("outcome")
        path = answer.get("path") or {}
        self.nodes: list[str] = path.get("nodes") or []
        self.segments: list[str] = path.get("segments") or []
        self.stretch: dict = answer.get("first_stretch") or {}
        self.flags: list[str] = answer.get("flags") or []
        self.start: Start | None = None
        # Told under `if_airborne`, which has fewer members.
        self.is_inner = False
        # Whether all that the path is made of is there, so that more can be asked about it.
        self.is_whole = False

    def expect(self, right, rule: str, text: str) -> bool:
        return self.verdict.expect(right, rule, text)

    @property
    def holds_on_ground(self) -> bool:
        """It is told as a drone that stands: because it does, or beside `if_airborne` because it may."""
        stands = self.report.airborne is False or (self.report.airborne is None and self.answer.get("if_airborne"))
        # One that waits elsewhere flies there first.
        is_there = not self.nodes or str(self.nodes[0]) == self.reading.a
        return self.outcome == "hold" and bool(stands) and is_there

    @property
    def slack_m(self) -> float:
        """By how much lengths may differ: the clock stands all but still, and a place grows old by that."""
        return TOLERANCE_M + (CLOCK_S * self.reading.airspeed_mps if "timestamp" in self.report.body else 0.0)

    @property
    def stretch_m(self) -> float:
        return self.answer.get("first_stretch_m") or 0.0

    @property
    def total_m(self) -> float:
        return self.answer.get("remaining_length_m") or 0.0

    @property
    def overrun_m(self) -> float:
        return self.stretch.get("overrun_m") or 0.0
