"""What national feeds make of the standards: each is read, and each repair is listed."""

import json

SQUARE = 0.01


def ring(place):
    lon, lat = place
    return [[lon, lat], [lon + SQUARE, lat], [lon + SQUARE, lat + SQUARE], [lon, lat + SQUARE], [lon, lat]]


def feed269(zones):
    listed = []
    for identifier, kind, place, periods in zones:
        applicability = [dict(period, permanent="NO") for period in periods] or [{"permanent": "YES"}]
        volume = {
            "uomDimensions": "M",
            "lowerLimit": 0,
            "lowerVerticalReference": "AGL",
            "upperLimit": 120,
            "upperVerticalReference": "AGL",
            "horizontalProjection": {"type": "Polygon", "coordinates": [ring(place)]},
        }
        listed.append({
            "identifier": identifier, "country": "BEL", "type": "COMMON", "restriction": kind,
            "applicability": applicability, "zoneAuthority": [{"name": "a"}], "geometry": [volume],
        })
    return {"title": "by chance", "features": listed}


def feature(identifier, kind, place, periods=None, **others):
    layer = {"upper": 120, "upperReference": "AGL", "lower": 0, "lowerReference": "AGL", "uom": "m"}
    told = {
        "identifier": identifier, "country": "BEL", "type": kind, "variant": "COMMON",
        "zoneAuthority": [{"purpose": "INFORMATION"}],
    }
    if periods:
        told["limitedApplicability"] = periods
    told.update(others)
    geometry = {"type": "Polygon", "coordinates": [ring(place)], "layer": layer}
    return {"type": "Feature", "geometry": geometry, "properties": told}


def feed318(zones):
    return {"type": "FeatureCollection", "features": [feature(*zone) for zone in zones]}


def irish():
    """MultiPolygon, datasetMetadata, a name and a reason that are texts, nulls, a layer in feet."""
    zone = feature("EIP1", "PROHIBITED", (-6.3, 53.3), name="Prison", reason="SENSITIVE", message=None)
    layer = {"upper": 400, "upperReference": "AGL", "lower": 0, "lowerReference": "AGL", "uom": "ft"}
    polygons = [[ring((-6.3, 53.3))], [ring((-6.2, 53.3))]]
    zone["geometry"] = {"type": "MultiPolygon", "coordinates": polygons, "layer": layer}
    return {"type": "FeatureCollection", "datasetMetadata": {"validFrom": "2026-01-01T00:00:00Z"}, "features": [zone]}


def spanish():
    """The zone and its layer below properties, an empty text for nothing, a day that is no list, an M for metres."""
    zone = feature("LEAE1", "REQ_AUTHORIZATION", (-3.7, 40.4), reasons="AIR_TRAFFIC", message="")
    zone["properties"]["limitedApplicability"] = [
        {"schedule": [{"day": "ANY", "startTime": "06:00Z", "endTime": "20:00Z"}]}
    ]
    layer = zone["geometry"].pop("layer")
    layer["uom"] = "M"
    zone["properties"] = {"UASZone": zone["properties"], "verticalLayer": layer}
    return {"type": "FeatureCollection", "features": [zone]}


def spanish_flat():
    """All members beside each other, as ED-269 names the limits."""
    zone = feature("LEIN1", "PROHIBITED", (-3.7, 40.4))
    del zone["geometry"]["layer"]
    zone["properties"].update({
        "lowerLimit": "0", "lowerVerticalReference": "AGL", "upperLimit": 120, "upperVerticalReference": "AGL",
        "uomDimensions": "M", "objectid": 7, "shapeArea": 1.5,
    })
    return {"type": "FeatureCollection", "features": [zone]}


def zurich():
    """The spelling of ED-269 in ED-318, and an identifier of nine letters."""
    return {"type": "FeatureCollection", "features": [feature("USPACEZRH", "REQ_AUTHORISATION", (8.5, 47.4))]}


def swedish():
    """Times without seconds."""
    periods = [{"schedule": [{"day": ["MON"], "startTime": "06:00Z", "endTime": "16:00Z"}]}]
    return {"type": "FeatureCollection", "features": [feature("ESR1", "PROHIBITED", (18.0, 59.3), periods)]}


def finnish():
    """A byte order mark, a limit that is not stated."""
    document = feed269([("EFR1", "PROHIBITED", (24.9, 60.2), [])])
    volume = document["features"][0]["geometry"][0]
    volume["upperLimit"] = None
    return document


def swiss():
    """99999 for no ceiling, limits as texts."""
    document = feed269([("CH1", "PROHIBITED", (8.5, 47.4), [])])
    document["features"][0]["geometry"][0].update(upperLimit=99999, lowerLimit="0")
    return document


def half_flat():
    """Limits named after both standards in one layer, in feet."""
    zone = feature("BE1", "PROHIBITED", (4.4, 50.8))
    zone["geometry"]["layer"] = {
        "lower": 0, "lowerReference": "AGL", "upperLimit": 400, "upperReference": "AGL", "uomDimensions": "FT",
    }
    return {"type": "FeatureCollection", "features": [zone]}


# The feed, how it begins, what it becomes, and a part of each repair that is listed.
READ = [
    (irish, "", {"kind": None, "upper_m": 121.92}, ["MultiPolygon", "validity of the collection", "no list"]),
    (
        spanish,
        "",
        {"kind": "req_authorization", "upper_m": 120},
        ["properties of the zone", "layer of the shape", "no list", "reason"],
    ),
    (
        spanish_flat,
        "",
        {"kind": None, "upper_m": 120},
        ["limits were read", "in quotes", "nothing acts on: objectid, shapeArea"],
    ),
    (half_flat, "", {"upper_m": 121.92, "lower_m": 0}, ["was read as the upper", "was read as the uom"]),
    (zurich, "", {"kind": "req_authorization"}, ["longer than the 7 letters"]),
    (swedish, "", {"kind": None}, []),
    # The command passes over the mark, as it does in every file.
    (finnish, "\ufeff", {"upper_m": None}, []),
    (swiss, "", {"upper_m": None, "lower_m": 0}, ["99999", "in quotes"]),
]

# What is changed in a zone of ED-318, the code, and the end of the place.
REFUSED = [
    (lambda zone: zone["properties"].pop("type"), "zone_missing_field", "/properties/type"),
    (lambda zone: zone["properties"].update(type="FORBIDDEN"), "zone_unknown_value", "/properties/type"),
    (lambda zone: zone["properties"].update(identifier=""), "zone_missing_field", "/properties/identifier"),
    (lambda zone: zone["geometry"].update(type="LineString"), "zone_unknown_value", "/geometry/type"),
    (lambda zone: zone["geometry"]["layer"].pop("upperReference"), "zone_missing_field", "/layer/upperReference"),
    (lambda zone: zone["geometry"]["layer"].update(uom="yd"), "zone_unknown_value", "/layer/uom"),
    (lambda zone: zone["geometry"]["layer"].update(upperLimit=60), "zone_unknown_field", "/layer/upperLimit"),
    (lambda zone: zone["geometry"]["layer"].update(lower=200), "zone_band_reversed", "/geometry/coordinates"),
    (
        lambda zone: zone["geometry"]["coordinates"][0].__setitem__(1, [4.0, 95.0]),
        "zone_latitude_out_of_range",
        "/coordinates/0/1",
    ),
    (
        lambda zone: daily(zone, {"day": ["MON"], "startTime": "06:00", "endTime": "16:00Z"}),
        "zone_time_invalid",
        "/0/startTime",
    ),
    (lambda zone: daily(zone, {"day": ["MON"], "startTime": "06:00Z"}), "zone_missing_field", "/0/endTime"),
    (lambda zone: daily(zone, {"day": ["MOON"], "startEvent": "SR", "endEvent": "SS"}), "zone_unknown_value", "/day/0"),
    (lambda zone: daily(zone, {"day": [], "startEvent": "SR", "endEvent": "SS"}), "zone_schedule_invalid", "/0/day"),
    (
        lambda zone: daily(zone, {"day": ["ANY"], "startEvent": "NOON", "endEvent": "SS"}),
        "zone_unknown_value",
        "/0/startEvent",
    ),
    (
        lambda zone: zone["properties"].update(
            limitedApplicability=[{"startDateTime": "2026-02-01T00:00:00Z", "endDateTime": "2026-01-01T00:00:00Z"}]
        ),
        "zone_window_reversed",
        "/endDateTime",
    ),
    (
        lambda zone: zone["properties"].update(limitedApplicability=[{"startDateTime": "2026-02-01T00:00:00"}]),
        "zone_time_invalid",
        "/startDateTime",
    ),
]


def daily(zone, entry):
    zone["properties"]["limitedApplicability"] = [{"schedule": [entry]}]


def tell(program, folder, check):
    feed, grid = folder / "feed.json", folder / "grid.geojson"
    grid.write_text(json.dumps({
        "type": "FeatureCollection", "skyway": {"format": 1, "coordinates": "geographic"},
        "features": [
            {"type": "Feature", "id": n, "geometry": {"type": "Point", "coordinates": [4.0 + 0.001 * n, 50.0]},
             "properties": {"kind": "node", "pads": 1, "role": "both"}}
            for n in range(2)
        ] + [{
            "type": "Feature", "geometry": {"type": "LineString", "coordinates": [[4.0, 50.0], [4.001, 50.0]]},
            "properties": {"kind": "segment", "from": 0, "to": 1},
        }],
    }))
    at = "2026-11-25T12:00:00Z"
    for made, mark, properties, repairs in READ:
        feed.write_text(mark + json.dumps(made()))
        told = check(program, feed, grid, at)
        assert not told["refused"] and len(told["zones"]) == 1, f"{made.__name__}: {told}"
        zone = told["zones"][0]["zone"]["properties"]
        for name, value in properties.items():
            found = zone.get(name)
            same = abs(found - value) < 1e-9 if isinstance(value, float) else found == value
            assert same, f"{made.__name__}: {name} is {found}, not {value}"
        notes = "\n".join(note["message"] for note in told["notes"])
        for repair in repairs:
            assert repair in notes, f"{made.__name__}: no '{repair}' in {notes}"
    for bend, code, place in REFUSED:
        bent, whole = feature("BAD", "PROHIBITED", (4.0, 50.0)), feature("GOOD", "PROHIBITED", (4.1, 50.0))
        bend(bent)
        feed.write_text(json.dumps({"type": "FeatureCollection", "features": [bent, whole]}))
        told = check(program, feed, grid, at)
        assert [entry["zone"]["id"] for entry in told["zones"]] == ["GOOD"], f"{code}: {told}"
        fault = told["refused"][0]["faults"][0]
        assert fault["code"] == code and fault["pointer"].endswith(place), f"{code} {place}: {fault}"
        assert fault["pointer"].startswith("/features/0/") and fault["hint"], fault
    print(f"deviations: {len(READ)} read, {len(REFUSED)} refused by their place")
