"""Networks between Skyway and others: GraphML by NetworkX, GeoPackage by sqlite3, an OSM extract written byte by byte."""

import json
import pathlib
import sqlite3
import struct
import subprocess
import zlib

import networkx

# A grid of corners in steps of the format, 100 nanodegrees: a hall, a house, and a block around a yard, then a shed without
# a height.
STEP_DEG = 1e-7
WEST, SOUTH = 1_512_000_000, -338_600_000
SIDE = 3_000


def told(program, *arguments):
    run = subprocess.run([program, *arguments], capture_output=True, text=True, check=False)
    assert run.returncode == 0, f"{arguments}: {run.stderr}"
    return run.stdout


def native(program, network):
    return json.loads(told(program, "network", "convert", "--quiet", "--network", str(network), "--to", "geojson"))


def parts(network):
    """The nodes by id, and the segments by their two ids."""
    features = network["features"]
    nodes = {str(f["id"]): f for f in features if f["properties"]["kind"] == "node"}
    segments = [f["properties"] | {"id": f.get("id")} for f in features if f["properties"]["kind"] == "segment"]
    return nodes, {frozenset((str(s["from"]), str(s["to"]))): s for s in segments}


def tell_graphml(program, folder):
    """Sydney as NetworkX sees it, written again by NetworkX, is Sydney."""
    nodes, segments = parts(native(program, "sydney"))
    ours = folder / "sydney.graphml"
    told(program, "network", "convert", "--quiet", "--network", "sydney", "--output", str(ours))
    graph = networkx.read_graphml(ours)
    assert not graph.is_directed() and not graph.is_multigraph()
    assert set(graph.nodes) == set(nodes) and {frozenset(edge) for edge in graph.edges} == set(segments)
    for node, known in graph.nodes(data=True):
        stated = nodes[node]["properties"]
        assert [known["lon"], known["lat"]] == nodes[node]["geometry"]["coordinates"], node
        for name in ("pads", "role", "altitude_m", "altitude_reference", "name"):
            assert known.get(name) == stated.get(name), (node, name)
    for start, end, known in graph.edges(data=True):
        stated = segments[frozenset((start, end))]
        assert known["weight"] == stated["length_m"], (start, end)
        for name in ("lower_m", "lower_reference", "upper_m", "upper_reference", "speed_limit_mps"):
            assert known.get(name) == stated.get(name), (start, end, name)
    shortest = networkx.dijkstra_path_length(graph, "379", "450")
    composed = json.loads(told(program, "compose", "--source", "379", "--destination", "450", "--json", "--quiet"))
    assert abs(composed["length_m"] - shortest) < 1e-6, (composed["length_m"], shortest)
    theirs = folder / "theirs.graphml"
    networkx.write_graphml(graph, theirs)
    assert parts(native(program, theirs)) == (nodes, segments)

    # Graphs that others draw: layouts, edges without weights, parallel edges, ids that are words.
    drawn = networkx.grid_2d_graph(3, 4)
    drawn = networkx.relabel_nodes(drawn, {node: f"{node[0]}|{node[1]}" for node in drawn})
    places = {node: [100.0 * int(part) for part in node.split("|")] for node in drawn}
    networkx.set_node_attributes(drawn, {node: str(tuple(place)) for node, place in places.items()}, "pos")
    for graph in (drawn, networkx.MultiGraph(drawn)):
        networkx.write_graphml(graph, theirs)
        found, joined = parts(native(program, theirs))
        assert {node: feature["geometry"]["coordinates"] for node, feature in found.items()} == places
        assert {frozenset(edge[:2]) for edge in graph.edges} == set(joined)
        assert all(segment["length_m"] == 100 and segment["id"] is None for segment in joined.values())
    networkx.write_graphml(drawn.to_directed(), theirs)
    command = [program, "network", "info", "--network", str(theirs)]
    refused = subprocess.run(command, capture_output=True, text=True, check=False)
    assert refused.returncode == 1 and "nx.Graph(graph)" in refused.stderr, refused
    print(f"GraphML: {len(nodes)} nodes and {len(segments)} segments by NetworkX {networkx.__version__}, and back")


def geometry(blob, srs):
    """The positions in a blob of GeoPackage, by the words of the standard."""
    magic, version, flags, stated = struct.unpack_from("<2sBBi", blob)
    assert (magic, version, flags & 1, stated) == (b"GP", 0, 1, srs), blob
    at = 8 + {0: 0, 1: 32}[flags >> 1 & 7]
    order, kind = struct.unpack_from("<BI", blob, at)
    assert order == 1
    count, at = (1, at + 5) if kind == 1 else (struct.unpack_from("<I", blob, at + 5)[0], at + 9)
    numbers = struct.unpack_from(f"<{2 * count}d", blob, at)
    assert len(blob) == at + 16 * count
    if kind == 2:
        envelope = struct.unpack_from("<4d", blob, 8)
        xs, ys = numbers[::2], numbers[1::2]
        assert envelope == (min(xs), max(xs), min(ys), max(ys)), envelope
    return [list(numbers[i:i + 2]) for i in range(0, len(numbers), 2)]


def tell_geopackage(program, folder):
    """What SQLite finds in a GeoPackage is what the standard asks for, and Sydney."""
    nodes, segments = parts(native(program, "sydney"))
    file = folder / "sydney.gpkg"
    told(program, "network", "convert", "--quiet", "--network", "sydney", "--output", str(file))
    base = sqlite3.connect(file)
    base.row_factory = sqlite3.Row
    assert base.execute("PRAGMA integrity_check").fetchone()[0] == "ok"
    assert base.execute("PRAGMA foreign_key_check").fetchall() == []
    assert base.execute("PRAGMA application_id").fetchone()[0] == int.from_bytes(b"GPKG", "big")
    assert base.execute("PRAGMA user_version").fetchone()[0] == 10300
    systems = {row["srs_id"]: row["organization"] for row in base.execute("SELECT * FROM gpkg_spatial_ref_sys")}
    assert systems == {-1: "NONE", 0: "NONE", 4326: "EPSG"}, systems
    declared = {row["table_name"]: tuple(row)[1:4] for row in base.execute("SELECT * FROM gpkg_geometry_columns")}
    assert declared == {"nodes": ("geom", "POINT", 4326), "segments": ("geom", "LINESTRING", 4326)}, declared
    for row in base.execute("SELECT * FROM nodes"):
        known = nodes[str(row["id"])]
        assert isinstance(row["id"], int) and geometry(row["geom"], 4326) == [known["geometry"]["coordinates"]], tuple(row)
        for name in ("pads", "role", "altitude_m", "altitude_reference", "name"):
            assert row[name] == known["properties"].get(name), (row["id"], name)
    assert base.execute("SELECT count(*) FROM nodes").fetchone()[0] == len(nodes)
    for row in base.execute("SELECT * FROM segments"):
        known = segments[frozenset((str(row["from"]), str(row["to"])))]
        ends = [nodes[str(row[end])]["geometry"]["coordinates"] for end in ("from", "to")]
        assert geometry(row["geom"], 4326) == ends, tuple(row)
        for name in ("id", "length_m", "lower_m", "lower_reference", "upper_m", "upper_reference", "speed_limit_mps"):
            assert row[name] == known.get(name), (tuple(row), name)
    assert base.execute("SELECT count(*) FROM segments").fetchone()[0] == len(segments)
    box = base.execute("SELECT min_x, min_y, max_x, max_y FROM gpkg_contents WHERE table_name = 'nodes'").fetchone()
    lons, lats = zip(*(node["geometry"]["coordinates"] for node in nodes.values()))
    for found, wanted in zip(box, (min(lons), min(lats), max(lons), max(lats)), strict=True):
        assert abs(found - wanted) < 1e-9, tuple(box)

    # Changed by another program, and left with its log, as QGIS leaves it.
    base.execute("UPDATE nodes SET pads = 7 WHERE id = 379")
    base.execute("ALTER TABLE nodes ADD COLUMN seen TEXT")
    base.commit()
    base.execute("PRAGMA journal_mode = WAL")
    base.close()
    command = [program, "network", "convert", "--network", str(file), "--to", "geojson"]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "attributes of nodes: seen" in run.stderr, run.stderr
    again, joined = parts(json.loads(run.stdout))
    nodes["379"]["properties"]["pads"] = 7
    assert (again, joined) == (nodes, segments)
    print(f"GeoPackage: {len(nodes)} nodes and {len(segments)} segments by SQLite {sqlite3.sqlite_version}, and back")


# --- an OSM extract ---


def varint(number):
    out = bytearray()
    while number > 0x7F:
        out.append(number & 0x7F | 0x80)
        number >>= 7
    return bytes(out) + bytes([number])


def field(number, value):
    if isinstance(value, int):
        return varint(number << 3) + varint(value)
    return varint(number << 3 | 2) + varint(len(value)) + value


def deltas(numbers):
    steps = [after - before for before, after in zip([0, *numbers], numbers)]
    return b"".join(varint(2 * step if step >= 0 else -2 * step - 1) for step in steps)


def blob(kind, message):
    content = field(2, len(message)) + field(3, zlib.compress(message))
    header = field(1, kind.encode()) + field(3, len(content))
    return struct.pack(">I", len(header)) + header + content


def extract(nodes, ways, relations):
    texts = [""]

    def places(words):
        texts.extend(word for word in words if word not in texts)
        return b"".join(varint(texts.index(word)) for word in words)

    ids = sorted(nodes)
    columns = (ids, [nodes[i][1] for i in ids], [nodes[i][0] for i in ids])
    dense = b"".join(field(number, deltas(column)) for number, column in zip((1, 8, 9), columns))
    groups = [field(2, dense)]
    for way, (corners, tags) in ways.items():
        told_tags = field(2, places(tags)) + field(3, places(tags.values()))
        groups.append(field(3, field(1, way) + told_tags + field(8, deltas(corners))))
    for relation, (members, tags) in relations.items():
        told_tags = field(2, places(tags)) + field(3, places(tags.values()))
        roles = field(8, places([role for _, role in members]))
        columns = field(9, deltas([way for way, _ in members])) + field(10, bytes([1] * len(members)))
        groups.append(field(4, field(1, relation) + told_tags + roles + columns))
    strings = field(1, b"".join(field(1, text.encode()) for text in texts))
    header = blob("OSMHeader", field(4, b"OsmSchema-V0.6") + field(4, b"DenseNodes"))
    return header + blob("OSMData", strings + b"".join(field(2, group) for group in groups))


def tell_extract(program, folder):
    """A network from an extract is that from the same buildings as GeoJSON."""
    nodes, ways, rings = {}, {}, {}

    def square(way, column, row, side=SIDE, **tags):
        x, y = WEST + int(column * 6_000), SOUTH + int(row * 6_000)
        corners = [(x, y), (x + side, y), (x + side, y + side), (x, y + side)]
        ids = [4 * way + i for i in range(4)]
        nodes.update(zip(ids, corners))
        ways[way] = ([*ids, ids[0]], {key.replace("__", ":"): value for key, value in tags.items()})
        rings[way] = [[round(x * STEP_DEG, 7), round(y * STEP_DEG, 7)] for x, y in [*corners, corners[0]]]

    square(1, 0, 0, building="yes", height="30", name="Hall")
    square(2, 1, 0, building="house", building__levels="10")
    square(3, 0, 1)
    square(4, 0.125, 1.125, side=SIDE // 2)
    square(5, 1, 1, building="shed")
    square(6, 5, 5, leisure="park")
    square(7, 9, 0, building="yes", height="90 ft")
    relations = {9: ([(3, "outer"), (4, "inner")], {"type": "multipolygon", "building": "yes", "height": "28 m"})}
    file = folder / "town.osm.pbf"
    file.write_bytes(extract(nodes, ways, relations))

    heights = {"way/1": (30, [rings[1]]), "way/2": (35, [rings[2]]), "way/5": (None, [rings[5]]),
               "way/7": (90 * 0.3048, [rings[7]]), "relation/9": (28, [rings[3], rings[4]])}
    features = [
        {"type": "Feature", "id": name, "geometry": {"type": "Polygon", "coordinates": rings},
         "properties": {"height_m": height, "name": "Hall" if name == "way/1" else None}}
        for name, (height, rings) in heights.items()
    ]
    buildings = folder / "town.geojson"
    rules = ["--reach", "600", "--attribution", "OSM", "--quiet"]

    def built(source, *arguments):
        return told(program, "network", "build", str(source), *rules, *arguments)

    buildings.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    whole = built(file)
    assert whole == built(buildings) and len(parts(json.loads(whole))[0]) >= 3, whole
    near = [f for f in features if f["id"] != "way/7"]
    buildings.write_text(json.dumps({"type": "FeatureCollection", "features": near}))
    box = ",".join(str(round(step * STEP_DEG, 7)) for step in (WEST - 1, SOUTH - 1, WEST + 20_000, SOUTH + 20_000))
    boxed = built(file, "--bbox", box)
    assert boxed == built(buildings) != whole
    unnamed = told(program, "network", "build", str(file), "--reach", "600", "--quiet")
    assert json.loads(unnamed)["attribution"] == "© OpenStreetMap contributors, ODbL 1.0"
    print(f"OSM extract: {file.stat().st_size} bytes, {len(features)} buildings, the same network as from GeoJSON")


def tell(program, folder: pathlib.Path):
    tell_graphml(program, folder)
    tell_geopackage(program, folder)
    tell_extract(program, folder)
