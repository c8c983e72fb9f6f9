"""Zones and routes out: checked by the published schemas of ED-318, and read by pymavlink, gpxpy and an XML reader."""

import json
import math
import pathlib
import subprocess
import sys
import xml.etree.ElementTree

import gpxpy
import jsonschema
import referencing
import requests
from pymavlink import mavwp

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "contract"))
from edge_process import EdgeProcess  # noqa: E402

import reader  # noqa: E402

DATA = pathlib.Path(__file__).resolve().parent / "data"
SCHEMAS = DATA / "ed318-schema"
ENDS = ["--source", "379", "--destination", "450"]
KML = "{http://www.opengis.net/kml/2.2}"
TAKE_OFF, WAYPOINT, LAND, CHANGE_SPEED = 22, 16, 21, 178


def validator():
    resources = []
    for path in sorted(SCHEMAS.glob("*.json")):
        resource = referencing.Resource.from_contents(json.loads(path.read_text()))
        resources.append((f"https://ed318.invalid/{path.name}", resource))
    registry = referencing.Registry().with_resources(resources)
    return jsonschema.Draft7Validator({"$ref": "https://ed318.invalid/Schema_GeoZones.json"}, registry=registry)


def composed(program, *arguments):
    run = subprocess.run([program, "compose", *ENDS, *arguments], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    return run.stdout


def place_of(network, node):
    feature = next(f for f in network["features"] if str(f.get("id")) == str(node))
    return feature["geometry"]["coordinates"], feature["properties"].get("altitude_m")


def tell_routes(program, folder):
    command = [program, "network", "convert", "--to", "geojson", "--quiet"]
    exported = subprocess.run(command, capture_output=True, text=True, check=True)
    network = json.loads(exported.stdout)
    plan = json.loads(composed(program, "--json", "--quiet"))
    nodes = plan["path"]["nodes"]
    places = [place_of(network, node)[0] for node in nodes]
    roof = place_of(network, nodes[0])[1]

    # A fence beside the second leg, one that is over, one that is far above.
    lon, lat = places[1]
    near = [[lon + 0.002, lat], [lon + 0.003, lat], [lon + 0.003, lat + 0.001], [lon + 0.002, lat]]
    zone = {"type": "Feature", "geometry": {"type": "Polygon", "coordinates": [near]}, "properties": {"margin_m": 0}}
    over = dict(zone, id="over", properties={"margin_m": 0, "windows": [{"until": "2020-01-01T00:00:00Z"}]})
    high = dict(zone, id="high", properties={"margin_m": 0, "lower_m": 3000})
    shown = dict(zone, id="shown", properties={"margin_m": 0, "kind": "uspace"})
    circle = {"type": "Feature", "id": "circle", "geometry": {"type": "Point", "coordinates": near[1]},
              "properties": {"radius_m": 25, "margin_m": 0}}
    zones = folder / "zones.geojson"
    features = [dict(zone, id="near"), over, high, shown, circle]
    zones.write_text(json.dumps({"type": "FeatureCollection", "features": features}))

    told = json.loads(composed(program, "--format", "plan", "--quiet", "--zones", str(zones)))
    assert (told["fileType"], told["version"]) == ("Plan", 1)
    assert told["mission"]["version"] == told["geoFence"]["version"] == 2
    items = told["mission"]["items"]
    assert [item["doJumpId"] for item in items] == list(range(1, len(items) + 1))
    assert items[0]["command"] == TAKE_OFF and items[1]["command"] == CHANGE_SPEED and items[-1]["command"] == LAND
    over_nodes = []
    for item in items:
        assert item["type"] == "SimpleItem" and len(item["params"]) == 7
        if item["command"] != CHANGE_SPEED:
            place = [item["params"][5], item["params"][4]]
            if not over_nodes or over_nodes[-1] != place:
                over_nodes.append(place)
    same(over_nodes, places)
    end = place_of(network, nodes[-1])[1]
    assert math.isclose(items[-1]["params"][6], end - roof, abs_tol=1e-9), items[-1]
    same([told["mission"]["plannedHomePosition"][1::-1]], places[:1])
    polygons, circles = told["geoFence"]["polygons"], told["geoFence"]["circles"]
    assert len(polygons) == 1 and len(circles) == 1, told["geoFence"]
    assert not polygons[0]["inclusion"] and not circles[0]["inclusion"]
    same([[lon, lat] for lat, lon in polygons[0]["polygon"]], near[:-1])
    # The fence is what the reader of fences makes of it, and what skyway reads back.
    volumes = reader.fence(told)
    assert [volume.identifier for volume in volumes] == ["polygon-1", "circle-1"]
    alternates = {leg["alternate"]["node"] for leg in plan["legs"] if leg["alternate"]}
    assert told["rallyPoints"]["version"] == 2 and len(told["rallyPoints"]["points"]) == len(alternates)

    waypoints = folder / "mission.waypoints"
    waypoints.write_text(composed(program, "--format", "wpl", "--quiet"))
    loader = mavwp.MAVWPLoader()
    assert loader.load(str(waypoints)) == len(items) + 1
    for item, read in zip(items, [loader.wp(n) for n in range(1, loader.count())], strict=True):
        assert (read.command, read.frame) == (item["command"], item["frame"]), read
        if item["command"] != CHANGE_SPEED:
            assert math.isclose(read.x, item["params"][4], abs_tol=1e-6), read
            assert math.isclose(read.y, item["params"][5], abs_tol=1e-6), read
            assert math.isclose(read.z, item["params"][6], abs_tol=1e-3), read

    gpx = gpxpy.parse(composed(program, "--format", "gpx", "--quiet"))
    points = gpx.routes[0].points
    same(unlike([[point.longitude, point.latitude] for point in points]), places)
    assert {point.name for point in points} == {str(node) for node in nodes}
    assert len(gpx.waypoints) == len(alternates)

    kml = xml.etree.ElementTree.fromstring(composed(program, "--format", "kml", "--quiet"))
    line = kml.find(f".//{KML}LineString")
    positions = [list(map(float, text.split(","))) for text in line.find(f"{KML}coordinates").text.split()]
    assert line.find(f"{KML}altitudeMode").text == "relativeToGround"
    same(unlike([position[:2] for position in positions]), places)

    geojson = json.loads(composed(program, "--format", "geojson", "--quiet"))
    route = geojson["features"][0]["geometry"]["coordinates"]
    assert route == positions
    print(f"routes: {len(items)} commands, {len(points)} points, {len(alternates)} alternates, by pymavlink and gpxpy")


def unlike(places):
    """Places without those that only climb."""
    kept = places[:1]
    for place in places[1:]:
        if place != kept[-1]:
            kept.append(place)
    return kept


def same(found, wanted):
    assert len(found) == len(wanted), f"{found} {wanted}"
    for one, other in zip(found, wanted, strict=True):
        assert all(math.isclose(a, b, abs_tol=1e-9) for a, b in zip(one, other, strict=True)), f"{one} {other}"


def imported(edge_url, feed, text, kind="application/json", **parameters):
    answer = requests.post(
        f"{edge_url}/v1/zones:import", params={"feed": feed, **parameters}, data=text.encode(),
        headers={"content-type": kind}, timeout=30,
    )
    assert answer.status_code == 200, answer.text
    return answer.json()


def listed(edge_url):
    return requests.get(f"{edge_url}/v1/zones?page_size=1000", timeout=30).json()["features"]


def tell_edge(program, folder):
    """A feed by REST and by the command: one revision, what is absent goes, what is refused stays."""
    sample = json.loads((DATA / "ed318-official-collection.json").read_text())
    with EdgeProcess(program) as edge:
        edge_url = f"http://127.0.0.1:{edge.port}"
        preview = imported(edge_url, "official", json.dumps(sample), validate_only="true")
        assert preview["counts"]["created"] == 3 and not preview["enforced"] and not listed(edge_url), preview
        before = preview["revision"]
        first = imported(edge_url, "official", json.dumps(sample))
        assert first["counts"]["created"] == 3 and first["enforced"], first
        assert int(first["revision"].split("-")[1]) == int(before.split("-")[1]) + 1, (before, first["revision"])
        again = imported(edge_url, "official", json.dumps(sample))
        assert again["counts"]["unchanged"] == 3 and again["revision"] == first["revision"], again

        # Out as ED-318, valid by the published schemas, and in again: the same zones.
        headers = {"accept": "application/vnd.eurocae.ed318+json"}
        out = requests.get(f"{edge_url}/v1/zones", headers=headers, timeout=30).json()
        validator().validate(out)
        back = imported(edge_url, "back", json.dumps(out), prefix="b-", validate_only="true")
        assert back["counts"]["created"] == 3 and not back["refused"], back
        command = [program, "zone", "export", "--edge", edge_url, "--format", "ed318"]
        by_command = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        assert json.loads(by_command) == out

        # One zone is refused and keeps its last version; another is gone.
        bent = json.loads(json.dumps(sample))
        del bent["features"][0]["properties"]["type"]
        del bent["features"][1]
        told = imported(edge_url, "official", json.dumps(bent))
        counts = told["counts"]
        assert (counts["refused"], counts["kept"], counts["removed"]) == (1, 2, 1), told
        assert told["refused"][0]["identifier"] == "NFZ6547", told
        assert [zone["id"] for zone in listed(edge_url)] == ["NFZ6547~1", "NFZ6547~2"]
        feed = folder / "bent.json"
        feed.write_text(json.dumps(bent))
        command = [program, "zone", "import", str(feed), "--feed", "official", "--edge", edge_url]
        run = subprocess.run(command, capture_output=True, text=True, check=False)
        assert run.returncode == 1 and "refused: 1" in run.stdout and "kept 2" in run.stdout, run

        # An id of somebody else's zone is not taken.
        taken = imported(edge_url, "other", json.dumps(sample))
        assert taken["counts"]["refused"] == 2 and taken["counts"]["created"] == 1, taken

        # KML by its media type and as JSON is sent; what is in it counts. A KMZ is told to be unpacked.
        square = "151.2,-33.9 151.21,-33.9 151.21,-33.89 151.2,-33.89 151.2,-33.9"
        ring = f"<outerBoundaryIs><LinearRing><coordinates>{square}</coordinates></LinearRing></outerBoundaryIs>"
        line = "<LineString><coordinates>151.2,-33.9 151.3,-33.9</coordinates></LineString>"
        placemarks = f'<Placemark id="pier"><Polygon>{ring}</Polygon></Placemark><Placemark id="line">{line}</Placemark>'
        drawn = f"<kml>{placemarks}</kml>"
        for kind, count in (("application/vnd.google-earth.kml+xml; charset=utf-8", 1), ("application/json", 0)):
            told = imported(edge_url, "drawn", drawn, kind)
            counts = told["counts"]
            assert told["format"] == "kml" and (counts["created"], counts["refused"]) == (count, 1), told
        assert told["refused"][0]["identifier"] == "line" and told["zones"][0]["in_force"], told
        zipped = b"PK\x03\x04"
        for kind, body, status in (
            ("application/vnd.google-earth.kmz", zipped, 415), ("application/json", zipped, 400), ("text/csv", b"", 415),
        ):
            headers = {"content-type": kind}
            answer = requests.post(f"{edge_url}/v1/zones:import?feed=drawn", data=body, headers=headers, timeout=30)
            assert answer.status_code == status, answer.text
            assert ("unpack" in answer.text) == (body == zipped), answer.text
        feed = folder / "drawn.kml"
        feed.write_text(drawn)
        command = [program, "zone", "import", str(feed), "--edge", edge_url]
        run = subprocess.run(command, capture_output=True, text=True, check=False)
        assert run.returncode == 1 and "kml from drawn" in run.stdout and "/Placemark/1/LineString" in run.stderr, run

        # Many removals at once wait.
        many = {"type": "FeatureCollection", "features": [circle_at(n) for n in range(30)]}
        assert imported(edge_url, "many", json.dumps(many))["counts"]["created"] == 30
        few = dict(many, features=many["features"][:15])
        held = imported(edge_url, "many", json.dumps(few))
        assert held["counts"]["held"] == 15 and held["counts"]["removed"] == 0, held
        assert sum(zone["id"].startswith("m") for zone in listed(edge_url)) == 30
        hold = requests.get(f"{edge_url}/v1/holds", timeout=30).json()["holds"][0]
        assert hold["origin"] == "feed:many" and hold["closure_count"] == 15, hold
        requests.post(f"{edge_url}/v1/holds/{hold['id']}/release", timeout=30).raise_for_status()
        assert sum(zone["id"].startswith("m") for zone in listed(edge_url)) == 15

        body = {"source": "379", "destination": "450", "drone_id": "d"}
        plan = requests.post(f"{edge_url}/v1/plans", json=body, timeout=30).json()
        headers = {"accept": "application/gpx+xml"}
        route = requests.get(f"{edge_url}/v1/plans/{plan['id']}", headers=headers, timeout=30)
        assert route.headers["content-type"] == "application/gpx+xml"
        names = {point.name for point in gpxpy.parse(route.text).routes[0].points}
        assert names == set(plan["reported"]["path"]["nodes"]), names
    print("edge: preview, one revision, kept, removed, held, exported by the schemas")


def circle_at(number):
    return {
        "type": "Feature", "id": f"m{number}", "properties": {"radius_m": 5},
        "geometry": {"type": "Point", "coordinates": [151.3 + number * 0.001, -33.9]},
    }


def tell(program, folder):
    tell_routes(program, folder)
    tell_edge(program, folder)
