#!/usr/bin/env python3
"""Zones of the field in, against a naive reader of the standards; zones, routes and networks out, read by others' programs.

run.py SKYWAY    where SKYWAY is the program
"""

import datetime
import json
import pathlib
import random
import subprocess
import sys
import tempfile

import deviations
import drawings
import exports
import networks
import reader

DATA = pathlib.Path(__file__).resolve().parent / "data"
# Nodes so near to a boundary are left out: the margin, and the planes of two readers, lie there.
BOUNDARY_M = 60.0
ACROSS = 14
# Nodes lie at one height and the other in turn: samples have layers below 50 m and above.
HEIGHTS_M = (30.0, 60.0)
RANDOM_FEEDS = 12
SEED = 20261123

# Each sample: how it is read naively, what is imported, what is refused and by which code, and instants: weekday,
# night, before, within, after, each with how many nodes at least are closed then (0: exactly none).
STORIES = [
    ("ch-ed269-interuss.json", reader.ed269, ["LSXX"], {}, [
        ("2022-12-07T12:00:00Z", 1), ("2022-12-07T23:30:00Z", 1), ("2000-01-01T00:00:00Z", 1),
        ("2026-11-25T09:00:00Z", 1), ("2099-12-31T23:59:59Z", 1),
    ]),
    # All of them inform and close nothing, whatever their schedules say.
    ("be-brussels-early-ed269.json", reader.ed269,
     ["28525c8", *(f"c7b19b1~{n}" for n in range(1, 6)), *(f"593f5c5~{n}" for n in range(1, 6))], {}, [
         ("2020-06-02T13:00:00Z", 0), ("2020-06-01T23:00:00Z", 0), ("2019-06-03T13:00:00Z", 0),
         ("2020-06-01T13:00:00Z", 0), ("2022-06-06T13:00:00Z", 0),
     ]),
    ("ed318-official-collection.json", reader.ed318, ["NFZ6547~1", "NFZ6547~2", "ABC1234"], {}, [
        ("2019-06-12T12:00:00Z", 1), ("2019-06-12T23:00:00Z", 1), ("2018-12-30T16:30:00Z", 1),
        ("2019-06-16T11:00:00Z", 4), ("2020-01-02T16:30:00Z", 1),
    ]),
    ("px4-geofence-avoid.plan", reader.fence, ["polygon-1", "circle-1"], {"polygon-2": "zone_fence_keeps_in"}, [
        ("2026-11-25T12:00:00Z", 2), ("2026-11-25T23:00:00Z", 2), ("2000-01-01T00:00:00Z", 2),
        ("2026-11-25T09:00:00Z", 2), ("2099-12-31T00:00:00Z", 2),
    ]),
    ("Example_GeoZone_2_Layers.json", reader.ed318, None, {}, [("2019-06-12T16:30:00Z", 0)]),
    ("Example_GeoZone_Circle.json", reader.ed318, ["ABC1234"], {}, [("2019-06-12T16:30:00Z", 1)]),
    ("Example_GeoZone_with_extension.json", reader.ed318, ["ABC1234"], {}, [("2019-06-12T16:30:00Z", 1)]),
    # Its metadata is not valid, which concerns no zone.
    ("InvalidExample_GeoZone_2_Layers.json", reader.ed318, None, {}, [("2019-06-12T16:30:00Z", 0)]),
    ("PartialExample_featureGeoJSON.json", reader.ed318, None, {}, [("2019-06-12T16:30:00Z", 0)]),
]


def network(volumes):
    """Nodes over the volumes: a grid across all of them, and one across each."""
    boxes = [box(volume) for volume in volumes]
    boxes.append([f(b[i] for b in boxes) for i, f in enumerate((min, min, max, max))])
    places = []
    for west, south, east, north in boxes:
        lon_step, lat_step = (east - west) / (ACROSS - 1), (north - south) / (ACROSS - 1)
        places += [(west + i * lon_step, south + j * lat_step) for i in range(ACROSS) for j in range(ACROSS)]
    kept = [p for p in dict.fromkeys(places) if all(abs(volume.distance(p)) > BOUNDARY_M for volume in volumes)]
    features = []
    for number, (lon, lat) in enumerate(kept):
        told = {"kind": "node", "pads": 1, "role": "both", "altitude_reference": "agl"}
        told["altitude_m"] = HEIGHTS_M[number % 2]
        point = {"type": "Point", "coordinates": [lon, lat]}
        features.append({"type": "Feature", "id": number, "geometry": point, "properties": told})
    for number in range(len(kept) - 1):
        line = {"type": "LineString", "coordinates": [kept[number], kept[number + 1]]}
        told = {"kind": "segment", "from": number, "to": number + 1}
        features.append({"type": "Feature", "geometry": line, "properties": told})
    head = {"format": 1, "coordinates": "geographic"}
    return kept, {"type": "FeatureCollection", "name": "grid", "skyway": head, "features": features}


def box(volume):
    if volume.shape[0] == "circle":
        (lon, lat), degrees = volume.shape[1], volume.shape[2] / 80_000
        return [lon - 1.5 * degrees, lat - degrees, lon + 1.5 * degrees, lat + degrees]
    places = [p for ring in volume.shape[1] for p in ring]
    lons, lats = [p[0] for p in places], [p[1] for p in places]
    # A little beyond it on all sides.
    margin = 0.1 * max(max(lons) - min(lons), max(lats) - min(lats))
    return [min(lons) - margin, min(lats) - margin, max(lons) + margin, max(lats) + margin]


def check(program, feed, grid, at):
    command = [program, "zone", "import", str(feed), "--check", "--json", "--quiet", "--network", str(grid), "--at", at]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode in (0, 1), f"{command}: {run.returncode} {run.stderr}"
    told = json.loads(run.stdout)
    assert run.returncode == (1 if told["refused"] else 0), run.stderr
    return told


def hold(program, feed, volumes, instants, folder, least=None):
    """What is enforced at each instant is what the naive reader says."""
    kept, document = network(volumes)
    grid = folder / "grid.geojson"
    grid.write_text(json.dumps(document))
    told = None
    for at in instants:
        told = check(program, feed, grid, at)
        when = reader.instant(at)
        forced = [volume for volume in volumes if volume.in_force(when)]

        def closes(number, place, forced=forced):
            height_m = HEIGHTS_M[number % 2]
            return any(volume.reaches(height_m) and volume.distance(place) < 0 for volume in forced)

        expected = {number for number, place in enumerate(kept) if closes(number, place)}
        found = {int(node) for node in told["closed_nodes"]}
        ours, theirs = sorted(found - expected)[:5], sorted(expected - found)[:5]
        assert found == expected, f"{feed} at {at}: only skyway {ours}, only naive {theirs}"
        if least is not None:
            wanted = least[at]
            assert len(expected) >= wanted and (wanted or not expected), f"{feed} at {at}: {len(expected)} nodes"
    return told


def tell_samples(program, folder):
    for name, read, imported, refused, instants in STORIES:
        feed = DATA / name
        volumes = read(json.loads(feed.read_text("utf-8-sig")))
        least = dict(instants)
        told = hold(program, feed, volumes, list(least), folder, least if imported else None)
        ids = [entry["zone"]["id"] for entry in told["zones"]]
        if imported is not None:
            assert ids == imported, f"{name}: {ids}"
        codes = {entry["identifier"]: entry["faults"][0]["code"] for entry in told["refused"]}
        assert codes == refused, f"{name}: {codes}"
        for entry in told["refused"]:
            assert all(fault["pointer"] and fault["hint"] for fault in entry["faults"]), entry
        print(f"{name}: {len(ids)} zones, {len(codes)} refused, {len(instants)} instants")


# --- feeds by chance ---


def by_chance(chance, number):
    """A feed of ED-269 or ED-318 with every kind of time there is."""
    days = [[day] for day in reader.DAYS] + [["ANY"], ["MON", "TUE", "WED", "THU", "FRI"], ["SAT", "SUN"]]
    clocks = ["00:00:00Z", "05:30:00Z", "12:00:00Z", "18:45:30Z", "23:59:59Z", "07:00:00+02:00", "22:15:00-05:00"]
    is318 = number % 2 == 0
    zones = []
    for zone in range(12):
        periods = []
        for _ in range(chance.choice([0, 1, 1, 2])):
            period = {}
            begins = datetime.datetime(2026, 11, 1, tzinfo=datetime.timezone.utc)
            begins += datetime.timedelta(days=chance.randrange(25), hours=chance.randrange(24))
            if chance.random() < 0.5:
                period["startDateTime"] = begins.isoformat()
            if chance.random() < 0.5:
                ends = begins + datetime.timedelta(days=chance.randrange(1, 20), minutes=chance.randrange(999))
                period["endDateTime"] = ends.isoformat()
            dailies = []
            for _ in range(chance.choice([0, 1, 2])):
                daily = {"day": chance.choice(days)}
                for end in ("start", "end"):
                    if is318 and chance.random() < 0.3:
                        daily[f"{end}Event"] = chance.choice(["BMCT", "SR", "SS", "EECT"])
                    else:
                        daily[f"{end}Time"] = chance.choice(clocks)
                dailies.append(daily)
            if dailies:
                period["schedule"] = dailies
            periods.append(period)
        lon, lat = 4.0 + 0.05 * (zone % 4), 50.0 + 0.03 * (zone // 4)
        zones.append((f"Z{zone}", chance.choice(["PROHIBITED", "CONDITIONAL", "NO_RESTRICTION"]), (lon, lat), periods))
    return deviations.feed318(zones) if is318 else deviations.feed269(zones)


def tell_random(program, folder):
    chance = random.Random(SEED)
    count = 0
    for number in range(RANDOM_FEEDS):
        document = by_chance(chance, number)
        volumes = (reader.ed318 if "type" in document else reader.ed269)(document)
        feed = folder / "feed.json"
        feed.write_text(json.dumps(document))
        instants = []
        while len(instants) < 5:
            at = datetime.datetime(2026, 11, 10, tzinfo=datetime.timezone.utc)
            at += datetime.timedelta(minutes=chance.randrange(14 * 24 * 60))
            # Two readers differ by a minute or two in when the sun rises.
            edges = [at + datetime.timedelta(minutes=m) for m in (-6, -3, 0, 3, 6)]
            if all(len({volume.in_force(edge) for edge in edges}) == 1 for volume in volumes):
                instants.append(at.isoformat().replace("+00:00", "Z"))
        hold(program, feed, volumes, instants, folder)
        count += len(instants) * len(volumes)
    print(f"random feeds: {RANDOM_FEEDS}, {count} looks at a volume at an instant")


def main() -> int:
    program = str(pathlib.Path(sys.argv[1]).resolve())
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        tell_samples(program, folder)
        tell_random(program, folder)
        deviations.tell(program, folder, check)
        drawings.tell(program, folder, check, hold)
        exports.tell(program, folder)
        networks.tell(program, folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())
