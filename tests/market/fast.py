"""A registry and an edge whose clocks run faster than the machine's, over a small network."""

import datetime
import http.client
import itertools
import json
import os
import pathlib
import random
import socket
import time

from town import Daemon

# Seconds of a simulated clock in one of the machine's.
RATE = 25.0
BEGINS = datetime.datetime(2026, 11, 27, 1, 0, tzinfo=datetime.timezone.utc)
NETWORK = "town"
# A grid of nodes so far from each other, in degrees: legs of about 150 m.
COLUMNS, ROWS = 7, 6
WEST, SOUTH, EAST_BY, NORTH_BY = 151.2, -33.87, 0.00162, 0.00135
# Below the ports that systems give to outgoing connections: one of those would keep a daemon from coming back to its own.
PORTS = range(20_000, 32_000)


class FastTime:
    """Time that passes faster than the machine's, the same for all daemons of a seed whenever they start."""

    def __init__(self) -> None:
        self._began = time.monotonic()

    def now(self) -> datetime.datetime:
        """The time now."""
        return BEGINS + datetime.timedelta(seconds=(time.monotonic() - self._began) * RATE)

    def seconds(self) -> float:
        """The same since 1970."""
        return self.now().timestamp()


def grid() -> tuple[bytes, list[int], list[int]]:
    """A network as GeoJSON, the nodes where drones are at home, and those between which parcels are flown."""
    numbers = {place: number for number, place in enumerate(itertools.product(range(ROWS), range(COLUMNS)), 1)}
    place_of = {place: [round(WEST + place[1] * EAST_BY, 6), round(SOUTH + place[0] * NORTH_BY, 6)] for place in numbers}
    features = [
        {"type": "Feature", "id": number, "geometry": {"type": "Point", "coordinates": place_of[place]},
         "properties": {"kind": "node", "pads": 3, "role": "both"}} for place, number in numbers.items()]
    for (row, column), number in numbers.items():
        for other in ((row + 1, column), (row, column + 1)):
            if other in numbers:
                line = {"type": "LineString", "coordinates": [place_of[(row, column)], place_of[other]]}
                ends = {"kind": "segment", "from": number, "to": numbers[other]}
                features.append({"type": "Feature", "geometry": line, "properties": ends})
    # As on a chessboard: nobody is at home where parcels are fetched or brought.
    homes = [number for (row, column), number in numbers.items() if (row + column) % 2]
    others = [number for number in numbers.values() if number not in homes]
    whole = {"type": "FeatureCollection", "name": "A small town", "skyway": {"format": 1, "coordinates": "geographic"},
             "features": features}
    return json.dumps(whole).encode(), homes, others


def port() -> int:
    """One that nobody has now."""
    chance = random.Random(f"{os.getpid()} {time.monotonic_ns()}")
    while True:
        tried = chance.choice(PORTS)
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", tried))
            except OSError:
                continue
        return tried


class FastDaemon(Daemon):
    """`skyway edge` or `skyway registry` by such a clock, which goes on while it is away."""

    _all: list["FastDaemon"] = []

    def __init__(self, binary: pathlib.Path, folder: pathlib.Path, kind: str, fast_time: FastTime, *settings: str) -> None:
        super().__init__(binary, folder, kind, *settings)
        self.port, self._time = port(), fast_time
        self._all.append(self)
        self._base = [argument for argument in self._command if not str(argument).startswith("--listen=")]
        self._base.append(f"--listen=127.0.0.1:{self.port}")

    def start(self) -> "FastDaemon":
        """Starts it, or starts it again, at the time that it is then."""
        start = self._time.now().isoformat().replace("+00:00", "Z")
        self._command = [*self._base, f"--set=clock.start={start}", f"--set=clock.rate={RATE}"]
        return super().start()

    @classmethod
    def end_all(cls) -> None:
        """Leaves none behind."""
        for daemon in cls._all:
            if daemon._process:
                daemon.kill()
        cls._all.clear()

    def ask(self, *asked, **more):
        """As everywhere, and who is killed in the middle of an answer is away like any other."""
        try:
            return super().ask(*asked, **more)
        except http.client.HTTPException as cut:
            raise OSError(f"{asked[:2]}: {cut!r}") from cut
