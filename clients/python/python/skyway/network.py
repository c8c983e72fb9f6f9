"""A network with its airspace, and the engine on it."""

from __future__ import annotations

import datetime
import gzip
import os
import pathlib
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, Self

from . import _skyway, shapes
from .errors import NetworkError, RequestError
from .flight import time_text
from .geojson import geojson_text
from .many import Recompositions, columns_of
from .picture import Map
from .results import NodeId, Verdict

if TYPE_CHECKING:
    import networkx as nx

Target = NodeId | tuple[NodeId, NodeId]
"""What is closed: a node or a segment by its id, or a segment by its two nodes."""


class Network(_skyway.Core):
    """A skyway network in one state of its airspace. It never changes: `with_closures` gives another one.

    `recompose` and `compose` are those of the base class; any number of threads may call them at once.
    """

    @classmethod
    def from_file(cls, path: str | os.PathLike[str], edges: str | os.PathLike[str] | None = None) -> Self:
        """Reads GeoJSON, GraphML, node-link JSON of NetworkX, or CSV, each also as .gz (docs/network.md).

        CSV has its edges in a second file: `edges`, or x_edges.csv beside x_nodes.csv. Raises `NetworkError`, which names the feature.
        """
        nodes = pathlib.Path(path)
        text = _read(nodes)
        if edges is None and not _looks_like_csv(text):
            return cls(_skyway.load(text))
        if edges is None and "_nodes" not in nodes.name:
            hint = "name the file of the edges with edges=..."
            raise NetworkError("it holds nodes, and nothing says where the edges are", "no_edges", str(nodes), hint)
        beside = nodes.with_name(nodes.name.replace("_nodes", "_edges")) if edges is None else pathlib.Path(edges)
        return cls(_skyway.load(text, _read(beside)))

    @classmethod
    def from_text(cls, text: str) -> Self:
        """Reads the text of a network in GeoJSON, GraphML or node-link JSON, such as an edge serves. Raises `NetworkError`."""
        return cls(_skyway.load(text))

    @classmethod
    def bundled(cls, name: str = "sydney") -> Self:
        """A network that comes with Skyway: sydney (a city, from OpenStreetMap) or corridor (the paper's scenario)."""
        return cls(_skyway.load(_skyway.bundled(name)))

    @classmethod
    def generated(
        cls,
        nodes: int,
        *,
        max_neighbours: int = 10,
        reach_fraction: float = 0.1,
        map_size_m: float = 10_000.0,
        joining: str = "nearest",
        seed: int = 1,
    ) -> Self:
        """A random network after the paper's Table 1; the same seed gives the same one. `joining`: nearest, random or delaunay."""
        return cls(_skyway.generate(nodes, max_neighbours, map_size_m, reach_fraction, joining, seed))

    @classmethod
    def from_networkx(cls, graph: nx.Graph) -> Self:
        """Takes a graph over: nodes are integers or text with `x` and `y` in metres, `lon` and `lat` in degrees, or `pos`.

        An edge is as long as its `length_m`, `length` or `weight`, else straight. Raises `NetworkError`.
        """
        return cls(_skyway.load(shapes.node_link_of_graph(graph)))

    @classmethod
    def from_geopandas(cls, nodes: Any, segments: Any) -> Self:
        """Takes two GeoDataFrames over: points, with their id as the column `id` or as index, and segments that name them.

        Segments have `from` and `to`, or `source` and `target`, or `u` and `v`, as columns or as index. Where the nodes have a
        coordinate system they are taken to longitude and latitude; else they are metres of a plane. Raises `NetworkError`.
        """
        return cls(_skyway.load(shapes.node_link_of_frames(nodes, segments)))

    def to_networkx(self) -> nx.Graph:
        """The network as a graph; each edge has `length_m` and the same as `weight`."""
        return shapes.graph_of_node_link(self.node_link())

    def to_geopandas(self) -> tuple[Any, Any]:
        """Nodes and segments as two GeoDataFrames, which `from_geopandas` reads."""
        return shapes.frames_of_node_link(self.node_link(), self.is_geographic)

    def with_closures(
        self,
        *,
        zones: Any = (),
        close: Iterable[Target] = (),
        at: str | datetime.datetime | None = None,
        horizon_s: float = 3_600.0,
    ) -> Self:
        """The same network with more closed.

        `zones` is one or a list of: GeoJSON as a mapping or as text, a GeoDataFrame, text of ED-269, ED-318 or QGroundControl. A zone
        with windows counts where one of them meets the time from `at` (now where it is None) to `horizon_s` seconds later. Raises
        `AirspaceError`, which names the place in the zone.
        """
        given = list(zones) if isinstance(zones, (list, tuple)) else [zones]
        texts = [text for text in map(geojson_text, given) if text is not None]
        when = time_text(at, "at") or datetime.datetime.now(datetime.UTC).isoformat()
        return type(self)(self._world.with_closures(texts, list(close), when, horizon_s))

    def recompose_many(
        self,
        service_from: Sequence[NodeId] | Any,
        service_to: Sequence[NodeId] | Any,
        destination: Sequence[NodeId] | Any,
        *,
        failure: str = "navigational",
        strategy: str = "exact",
        scope: str = "global",
        close: Iterable[Target] = (),
        threads: int | None = None,
        cell_size_m: float | None = None,
        val_ratio: float | None = None,
        stage_skipping: bool = True,
        full_tree: bool = False,
    ) -> Recompositions:
        """Answers a report for each row of three columns of node ids: arrays, lists or series.

        Without the lock of the interpreter, on `threads` threads (one for each core where it is None). The drones are at the start of
        their legs. Raises `RequestError`, which names the row.
        """
        if threads is not None and threads < 1:
            hint = "give a number above 0, or None for one on each core"
            raise RequestError(f"it is {threads}", "out_of_range", "threads", hint)
        columns, by_id = columns_of(self, service_from, service_to, destination)
        told = self.answer_many(
            *columns,
            by_id,
            failure,
            strategy,
            scope,
            list(close),
            threads or _cores(),
            cell_size_m,
            val_ratio,
            stage_skipping,
            full_tree,
        )
        return Recompositions(self, columns, by_id, strategy, told)

    def map(
        self,
        result: Any = None,
        *,
        width_px: int = 720,
        title: str | None = None,
        labels: str = "ends",
        whole: bool = False,
        buildings: object = None,
    ) -> Map:
        """A map of the network with what is closed, or of a result on it. `buildings` is GeoJSON in longitude and latitude."""
        if result is not None:
            return result.map(width_px=width_px, title=title, labels=labels, whole=whole, buildings=buildings)
        return Map(self.svg(width_px, title, labels, whole, geojson_text(buildings)))

    def verify(self, certificate: str) -> Verdict:
        """Judges a certificate, or a plan with times and battery, by code that shares nothing with the searches."""
        return Verdict(**self.verdict(certificate))

    def __repr__(self) -> str:
        return f"<skyway.Network '{self.name}': {self.node_count} nodes, {self.segment_count} segments>"


def _read(path: pathlib.Path) -> str:
    try:
        content = path.read_bytes()
        return (gzip.decompress(content) if path.suffix == ".gz" else content).decode("utf-8")
    except OSError as fault:
        raise NetworkError(str(fault.strerror or fault), "unreadable_file", str(path), "name a file that can be read") from fault
    except UnicodeDecodeError as fault:
        raise NetworkError("it is not text in UTF-8", "unreadable_file", str(path), "write it anew in UTF-8") from fault


def _looks_like_csv(text: str) -> bool:
    head = text.lstrip()
    return not head.startswith(("{", "[", '"', "<")) and any(mark in head.partition("\n")[0] for mark in ",;\t")


def _cores() -> int:
    # Those that this process may use, where the system says.
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
