#!/usr/bin/env python3
"""Judges the records of `skyway-loadtest fleet`: separation, zones, accounting, packs.

run.py RECORD...               a table of each record; exit code 5 where a goal is missed
run.py --minutes 60 120 RECORD    separation and packs in these minutes after the first departure alone
run.py --self-test             the judges find faults that are planted

The judges read nothing but the record, and share no code with the planner.
"""

import argparse
import math
import pathlib
import sys

import accounting
import packs
import planted
import planted_packs
import separation
import zones
from record import Record, read

MISSED = 5
# Of each rule.
SHOWN = 5
WORDS = {
    "headway": "pairs on one segment within the headway",
    "head_on": "pairs head-on on one segment",
    "pad": "pads taken twice at once",
    "node": "pairs at a node within 5 s",
    "crossing": "pairs nearer than 20 m and 10 m elsewhere",
    "flagged": "pairs too near of a version that is flagged `unseparated`, with its alarm",
    "zone": "versions that lead through a zone in force",
    "untold": "plans that a zone meets and no outcome names it",
    "told_twice": "outcomes told twice",
    "named_in_vain": "outcomes that name a zone that is not there",
    "miscounted": "zones whose count of plans is not that of the outcomes",
    "standing_untold": "plans affected at the end that were not told",
}
# Of the single closures, that packs have to cover.
COVERED_PERCENT = 90.0
# What is told and has no goal: there was no other way.
TOLD = ("flagged",)
# Not judged of drones that fly by distance: they name their traffic and do not avoid it.
OF_TRAFFIC = ("headway", "head_on", "pad", "node", "crossing", "flagged")


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("records", nargs="*", type=pathlib.Path, metavar="RECORD")
    arguments.add_argument("--minutes", nargs=2, type=float, metavar=("FROM", "UNTIL"))
    arguments.add_argument("--self-test", action="store_true")
    given = arguments.parse_args()
    if given.self_test:
        return planted.self_test() | planted_packs.self_test()
    if not given.records:
        arguments.error("name a record, or --self-test")
    missed = 0
    for path in given.records:
        missed |= judge(read(path), given.minutes)
    return MISSED if missed else 0


def judge(record: Record, minutes: list[float] | None) -> int:
    from_s, until_s = -math.inf, math.inf
    flown = record.flown()
    if minutes:
        first_s = min(move.enters_s for version in flown for move in version.flown())
        from_s, until_s = (first_s + 60 * minute for minute in minutes)
    faults: dict[str, list] = {rule: [] for rule in WORDS}
    found = [*zones.judge(record), *accounting.judge(record)]
    keeps_apart = bool(record.run.get("airframe"))
    if keeps_apart:
        found += separation.judge(record, from_s, until_s)
    for fault in found:
        faults[fault.rule].append(fault)
    print(f"### {record.run.get('workload')}, judged from its record\n")
    print(f"{len(record.versions)} plans, {len(flown)} versions flown, {len(record.zones)} zones,")
    print(f"{len(record.told)} outcomes, {len(record.alarms)} alarms, {record.refused} requests refused,")
    print(f"{len(record.kills)} kills.\n")
    print("| | goal | found | |\n|---|---:|---:|---|")
    missed = 0
    for rule, words in WORDS.items():
        if rule in OF_TRAFFIC and not keeps_apart:
            continue
        count = len(faults[rule])
        goal, verdict = ("", "") if rule in TOLD else ("0", "**missed**" if count else "met")
        missed |= verdict == "**missed**"
        print(f"| {words} | {goal} | {count} | {verdict} |")
    print()
    if record.packs:
        coverage = packs.judge(record, from_s, until_s)
        faults["pack"] = coverage.faults
        missed |= bool(coverage.faults) or coverage.covered_percent() < COVERED_PERCENT
        print(f"{packs.table(coverage)}\n")
    for rule, some in faults.items():
        for fault in some[:SHOWN]:
            who = " and ".join(fault.plans) if isinstance(fault, separation.Fault) else fault.plan
            print(f"{rule}: {who}: {fault.text}", file=sys.stderr)
    return missed


if __name__ == "__main__":
    sys.exit(main())
