"""What the judge asks of the first stretch: it begins where the drone is, and is one of the allowed ways in."""

from case import TOLERANCE_M, Case
from geometry import distance
from reading import Start, is_finite
from world import DOUBT_M

AT_NODE_M = 15.0
# The edge's clock runs on from the moment that the judge set, until it answers the last report of a batch.
RUNS_ON_S = 0.05


def check_held(case: Case) -> None:
    """Who holds on the ground stands at the first node of its path."""
    place, node = case.reading.report.place, case.world.network.nodes[case.nodes[0]]
    stands = place is not None and distance(place, node.at) <= AT_NODE_M
    case.expect(stands, "ground", f"it holds at {node.id}, where it does not stand")
    case.expect(case.stretch_m <= AT_NODE_M, "first_stretch", f"{case.stretch_m} m to where it holds")
    case.expect(not case.flags or case.flags == ["pad_occupied"], "flag", f"{case.flags} on the ground")


def check_stretch(case: Case) -> None:
    """It begins where the drone is or may be, and leads to the path's first node by an allowed way."""
    reading, stretch = case.reading, case.stretch
    told = "first_stretch" in case.answer and bool(stretch)
    if not case.expect(told, "first_stretch", "it is not told"):
        case.start = nearest_start(case, None)
    else:
        case.start = nearest_start(case, stretch.get("kind"))
        check_stretch_told(case)
    if case.start is None:
        ways = [(way.node, way.kind, way.allowed) for way in reading.starts]
        case.expect(
            False, "start", f"{case.nodes[0]} by {stretch.get('kind')} is no way into the network; there are {ways}"
        )
        return
    start = case.start
    is_hold = case.outcome == "hold" and reading.where == "node" and start.node == reading.a
    # The shorter way out of a zone may lead nowhere, or nowhere that its battery lasts to.
    longer = reading.longer or ("", "")
    is_longer = start.node == longer[0] and (case.world.flown or reading.leads_nowhere(longer[1]))
    if not is_hold and not is_longer:
        case.expect(
            start.allowed != "no",
            "start",
            f"{start.node} by {start.kind} over {start.length_m:.1f} m is no clean way in; inside {reading.inside}",
        )
    turns = start.kind == "leg" and start.node == reading.a
    expected = start.length_m + (2 * case.overrun_m if turns else 0.0)
    slack = case.slack_m + 1e-6 * expected
    if start.kind == "straight":
        slack += 0.001 * expected
    if reading.straight_m == 0.0:
        slack += reading.length_m
    case.expect(
        abs(case.stretch_m - expected) <= slack + (0.5 if start.kind == "none" else 0.0),
        "first_stretch",
        f"{case.stretch_m} m to {start.node} by {start.kind}, not {expected:.3f}",
    )
    first_closed = reading.closed_nodes.get(case.nodes[0], "no")
    if case.stretch_m > 0.5 and not is_hold:
        case.expect(first_closed != "yes", "closed", f"the closed node {case.nodes[0]} is entered by the first stretch")
    if start.kind == "straight":
        check_straight(case)


def nearest_start(case: Case, kind: str | None) -> Start | None:
    """The start of the reading that the answer took."""
    reading = case.reading
    fits = [start for start in reading.starts if start.node == case.nodes[0]]
    if kind == "none":
        fits = [start for start in fits if start.length_m <= 0.5 or reading.straight_m == 0.0]
    elif kind is not None:
        fits = [start for start in fits if start.kind == kind or (kind == "leg" and start.kind == "none")]
    return min(fits, key=lambda start: abs(start.length_m - case.stretch_m), default=None)


def check_stretch_told(case: Case) -> None:
    """Its members agree with each other and with the place of the drone."""
    reading, stretch = case.reading, case.stretch
    kind = stretch.get("kind")
    case.expect(kind in ("leg", "straight", "none"), "first_stretch", f"the kind {kind!r}")
    case.expect(
        str(stretch.get("enters")) == case.nodes[0],
        "first_stretch",
        f"it enters {stretch.get('enters')}, not {case.nodes[0]}",
    )
    length = stretch.get("length_m")
    agrees = is_finite(length) and abs(length - case.stretch_m) <= TOLERANCE_M
    case.expect(agrees, "first_stretch", f"length_m {length} beside first_stretch_m {case.stretch_m}")
    case.expect(
        -1e-9 <= case.overrun_m <= reading.stopping_m + 0.01, "cannot_stop", f"an overrun of {case.overrun_m} m"
    )
    if kind == "none":
        case.expect(case.stretch_m <= 1e-6, "first_stretch", f"none, and {case.stretch_m} m long")
    if kind != "leg":
        return
    ends = (str(stretch.get("from")), str(stretch.get("to")))
    leg = case.start.leg if case.start is not None and case.start.leg else case.report.leg
    case.expect(ends == leg, "first_stretch", f"on {ends}, not on {leg}")
    segment = case.world.network.by_ends.get(leg)
    segment_id = segment.id if segment else None
    case.expect(
        stretch.get("segment") == segment_id,
        "first_stretch",
        f"the segment {stretch.get('segment')!r}, not {segment_id!r}",
    )
    fraction = stretch.get("fraction")
    if not case.expect(
        is_finite(fraction) and -1e-9 <= fraction <= 1 + 1e-9, "first_stretch", f"the fraction {fraction!r}"
    ):
        return
    if leg != case.report.leg:
        case.expect(fraction <= 1e-6, "first_stretch", f"it stands at {leg[0]}, and begins at {fraction} of {leg}")
        return
    is_back = case.nodes[0] == reading.a
    begin_m = reading.far_m if is_back else reading.at_m
    flown_m = reading.airspeed_mps * RUNS_ON_S if is_back else 0.0
    begins = abs(fraction * reading.length_m - begin_m) <= 0.1 + flown_m + 1e-6 * reading.length_m
    if reading.straight_m > 0.0 and reading.where != "off":
        case.expect(
            begins,
            "first_stretch",
            f"it begins at {fraction * reading.length_m:.1f} m, not at {begin_m:.1f} m of the leg",
        )
    check_geometry(case)


def check_geometry(case: Case) -> None:
    """It ends at the node that it enters."""
    line = case.stretch.get("geometry")
    if not line:
        case.expect(line is not None, "first_stretch", "it has no geometry")
        return
    points = line
    if not case.expect(all(len(point) in (2, 3) for point in points), "first_stretch", f"the geometry {line}"):
        return
    plane, node = case.world.network.plane, case.world.network.nodes[case.nodes[0]]
    end = plane.to_plane((points[-1][0], points[-1][1]))
    case.expect(
        distance(end, node.at) <= 0.5, "first_stretch", f"its line ends {distance(end, node.at):.1f} m off {node.id}"
    )
    begin = plane.to_plane((points[0][0], points[0][1]))
    reading = case.reading
    if reading.where == "leg" and reading.report.age_s == 0.0:
        off = min(distance(begin, reading.report.place), distance(begin, reading.point))
        case.expect(off <= 1.0, "first_stretch", f"its line begins {off:.1f} m off the drone")


def check_straight(case: Case) -> None:
    """No zone is crossed, and no clean start was left aside for it."""
    reading = case.reading
    if reading.report.place is None:
        case.expect(False, "unverified", "straight from an unknown place")
        return
    node = case.world.network.nodes[case.nodes[0]]
    is_inside = reading.inside is not None or reading.in_zone_aside()
    zone = reading.crossed(reading.report.place, node.at, is_inside, -DOUBT_M)
    if zone is not None and zone.everywhere_high() and (not reading.by_times or not zone.windows):
        case.expect(False, "unverified", f"its straight line to {node.id} enters the zone {zone.id}")
