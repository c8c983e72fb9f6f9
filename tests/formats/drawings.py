"""KML as people draw it and programs write it: by chance against the naive reader, and what is refused by its place."""

import datetime
import random

import reader

SEED = 20261125
FILES = 8
PLACEMARKS = 12
HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'


def ring(chance, place, size):
    """A square whose corners are moved a little."""
    lon, lat = place
    corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
    corners = [(x + chance.uniform(-0.1, 0.1), y + chance.uniform(-0.1, 0.1)) for x, y in corners]
    moved = [(lon + size * x, lat + size * y) for x, y in corners]
    return moved + moved[:1]


def boundary(name, positions, height):
    """Blanks between positions are of any kind."""
    written = "\n\t".join(f"{lon:.9f},{lat:.9f}{height}" for lon, lat in positions)
    return f"<{name}><LinearRing><coordinates> {written} </coordinates></LinearRing></{name}>"


def polygon(chance, place):
    mode, height, extrude = chance.choice([
        ("", "", ""), ("clampToGround", ",0", ""), ("relativeToGround", ",45", "1"), ("relativeToGround", ",120", "1"),
        ("absolute", ",300", "1"),
    ])
    told = f"<extrude>{extrude}</extrude>" if extrude else ""
    told += f"<altitudeMode>{mode}</altitudeMode>" if mode else ""
    told += boundary("outerBoundaryIs", ring(chance, place, 0.012), height)
    if chance.random() < 0.4:
        told += boundary("innerBoundaryIs", ring(chance, (place[0] + 0.004, place[1] + 0.004), 0.004), height)
    return f"<Polygon>{told}</Polygon>"


def span(chance):
    begins = datetime.datetime(2026, 11, 1, tzinfo=datetime.timezone.utc)
    begins += datetime.timedelta(days=chance.randrange(25), hours=chance.randrange(24))
    ends = begins + datetime.timedelta(days=chance.randrange(1, 20), minutes=chance.randrange(999))
    told = ""
    if chance.random() < 0.7:
        told += f"<begin>{begins.isoformat()}</begin>"
    if chance.random() < 0.7:
        told += f"<end>{ends.isoformat()}</end>"
    return f"<TimeSpan>{told}</TimeSpan>"


def by_chance(chance):
    """Placemarks in folders, of one polygon or of two."""
    folders = ["", ""]
    for number in range(PLACEMARKS):
        place = (4.0 + 0.05 * (number % 4), 50.0 + 0.03 * (number // 4))
        shape = polygon(chance, place)
        if chance.random() < 0.3:
            label = f"<Point><coordinates>{place[0]},{place[1]}</coordinates></Point>"
            shape = f"<MultiGeometry>{label}{shape}{polygon(chance, (place[0] + 0.025, place[1]))}</MultiGeometry>"
        told = span(chance) if chance.random() < 0.6 else ""
        folders[number % 2] += f'<Placemark id="P{number}"><name>Zone {number}</name>{told}{shape}</Placemark>'
    document = f"<Document>{folders[0]}<Folder><name>more</name>{folders[1]}</Folder></Document>"
    return f'{HEAD}<kml xmlns="http://www.opengis.net/kml/2.2">{document}</kml>'


SQUARE = "4.0,50.0,90 4.01,50.0,90 4.01,50.01,90 4.0,50.01,90 4.0,50.0,90"
OUTER = f"<outerBoundaryIs><LinearRing><coordinates>{SQUARE}</coordinates></LinearRing></outerBoundaryIs>"
RAISED = "<extrude>1</extrude><altitudeMode>absolute</altitudeMode>"

# What a Placemark has, the code, and the end of the place.
REFUSED = [
    ("<LineString><coordinates>4.0,50.0 4.1,50.0</coordinates></LineString>", "zone_geometry_unsupported", "/LineString"),
    ("<Point><coordinates>4.0,50.0</coordinates></Point>", "zone_geometry_unsupported", "/Point"),
    (
        "<Polygon><altitudeMode>absolute</altitudeMode>" + OUTER + "</Polygon>",
        "zone_altitude_invalid",
        "/Polygon",
    ),
    (f"<Polygon>{RAISED}{OUTER.replace(',90 ', ',80 ', 1)}</Polygon>", "zone_altitude_invalid", "/Polygon"),
    (f"<Polygon>{OUTER.replace('4.01,50.0,', '4.01;50.0,')}</Polygon>", "zone_position_not_pair", "/Polygon/0/1"),
    (f"<Polygon>{OUTER.replace('4.01,50.0,', '4.01,95.0,')}</Polygon>", "zone_latitude_out_of_range", "/Polygon/0/1"),
    (
        f"<TimeStamp><when>2026-11-01T00:00:00Z</when></TimeStamp><Polygon>{OUTER}</Polygon>",
        "zone_time_invalid",
        "/TimeStamp",
    ),
    (
        f"<TimeSpan><begin>2026-11-01</begin></TimeSpan><Polygon>{OUTER}</Polygon>",
        "zone_time_invalid",
        "/TimeSpan/begin",
    ),
]


def drawing(*contents):
    placemarks = "".join(f'<Placemark id="{identifier}">{content}</Placemark>' for identifier, content in contents)
    return f'{HEAD}<kml xmlns="http://www.opengis.net/kml/2.2"><Document>{placemarks}</Document></kml>'


def tell(program, folder, check, hold):
    chance = random.Random(SEED)
    feed, grid = folder / "feed.kml", folder / "grid.geojson"
    count = 0
    for _ in range(FILES):
        feed.write_text(by_chance(chance))
        volumes = reader.kml(feed.read_text())
        instants = []
        for _ in range(4):
            at = datetime.datetime(2026, 11, 10, tzinfo=datetime.timezone.utc)
            at += datetime.timedelta(minutes=chance.randrange(14 * 24 * 60))
            instants.append(at.isoformat().replace("+00:00", "Z"))
        told = hold(program, feed, volumes, instants, folder)
        assert not told["refused"] and len(told["zones"]) == len(volumes), told["refused"]
        count += len(instants) * len(volumes)
    for content, code, place in REFUSED:
        feed.write_text(drawing(("BAD", content), ("GOOD", f"<Polygon>{RAISED}{OUTER}</Polygon>")))
        told = check(program, feed, grid, "2026-11-25T12:00:00Z")
        assert [entry["zone"]["id"] for entry in told["zones"]] == ["GOOD"], f"{code}: {told}"
        [entry] = told["refused"]
        fault = entry["faults"][0]
        assert (entry["identifier"], fault["code"]) == ("BAD", code) and fault["hint"], fault
        assert fault["pointer"] == f"/kml/Document/0/Placemark/0{place}", fault
    print(f"drawings: {FILES}, {count} looks at a volume at an instant, {len(REFUSED)} refused by their place")
