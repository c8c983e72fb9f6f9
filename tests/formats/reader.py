"""Zones of ED-269, ED-318, KML and fences of QGroundControl as the standards have them, read naively.

It shares no code with the program: positions are looked at one by one, instants too.
"""

import datetime
import math
import xml.etree.ElementTree

DAYS = ["MON", "TUE", "WED", "THU", "FRI", "SAT", "SUN"]
CLOSES = {"PROHIBITED", "REQ_AUTHORISATION", "REQ_AUTHORIZATION", "CONDITIONAL"}
UTC = datetime.timezone.utc
METRES = {"M": 1.0, "FT": 0.3048}
EARTH_M = 6_371_008.8


def instant(text):
    return datetime.datetime.fromisoformat(text.replace("Z", "+00:00"))


class Volume:
    """One volume of a zone: whether it closes a place, and when."""

    def __init__(self, identifier, kind, shape, lower, upper, periods):
        self.identifier = identifier
        self.kind = kind
        self.shape = shape
        self.lower = lower
        self.upper = upper
        # None: always.
        self.periods = periods

    def in_force(self, at):
        if self.kind not in CLOSES:
            return False
        return self.periods is None or any(period_holds(period, at, self.centre()) for period in self.periods)

    def centre(self):
        if self.shape[0] == "circle":
            return self.shape[1]
        ring = self.shape[1][0]
        return (sum(p[0] for p in ring) / len(ring), sum(p[1] for p in ring) / len(ring))

    def reaches(self, height_agl):
        """Whether it may reach a height above ground: other references cannot be compared."""
        if self.lower and self.lower[1] == "AGL" and height_agl < self.lower[0]:
            return False
        return not (self.upper and self.upper[1] == "AGL" and height_agl > self.upper[0])

    def distance(self, place):
        """Metres to its boundary, negative inside."""
        if self.shape[0] == "circle":
            return metres(place, self.shape[1]) - self.shape[2]
        inside = False
        nearest = math.inf
        for ring in self.shape[1]:
            for start, end in zip(ring, ring[1:] + ring[:1], strict=True):
                nearest = min(nearest, to_line(place, start, end))
                if (start[1] > place[1]) != (end[1] > place[1]):
                    crossing = start[0] + (place[1] - start[1]) / (end[1] - start[1]) * (end[0] - start[0])
                    inside ^= place[0] < crossing
        return -nearest if inside else nearest


def flat(place, about):
    east = math.radians(place[0] - about[0]) * math.cos(math.radians(about[1])) * EARTH_M
    return east, math.radians(place[1] - about[1]) * EARTH_M


def metres(one, other):
    return math.hypot(*flat(one, other))


def to_line(place, start, end):
    (ax, ay), (bx, by) = flat(start, place), flat(end, place)
    dx, dy = bx - ax, by - ay
    length2 = dx * dx + dy * dy
    t = 0.0 if length2 == 0 else max(0.0, min(1.0, -(ax * dx + ay * dy) / length2))
    return math.hypot(ax + t * dx, ay + t * dy)


# --- when ---


def period_holds(period, at, place):
    start, end = period.get("start"), period.get("end")
    if (start and at < start) or (end and at > end):
        return False
    if period.get("schedule") is None:
        return True
    return any(daily_holds(daily, at, place) for daily in period["schedule"])


def daily_holds(daily, at, place):
    """By the days around: a period belongs to the day that it begins on."""
    for shift in (-2, -1, 0, 1, 2):
        day = (at + datetime.timedelta(days=shift)).date()
        if "ANY" not in daily["day"] and DAYS[day.weekday()] not in daily["day"]:
            continue
        begins = on_day(daily["from"], day, place)
        ends = on_day(daily["until"], day, place)
        if ends <= begins:
            ends = on_day(daily["until"], day + datetime.timedelta(days=1), place)
        if begins <= at <= ends:
            return True
    return False


def on_day(time, day, place):
    if time in ("BMCT", "SR", "SS", "EECT"):
        return sun(time, day, place)
    clock = datetime.time.fromisoformat(time.replace("Z", "+00:00"))
    return datetime.datetime.combine(day, clock)


def sun(event, day, place):
    """Sunrise and sunset by the equation of NOAA's solar calculator, to a minute or two."""
    zenith = 96.0 if event in ("BMCT", "EECT") else 90.833
    noon = datetime.datetime.combine(day, datetime.time(12), UTC) - datetime.timedelta(minutes=4 * place[0])
    gamma = 2 * math.pi / 365 * (noon.timetuple().tm_yday - 1)
    equation_min = 229.18 * (
        0.000075
        + 0.001868 * math.cos(gamma)
        - 0.032077 * math.sin(gamma)
        - 0.014615 * math.cos(2 * gamma)
        - 0.040849 * math.sin(2 * gamma)
    )
    declination = (
        0.006918
        - 0.399912 * math.cos(gamma)
        + 0.070257 * math.sin(gamma)
        - 0.006758 * math.cos(2 * gamma)
        + 0.000907 * math.sin(2 * gamma)
        - 0.002697 * math.cos(3 * gamma)
        + 0.00148 * math.sin(3 * gamma)
    )
    latitude = math.radians(place[1])
    cosine = math.cos(math.radians(zenith)) / (math.cos(latitude) * math.cos(declination))
    cosine -= math.tan(latitude) * math.tan(declination)
    hour_angle_min = 4 * math.degrees(math.acos(max(-1.0, min(1.0, cosine))))
    sign = -1 if event in ("BMCT", "SR") else 1
    return noon + datetime.timedelta(minutes=-equation_min + sign * hour_angle_min)


# --- ED-269 ---


def ed269(document):
    zones = document.get("features") or document.get("UASZoneList") or document.get("uas_zones")
    volumes = []
    for zone in zones:
        applicability = zone["applicability"]
        periods = applicability if isinstance(applicability, list) else [applicability]
        periods = [period269(period) for period in periods]
        always = any(period == {"start": None, "end": None, "schedule": None} for period in periods)
        for volume in zone["geometry"]:
            unit = METRES[volume["uomDimensions"]]
            projection = volume["horizontalProjection"]
            if projection["type"] == "Circle":
                shape = ("circle", tuple(projection["center"]), float(projection["radius"]) * unit)
            else:
                shape = ("polygon", [[tuple(p) for p in ring] for ring in projection["coordinates"]])
            lower, upper = (
                limit(volume.get(f"{end}Limit"), volume.get(f"{end}VerticalReference"), unit)
                for end in ("lower", "upper")
            )
            kind = zone["restriction"]
            volumes.append(Volume(zone["identifier"], kind, shape, lower, upper, None if always else periods))
    return volumes


def period269(period):
    permanent = period["permanent"] == "YES"
    schedule = [
        {"day": listed(daily["day"]), "from": daily["startTime"], "until": daily["endTime"]}
        for daily in period.get("schedule") or []
    ]
    return {
        "start": None if permanent or not period.get("startDateTime") else instant(period["startDateTime"]),
        "end": None if permanent or not period.get("endDateTime") else instant(period["endDateTime"]),
        "schedule": schedule or None,
    }


def limit(value, reference, unit):
    return None if value is None else (float(value) * unit, reference)


def listed(value):
    return value if isinstance(value, list) else [value]


# --- ED-318 ---


def ed318(document):
    volumes = []
    features = document["features"] if "features" in document else [document]
    for feature in features:
        told = feature["properties"]
        periods = None
        if told.get("limitedApplicability"):
            periods = [period318(period) for period in told["limitedApplicability"]]
        geometry = feature["geometry"]
        for shape in geometry.get("geometries", [geometry]):
            layer = shape["layer"]
            unit = METRES[layer.get("uom", "m").upper()]
            if shape["type"] == "Point":
                outline = ("circle", tuple(shape["coordinates"]), shape["extent"]["radius"])
            else:
                outline = ("polygon", [[tuple(p) for p in ring] for ring in shape["coordinates"]])
            lower, upper = (limit(layer.get(end), layer.get(f"{end}Reference"), unit) for end in ("lower", "upper"))
            volumes.append(Volume(told["identifier"], told["type"], outline, lower, upper, periods))
    return volumes


def period318(period):
    schedule = [
        {
            "day": daily["day"],
            "from": daily.get("startTime") or daily["startEvent"],
            "until": daily.get("endTime") or daily["endEvent"],
        }
        for daily in period.get("schedule") or []
    ]
    return {
        "start": instant(period["startDateTime"]) if period.get("startDateTime") else None,
        "end": instant(period["endDateTime"]) if period.get("endDateTime") else None,
        "schedule": schedule or None,
    }


# --- QGroundControl ---


def fence(document):
    volumes = []
    for number, polygon in enumerate(document["geoFence"]["polygons"], 1):
        if not polygon["inclusion"]:
            ring = [(lon, lat) for lat, lon in polygon["polygon"]]
            volumes.append(Volume(f"polygon-{number}", "PROHIBITED", ("polygon", [ring]), None, None, None))
    for number, circle in enumerate(document["geoFence"]["circles"], 1):
        if not circle["inclusion"]:
            lat, lon = circle["circle"]["center"]
            shape = ("circle", (lon, lat), circle["circle"]["radius"])
            volumes.append(Volume(f"circle-{number}", "PROHIBITED", shape, None, None, None))
    return volumes


# --- KML ---

KML = "{http://www.opengis.net/kml/2.2}"


def kml(text):
    volumes = []
    for placemark in xml.etree.ElementTree.fromstring(text).iter(f"{KML}Placemark"):
        span = placemark.find(f"{KML}TimeSpan")
        periods = None
        if span is not None and len(span):
            begin, end = span.findtext(f"{KML}begin"), span.findtext(f"{KML}end")
            periods = [{"start": begin and instant(begin), "end": end and instant(end)}]
        for polygon in placemark.iter(f"{KML}Polygon"):
            written = [ring.text.split() for ring in polygon.iter(f"{KML}coordinates")]
            rings = [[tuple(map(float, place.split(","))) for place in ring] for ring in written]
            upper = None
            if polygon.findtext(f"{KML}extrude") == "1":
                reference = {"relativeToGround": "AGL", "absolute": "AMSL"}[polygon.findtext(f"{KML}altitudeMode")]
                upper = (rings[0][0][2], reference)
            shape = ("polygon", [[place[:2] for place in ring] for ring in rings])
            volumes.append(Volume(placemark.get("id"), "PROHIBITED", shape, None, upper, periods))
    return volumes
