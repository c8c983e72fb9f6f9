"""The ten faults that an engine with the feature `planted` can be told to make: judge and checker find each.

With the checker passed over the answers themselves are bent, and have to be found. With it none of them is sent: the
judge finds nothing, and the checker's counter tells.
"""

import pathlib

BUGS = (
    "swapped-start",
    "dropped-cause",
    "removed-leg-open",
    "margin-at-entry",
    "plans-battery",
    "stretch-forgotten",
    "flag-without-ground",
    "pad-twice",
    "closed-node-entered",
    "ground-sent-up",
)
# What an answer that falls back may be: not the best, and by distance. It is safe all the same.
FALLEN_BACK = ("needless", "shortest", "energy", "diverted")
# Networks that are tried until a fault is found.
NETWORKS = 40
ENDS_AT_CASES = 3


def find_all(binary: pathlib.Path, seed: int, judge_network) -> int:
    """Prints which are found by whom, and gives 1 where one is not found or one is sent."""
    missed = 0
    for bug in BUGS:
        by_judge = search(binary, seed, bug, True, judge_network)
        by_checker, sent = guarded(binary, seed, bug, judge_network)
        missed += by_judge is None or by_checker is None or sent > 0
        told = f"judge: {by_judge or 'NOT FOUND'}; checker: {by_checker or 'NOT FOUND'}; sent: {sent}"
        print(f"planted {bug}: {told}", flush=True)
    print(f"planted: {len(BUGS)} faults, {missed} not found by both or sent")
    return 1 if missed else 0


def search(binary: pathlib.Path, seed: int, bug: str, unchecked: bool, judge_network) -> str | None:
    for number in range(NETWORKS):
        outcome = judge_network((binary, seed, number, Planted(bug, unchecked), False))
        if outcome.faults:
            rule, where, text = outcome.faults[0]
            return f"world {where}, {rule}: {text[:100]}"
    return None


def guarded(binary: pathlib.Path, seed: int, bug: str, judge_network) -> tuple[str | None, int]:
    """Where the checker has its first cases, and how many faults went past it until then."""
    sent = 0
    for number in range(NETWORKS):
        outcome = judge_network((binary, seed, number, Planted(bug, False), False))
        sent += sum(rule not in FALLEN_BACK for rule, _, _ in outcome.faults)
        if (outcome.checker_cases or 0) >= ENDS_AT_CASES:
            return f"network {number}, {outcome.checker_cases:.0f} cases", sent
    return None, sent


class Planted:
    """A bug, and whether the checker lets it pass."""

    def __init__(self, bug: str, unchecked: bool) -> None:
        self.bug = bug
        self.unchecked = unchecked

    def environment(self) -> list[str]:
        """Variables for `env`."""
        variables = [f"SKYWAY_PLANTED_BUG={self.bug}"]
        return variables + (["SKYWAY_PLANTED_UNCHECKED=1"] if self.unchecked else [])
