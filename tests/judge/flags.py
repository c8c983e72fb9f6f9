"""What the judge asks of flags: each has its ground, and none is missing. `reserve_used` is looked at in flown.py."""

from case import FLAGS, WITHOUT_PADS, Case


def check_flags_known(case: Case) -> None:
    for flag in case.flags:
        case.expect(flag in FLAGS, "flag", f"{flag!r} is none")
    case.expect(len(set(case.flags)) == len(case.flags), "flag", f"one stands twice in {case.flags}")
    if case.outcome != "no_route":
        case.expect(not case.answer.get("unsafe_way"), "unsafe_way", f"beside the outcome {case.outcome}")


def check_flags(case: Case) -> None:
    """Each has its ground, and none is missing."""
    reading, flags, kind = case.reading, case.flags, case.stretch.get("kind")
    if "leaving_zone" in flags:
        at_place = reading.inside is not None or reading.is_doubtful
        aside = reading.where == "off" and reading.in_zone_aside()
        overruns = "cannot_stop" in flags or reading.where == "unknown"
        case.expect(at_place or aside or overruns, "flag", "leaving_zone, and no active zone is at its place")
    elif reading.inside is not None and not reading.is_doubtful and case.outcome != "hold" and not reading.on_ground:
        case.expect(False, "flag", "it is inside an active zone, and leaving_zone is missing")
    is_straight = kind == "straight" or (not case.stretch and case.start is not None and case.start.kind == "straight")
    case.expect(
        ("unverified" in flags) == is_straight,
        "flag",
        f"unverified is {'unverified' in flags}, the first stretch {kind}",
    )
    if is_straight:
        clean = [start.node for start in reading.starts if start.allowed == "yes" and start.kind != "straight"]
        case.expect(not clean, "flag", f"unverified, though {clean} are clean starts")
    check_cannot_stop(case)
    if "pad_occupied" in flags:
        allowed = case.report.failure == "operational" and case.report.detail in WITHOUT_PADS
        case.expect(allowed, "flag", f"pad_occupied for {case.report.failure} {case.report.detail}")
    if not case.world.flown:
        case.expect("reserve_used" not in flags, "flag", "reserve_used without a battery")
    if "unseparated" in flags:
        case.expect(case.world.flown and case.world.plans, "flag", "unseparated, and no other plan is flown")


def check_cannot_stop(case: Case) -> None:
    """Only where a boundary lies within what it takes to stop; and there it has to stand."""
    reading = case.reading
    moves = reading.where == "leg" and not reading.on_ground
    ahead = [
        cause.interval[0]
        for cause in reading.causes
        if cause.interval is not None and cause.interval[1] >= reading.at_m
    ]
    near = [low for low in ahead if low <= reading.far_m + reading.stopping_m + 0.5]
    if "cannot_stop" in case.flags:
        case.expect(
            near and reading.where != "off",
            "flag",
            f"cannot_stop, and no boundary is within {reading.stopping_m:.0f} m",
        )
    elif moves and case.overrun_m > 0.0:
        entered = [
            low
            for low, _ in reading.zone_parts(True)
            if reading.at_m + 0.5 < low and reading.far_m + 0.5 < low < reading.far_m + case.overrun_m - 0.5
        ]
        case.expect(not entered, "flag", f"it overruns {case.overrun_m:.1f} m into a zone, and cannot_stop is missing")
