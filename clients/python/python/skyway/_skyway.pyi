"""What the extension module has: nothing of it is for callers but what `skyway.Network` inherits."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal, overload

from .flight import Flight
from .results import Composition, FlownRecomposition, NodeId, Recomposition

_Place = NodeId | tuple[float, float]
_Target = NodeId | tuple[NodeId, NodeId]
_Failure = Literal["environmental", "operational", "navigational", "regulatory", "infrastructure", "service_level"]
_Strategy = Literal["exact", "two_phased", "cell_density", "radius", "dijkstra", "astar", "bellman_ford"]
_Scope = Literal["local", "global"]

class World:
    def with_closures(self, zones: list[str], close: list[_Target], at: str, horizon_s: float | None) -> World: ...

def load(text: str, edges: str | None = None) -> World: ...
def generate(nodes: int, max_neighbours: int, map_size_m: float, reach_fraction: float, joining: str, seed: int) -> World: ...
def bundled(name: str) -> str: ...

class Core:
    def __init__(self, world: World) -> None: ...
    @property
    def _world(self) -> World: ...
    @property
    def name(self) -> str:
        """What the network's file calls it."""
    @property
    def attribution(self) -> str:
        """Who has to be named beside every copy; empty if no one."""
    @property
    def node_count(self) -> int: ...
    @property
    def segment_count(self) -> int: ...
    @property
    def is_geographic(self) -> bool:
        """True for longitude and latitude, False for metres of a plane."""
    @property
    def has_integer_ids(self) -> bool: ...
    @property
    def sha256(self) -> str:
        """Fingerprint of the text that the network was read from; certificates name it."""
    @property
    def repairs(self) -> list[str]:
        """What was repaired in foreign data."""
    @property
    def node_ids(self) -> tuple[NodeId, ...]:
        """The ids of all nodes, in their order."""
    @property
    def closed(self) -> tuple[tuple[NodeId, ...], tuple[str, ...]]:
        """Closed nodes, and segments that are closed themselves or at an end."""
    @overload
    def recompose(
        self,
        service: tuple[NodeId, NodeId],
        destination: NodeId | None = None,
        *,
        failure: _Failure = "navigational",
        location: _Place | Literal["unknown"] | None = None,
        cause_location: _Place | None = None,
        remaining_path: Sequence[NodeId] | None = None,
        zone: Mapping[str, Any] | str | None = None,
        strategy: _Strategy = "exact",
        scope: _Scope = "global",
        close: Iterable[_Target] | None = None,
        flight: None = None,
        cell_size_m: float | None = None,
        val_ratio: float | None = None,
        stage_skipping: bool = True,
        full_tree: bool = False,
        optimum: bool = False,
        explain: bool = False,
    ) -> Recomposition:
        """Answers a failure report.

        `service` is the failed leg, from the node behind the drone to the node ahead of it; without a `destination` the
        delivery goes to its end. `location` is where the drone is: a node, (longitude, latitude) in degrees or (x, y) in metres,
        or "unknown"; without it the drone is at the start of its leg. `zone` is a GeoJSON feature that binds this report alone;
        `close` is closed before the failure. `optimum` and `explain` tell more (docs/strategies.md). With a `Flight` the answer
        has times, battery and recharging stops.

        Raises `RequestError`, `AirspaceError` or `FlightError`, which name the argument and the remedy.
        """
    @overload
    def recompose(
        self,
        service: tuple[NodeId, NodeId],
        destination: NodeId | None = None,
        *,
        flight: Flight,
        failure: _Failure = "navigational",
        location: _Place | Literal["unknown"] | None = None,
        cause_location: _Place | None = None,
        remaining_path: Sequence[NodeId] | None = None,
        zone: Mapping[str, Any] | str | None = None,
        strategy: _Strategy = "exact",
        scope: _Scope = "global",
        close: Iterable[_Target] | None = None,
        cell_size_m: float | None = None,
        val_ratio: float | None = None,
        stage_skipping: bool = True,
        full_tree: bool = False,
        optimum: bool = False,
        explain: bool = False,
    ) -> FlownRecomposition: ...
    def compose(
        self,
        source: NodeId,
        destination: NodeId,
        *,
        airspeed_mps: float = 16.0,
        flight: Flight | None = None,
        stops: Sequence[tuple[NodeId, float]] | None = None,
        close: Iterable[_Target] | None = None,
    ) -> Composition:
        """Composes a plan, each leg with what to do where it closes.

        Without a `Flight` it is the shortest open way, with nominal times at `airspeed_mps`. With one, times, battery and
        recharging stops are computed; `stops` are nodes where the delivery is served, with the seconds that takes.

        Raises `RequestError` or `FlightError`, which name the argument and the remedy.
        """
    def answer_many(
        self,
        from_nodes: Any,
        to_nodes: Any,
        destinations: Any,
        by_id: bool,
        failure: str,
        strategy: str,
        scope: str,
        close: list[_Target],
        threads: int,
        cell_size_m: float | None,
        val_ratio: float | None,
        stage_skipping: bool,
        full_tree: bool,
    ) -> dict[str, Any]: ...
    def node_link(self) -> str:
        """The network as node-link JSON of NetworkX."""
    def svg(self, width_px: int, title: str | None, labels: str, whole: bool, buildings: str | None) -> str: ...
    def verdict(self, certificate: str) -> dict[str, Any]: ...
