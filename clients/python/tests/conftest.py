"""What the tests share: networks, the program as oracle, reports that are drawn from a seed."""

from __future__ import annotations

import json
import pathlib
import random
import subprocess

import pytest
import skyway
from skyway.program import program as find_program

SEED = 24


class Program:
    """The command line, which answers beside the engine in this process."""

    def __init__(self, command: list[str]) -> None:
        self.command = command

    def run(self, *arguments: object, text: str | None = None, code: int = 0) -> str:
        done = subprocess.run([*self.command, *map(str, arguments)], input=text, capture_output=True, text=True, check=False)
        assert done.returncode == code, f"{arguments}: {done.stderr}"
        return done.stdout

    def answers(self, network: object, reports: list[dict], *arguments: object) -> list[dict]:
        told = self.run("reroute", "--network", network, "--requests", "-", *arguments, text="\n".join(map(json.dumps, reports)))
        return [json.loads(line) for line in told.splitlines()]


@pytest.fixture(scope="session")
def program() -> Program:
    try:
        return Program(find_program())
    except skyway.ProgramError as missing:
        pytest.skip(str(missing))


@pytest.fixture(scope="session")
def sydney() -> skyway.Network:
    return skyway.Network.bundled("sydney")


@pytest.fixture(scope="session")
def generated() -> skyway.Network:
    return skyway.Network.generated(300, max_neighbours=6, reach_fraction=0.15, seed=SEED)


@pytest.fixture(scope="session")
def generated_file(generated: skyway.Network, tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    file = tmp_path_factory.mktemp("network") / "generated.json"
    file.write_text(generated.node_link(), encoding="utf-8")
    return file


def drawn_legs(network: skyway.Network, count: int) -> list[tuple[tuple[int, int], int]]:
    """Legs that are flown in either direction, with destinations; the same for the same network."""
    draw = random.Random(SEED)
    links = json.loads(network.node_link())["links"]
    legs = []
    for _ in range(count):
        link = draw.choice(links)
        ends = [link["source"], link["target"]]
        draw.shuffle(ends)
        legs.append((tuple(ends), draw.choice(network.node_ids)))
    return legs
