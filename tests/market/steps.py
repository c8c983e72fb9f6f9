"""The steps of the flow of a delivery, and who is killed at which of them."""

import random
import threading
import time

STEPS = ["published", "searched", "quoted", "ordered", "assigned", "departed", "in_flight", "replanned", "delivered", "told"]
VICTIMS = ["registry", "edge", "both"]
CELLS = [(step, victims) for step in STEPS for victims in VICTIMS]
# How often a step is surely come to in a seed.
TIMES = {"published": 20, "searched": 4, "quoted": 4, "ordered": 4, "assigned": 4, "departed": 4, "in_flight": 4, "replanned": 1,
         "delivered": 4, "told": 8}
MORE_KILLS_MAX = 2
# From the step to the kill at most, so that it comes before, during or after what the step asks for, which takes some
# milliseconds; and how long who is killed is away.
BEFORE_KILL_S = (0.004, 0.04)
AWAY_S = (0.0, 0.4)


class Kill:
    """At which occurrence of which step who is killed."""

    def __init__(self, cell: tuple[str, str], chance: random.Random) -> None:
        self.step, self.victims = cell
        self.occurrence = chance.randint(1, TIMES[self.step])
        self.after_s, self.away_s = chance.uniform(0.0, chance.choice(BEFORE_KILL_S)), chance.uniform(*AWAY_S)

    def __str__(self) -> str:
        return f"{self.victims} at {self.step} {self.occurrence}"


class Kills:
    """Those of a seed: one that is its turn, so that as many seeds as there are cells hit all of them, and some at random."""

    def __init__(self, seed: int, chance: random.Random) -> None:
        more = chance.sample(CELLS, chance.randint(0, MORE_KILLS_MAX))
        self.planned = [Kill(cell, chance) for cell in dict.fromkeys([CELLS[seed % len(CELLS)], *more])]
        self.done: list[Kill] = []
        self.faults: list[str] = []
        self._occurred = dict.fromkeys(STEPS, 0)
        self._daemons: dict = {}
        self._lock, self._killing, self._threads = threading.Lock(), threading.Lock(), []

    def of(self, **daemons) -> None:
        """Whom to kill: the registry and the edge."""
        self._daemons = daemons

    def reached(self, step: str) -> bool:
        """The flow has come to a step: who is to be killed there is, beside the caller. Tells whether anyone is."""
        with self._lock:
            self._occurred[step] += 1
            due = [kill for kill in self.planned if (kill.step, kill.occurrence) == (step, self._occurred[step])]
            for kill in due:
                thread = threading.Thread(target=self._kill, args=(kill,), daemon=True)
                self._threads.append(thread)
                thread.start()
        return bool(due)

    def _kill(self, kill: Kill) -> None:
        names = list(self._daemons) if kill.victims == "both" else [kill.victims]
        time.sleep(kill.after_s)
        try:
            # One after the other: who is being started is not killed before it lives.
            with self._killing:
                print(f"{time.time():.3f} kill: {kill}", flush=True)
                for name in names:
                    self._daemons[name].kill()
                time.sleep(kill.away_s)
                for name in names:
                    self._daemons[name].start()
                self.done.append(kill)
        except Exception as error:
            self.faults.append(f"{kill}: {error}")

    def finish(self) -> None:
        """Waits until who was killed is back."""
        while True:
            with self._lock:
                threads = [thread for thread in self._threads if thread.is_alive()]
            if not threads:
                return
            for thread in threads:
                thread.join()


def coverage(done: list[tuple[str, str]]) -> tuple[str, list[str]]:
    """A table of how often who was killed at each step, and what was never hit."""
    lines = [f"{'step':12}" + "".join(f"{victims:>10}" for victims in VICTIMS)]
    for step in STEPS:
        lines.append(f"{step:12}" + "".join(f"{done.count((step, victims)):>10}" for victims in VICTIMS))
    return "\n".join(lines), [f"{victims} at {step}" for step, victims in CELLS if (step, victims) not in done]
