"""Graphs of NetworkX and tables of GeoPandas as the node-link JSON that the engine reads, and back."""

from __future__ import annotations

import json
import numbers
from typing import TYPE_CHECKING, Any

from .errors import NetworkError
from .results import NodeId

if TYPE_CHECKING:
    import networkx as nx

_NODE_MEMBERS = ("altitude_m", "altitude_reference", "pads", "role", "name")
_SEGMENT_MEMBERS = ("id", "lower_m", "lower_reference", "upper_m", "upper_reference", "speed_limit_mps")
_LENGTHS = ("length_m", "length", "weight")
_ENDS = (("from", "to"), ("source", "target"), ("u", "v"))


def _plain(value: Any) -> Any:
    """A number or a text without the types of numpy."""
    return value.item() if hasattr(value, "item") else value


def _id(value: Any, place: str) -> NodeId:
    plain = _plain(value)
    if isinstance(plain, str) or (isinstance(plain, numbers.Integral) and not isinstance(plain, bool)):
        return plain if isinstance(plain, str) else int(plain)
    hint = "relabel the nodes to integers or text, as nx.convert_node_labels_to_integers does"
    raise NetworkError(f"the id {plain!r} is neither an integer nor text", "id_of_another_kind", place, hint)


def _is_missing(value: Any) -> bool:
    """None, NaN, or what pandas puts in their place, which refuses to be compared."""
    try:
        return value is None or bool(value != value)
    except TypeError:
        return True


def node_link_of_graph(graph: nx.Graph) -> str:
    """Node-link JSON of a graph."""
    if graph.is_directed():
        hint = "convert it with nx.Graph(graph)"
        raise NetworkError("the graph is directed; a skyway is undirected", "directed_graph", "graph", hint)
    nodes = [_node_of_graph(node, attributes) for node, attributes in graph.nodes(data=True)]
    links = []
    for start, end, attributes in graph.edges(data=True):
        place = f"edge ({start!r}, {end!r})"
        links.append({"source": _id(start, place), "target": _id(end, place)} | _segment_members(attributes))
    facts = {"name": str(graph.graph.get("name") or "networkx graph"), "attribution": str(graph.graph.get("attribution", ""))}
    return json.dumps({"graph": facts, "nodes": nodes, "links": links})


def _node_of_graph(node: Any, attributes: dict[str, Any]) -> dict[str, Any]:
    place = f"node {node!r}"
    for first, second in (("lon", "lat"), ("x", "y")):
        if first in attributes and second in attributes:
            position = {first: float(attributes[first]), second: float(attributes[second])}
            break
    else:
        if "pos" not in attributes:
            hint = "give every node x and y in metres, lon and lat in degrees, or pos"
            raise NetworkError("the node has no position", "no_position", place, hint)
        x, y = attributes["pos"]
        position = {"x": float(x), "y": float(y)}
    return {"id": _id(node, place)} | position | _members(attributes, _NODE_MEMBERS)


def _members(attributes: Any, names: tuple[str, ...]) -> dict[str, Any]:
    found = {name: _plain(attributes[name]) for name in names if name in attributes}
    return {name: value for name, value in found.items() if not _is_missing(value)}


def _segment_members(attributes: Any) -> dict[str, Any]:
    members = _members(attributes, _SEGMENT_MEMBERS)
    lengths = _members(attributes, _LENGTHS)
    length = next((lengths[name] for name in _LENGTHS if name in lengths), None)
    return members if length is None else members | {"length_m": float(length)}


def node_link_of_frames(nodes: Any, segments: Any) -> str:
    """Node-link JSON of two GeoDataFrames."""
    if nodes.crs is not None and nodes.crs.to_epsg() != 4326:
        nodes = nodes.to_crs(4326)
    names = ("x", "y") if nodes.crs is None else ("lon", "lat")
    table = nodes if "id" in nodes.columns else nodes.reset_index(names="id")
    listed = []
    for row in table.to_dict("records"):
        place, point = f"node {row['id']!r}", row[table.geometry.name]
        if point is None or point.geom_type != "Point":
            kind = "nothing" if point is None else point.geom_type
            raise NetworkError(f"the geometry is {kind}", "not_a_point", place, "give every node a point")
        position = dict(zip(names, (point.x, point.y)))
        listed.append({"id": _id(row["id"], place)} | position | _members(row, _NODE_MEMBERS))
    return json.dumps({"graph": {"name": "geopandas tables"}, "nodes": listed, "links": _links_of_frame(segments)})


def _links_of_frame(segments: Any) -> list[dict[str, Any]]:
    known = {*segments.columns, *(name for name in segments.index.names if name is not None)}
    ends = next(((start, end) for start, end in _ENDS if {start, end} <= known), None)
    if ends is None:
        hint = "name the two nodes of each segment in columns from and to"
        raise NetworkError("the segments do not name their nodes", "no_ends", "segments", hint)
    table = segments if set(ends) <= set(segments.columns) else segments.reset_index()
    links = []
    for row in table.to_dict("records"):
        place = f"segment {row[ends[0]]!r} - {row[ends[1]]!r}"
        links.append({"source": _id(row[ends[0]], place), "target": _id(row[ends[1]], place)} | _segment_members(row))
    return links


def graph_of_node_link(text: str) -> nx.Graph:
    """A graph, with `weight` as the algorithms of NetworkX ask for it."""
    import networkx as nx

    told = json.loads(text)
    graph = nx.Graph(**told["graph"])
    graph.add_nodes_from((node.pop("id"), node) for node in told["nodes"])
    for link in told["links"]:
        start, end = link.pop("source"), link.pop("target")
        graph.add_edge(start, end, **link, weight=link["length_m"])
    return graph


def frames_of_node_link(text: str, is_geographic: bool) -> tuple[Any, Any]:
    """Nodes and segments as GeoDataFrames."""
    import geopandas as gpd
    import shapely

    told = json.loads(text)
    first, second = ("lon", "lat") if is_geographic else ("x", "y")
    crs = 4326 if is_geographic else None
    at = {node["id"]: (node.pop(first), node.pop(second)) for node in told["nodes"]}
    points = [shapely.Point(at[node["id"]]) for node in told["nodes"]]
    lines = [shapely.LineString([at[link["source"]], at[link["target"]]]) for link in told["links"]]
    segments = [{"from": link.pop("source"), "to": link.pop("target")} | link for link in told["links"]]
    return gpd.GeoDataFrame(told["nodes"], geometry=points, crs=crs), gpd.GeoDataFrame(segments, geometry=lines, crs=crs)
