"""The judge's own flight model: what a stretch of air takes of time and energy, from the formulas of the documents."""

import dataclasses
import math

from geometry import Point, distance
from world import Network, Segment, Wind

GRAVITY = 9.81
VERTICAL_MPS = 3.0
UNKNOWN_CLIMB_M = 30.0
RESERVE, FLOOR = 0.2, 0.08
TAU_S, FULL = 960.0, 0.98


@dataclasses.dataclass
class Airframe:
    mass_kg: float
    battery_wh: float
    airspeed_mps: float
    max_payload_kg: float
    efficiency: float = 0.5
    max_wind_mps: float = 10.0
    gust_factor: float = 1.4
    # Lift to drag and what the electronics draw, of D'Andrea's formula.
    lift_to_drag: float | None = None
    avionics_w: float = 0.0

    def power_w(self, payload_kg: float, airspeed_mps: float) -> float:
        mass = self.mass_kg + payload_kg
        if self.lift_to_drag is not None:
            kilowatts = mass * airspeed_mps * 3.6 / ((3600 / GRAVITY) * self.efficiency * self.lift_to_drag)
            return 1000 * kilowatts + self.avionics_w
        return 68.9 * mass**1.5 / math.sqrt(1.204) + 16.8

    def climb_wh(self, payload_kg: float, height_m: float) -> float:
        return (self.mass_kg + payload_kg) * GRAVITY * max(0.0, height_m) / (3600 * self.efficiency)


PHANTOM3 = Airframe(1.216, 68.1, 16.0, 1.1, lift_to_drag=3.0, avionics_w=100.0)
M100 = Airframe(3.68, 129.96, 12.0, 0.75)


@dataclasses.dataclass
class Stretch:
    """What a line through the air takes: at least, and at most."""

    time_s: float
    least_wh: float
    most_wh: float


class Drone:
    """An airframe with its payload, in a wind."""

    def __init__(self, airframe: Airframe, payload_kg: float, airspeed_mps: float | None, wind: Wind) -> None:
        self.airframe = airframe
        self.payload_kg = payload_kg
        self.airspeed_mps = airspeed_mps or airframe.airspeed_mps
        self.wind = wind
        self.power_w = airframe.power_w(payload_kg, self.airspeed_mps)
        towards = math.radians(wind.from_deg + 180)
        self._wind_to = (wind.speed_mps * math.sin(towards), wind.speed_mps * math.cos(towards))
        self.can_fly = (
            payload_kg <= airframe.max_payload_kg and wind.speed_mps * airframe.gust_factor <= airframe.max_wind_mps
        )

    def ground_speed(self, start: Point, end: Point) -> float:
        """By the wind triangle; 0 where the wind is too strong."""
        length = distance(start, end)
        if length == 0.0:
            return self.airspeed_mps
        x, y = (end[0] - start[0]) / length, (end[1] - start[1]) / length
        along_it = self._wind_to[0] * x + self._wind_to[1] * y
        across = self._wind_to[0] * y - self._wind_to[1] * x
        if abs(across) >= self.airspeed_mps:
            return 0.0
        speed = along_it + math.sqrt(self.airspeed_mps**2 - across**2)
        return speed if speed > 0.5 else 0.0

    def stretch(
        self, start: Point, end: Point, length_m: float, limit_mps: float | None, climb_m: float
    ) -> Stretch | None:
        """A length flown from a place towards another one; none where the wind forbids it."""
        speed = self.ground_speed(start, end)
        if speed == 0.0 or not self.can_fly:
            return None
        if start == end:
            # Straight up the wind has no direction: anything between behind and ahead.
            return self._upright(length_m, climb_m)
        held = min(speed, limit_mps or speed)
        time_s = max(length_m / held, abs(climb_m) / VERTICAL_MPS)
        climb_wh = self.airframe.climb_wh(self.payload_kg, climb_m)
        level_wh = self.power_w * length_m / held / 3600
        return Stretch(time_s, level_wh, self.power_w * time_s / 3600 + climb_wh)

    def _upright(self, length_m: float, climb_m: float) -> Stretch | None:
        slowest = self.airspeed_mps - self.wind.speed_mps
        time_s = max(length_m / slowest, abs(climb_m) / VERTICAL_MPS, length_m / VERTICAL_MPS)
        climb_wh = self.airframe.climb_wh(self.payload_kg, max(abs(climb_m), length_m))
        least_wh = self.power_w * length_m / (self.airspeed_mps + self.wind.speed_mps) / 3600
        return Stretch(time_s, least_wh, self.power_w * time_s / 3600 + climb_wh)


class Heights:
    """The altitude at which each node is passed: the highest, over its segments, of what its band has nearest to it."""

    def __init__(self, network: Network) -> None:
        self._known: dict[str, list[float]] = {}
        self._is_sure: dict[str, bool] = {}
        self._references = {node.id: node.reference for node in network.nodes.values()}
        self.rise: dict[str, float] = {}
        for node in network.nodes.values():
            known = [
                min(max(node.altitude_m, segment.lower_m), segment.upper_m)
                for segment in network.beside[node.id]
                if node.altitude_m is not None and segment.lower_m is not None and segment.reference == node.reference
            ]
            self._known[node.id] = known
            self._is_sure[node.id] = bool(known) and len(known) == len(network.beside[node.id])
            self.rise[node.id] = max(known) - node.altitude_m if known else UNKNOWN_CLIMB_M

    def climb_m(self, start: str, end: str) -> float:
        """From one crossing altitude to another; where not all is known, as much as it may be at most."""
        one, other = self._known[start], self._known[end]
        is_comparable = bool(one and other) and self._references[start] == self._references[end]
        if is_comparable and self._is_sure[start] and self._is_sure[end]:
            return max(other) - max(one)
        return max(UNKNOWN_CLIMB_M, max(other) - min(one) if is_comparable else 0.0)


    def dip_m(self, segment: Segment, node: str) -> float:
        """How far below the altitude at which its end is passed a segment's band ends."""
        known = self._known[node]
        is_comparable = segment.upper_m is not None and segment.reference == self._references[node]
        return max(0.0, max(known) - segment.upper_m) if is_comparable and self._is_sure[node] else 0.0


def fly(drone: Drone, network: Network, heights: Heights, segment: Segment, start: str) -> Stretch | None:
    """A segment from one of its ends to the other: down into its band, along it, and up again."""
    end = segment.other(start)
    one, other = network.nodes[start].at, network.nodes[end].at
    down_m, up_m = heights.dip_m(segment, start), heights.dip_m(segment, end)
    climb_m = heights.climb_m(start, end) + down_m - up_m
    along = drone.stretch(one, other, segment.length_m, segment.speed_limit_mps, climb_m)
    if along is None:
        return None
    climb_wh = drone.airframe.climb_wh(drone.payload_kg, up_m)
    upright_s = (down_m + up_m) / VERTICAL_MPS
    return Stretch(along.time_s + upright_s, along.least_wh, along.most_wh + climb_wh)
