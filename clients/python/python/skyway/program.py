"""The program `skyway`, started from Python: an edge with a small fleet, to try the client on."""

from __future__ import annotations

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time
from types import TracebackType
from typing import Self

from . import _skyway
from .client import Client
from .errors import ProgramError

START_S = 60.0
STOP_S = 20.0
_ANY_PORT = "127.0.0.1:0"
_REGISTRY = re.compile(r"(http://\S+/)\s+the shop window of the registry")


def program() -> list[str]:
    """The words that start the program: what SKYWAY_PROGRAM names, else that of the wheel, else that on the PATH. Raises `ProgramError`."""
    named = os.environ.get("SKYWAY_PROGRAM")
    if named:
        if os.access(named, os.X_OK) and os.path.isfile(named):
            return [named]
        hint = "give the path of the program, or unset the variable"
        raise ProgramError(f"there is no program at {named}", "no_program", "SKYWAY_PROGRAM", hint)
    if hasattr(_skyway, "run"):
        return [sys.executable, "-m", "skyway"]
    found = shutil.which("skyway")
    if found:
        return [found]
    hint = "build it with cargo build --release, and put target/release on the PATH or its path into SKYWAY_PROGRAM"
    raise ProgramError("this wheel has no program skyway, and none is on the PATH", "no_program", "PATH", hint)


class Demo:
    """A running demo. Use it in a `with`, or stop it."""

    def __init__(
        self, url: str, registry_url: str | None, process: subprocess.Popen[bytes], folder: tempfile.TemporaryDirectory[str]
    ) -> None:
        self.url, self.registry_url = url, registry_url
        self._process, self._folder = process, folder

    def client(self) -> Client:
        """A client of its edge."""
        return Client(self.url)

    def stop(self) -> None:
        """Ends the program and removes what it has written."""
        if self._process.poll() is None:
            self._process.terminate()
            try:
                self._process.wait(STOP_S)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        self._folder.cleanup()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None) -> None:
        self.stop()

    def __repr__(self) -> str:
        return f"<skyway.Demo at {self.url}>"


def demo(*, drones: int = 12, rate: float = 5.0, seed: int = 1, for_s: float | None = None) -> Demo:
    """Starts an edge over Sydney on free ports of this machine, with a fleet that flies `rate` times as fast as in life.

    It ends with `stop()`, with its `with`, or by itself after `for_s` seconds. Raises `ProgramError` with the remedy where there is no
    program, or where it does not start.
    """
    folder = tempfile.TemporaryDirectory(prefix="skyway-demo-")
    ports, told = pathlib.Path(folder.name, "ports.json"), pathlib.Path(folder.name, "told.txt")
    command = [*program(), "demo", "--drones", str(drones), "--rate", str(rate), "--seed", str(seed), "--ports-file", str(ports)]
    for listener in ("--listen", "--admin-listen", "--second-listen", "--registry-listen"):
        command += [listener, _ANY_PORT]
    if for_s is not None:
        command += ["--for", str(for_s)]
    with told.open("wb") as output:
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=output, stderr=output)
    started = Demo("", None, process, folder)
    try:
        port = _await_port(ports, told, process)
        registry = _REGISTRY.search(told.read_text(encoding="utf-8", errors="replace"))
        started.url, started.registry_url = f"http://127.0.0.1:{port}", registry and registry[1].rstrip("/")
    except BaseException:
        started.stop()
        raise
    return started


def _await_port(ports: pathlib.Path, told: pathlib.Path, process: subprocess.Popen[bytes]) -> int:
    """The port of the edge, as soon as it serves and has said so."""
    until_s = time.monotonic() + START_S
    while time.monotonic() < until_s:
        said = told.read_text(encoding="utf-8", errors="replace")
        if process.poll() is not None:
            hint = "run the program by hand: skyway demo"
            raise ProgramError(
                f"the program ended with code {process.returncode}: {said.strip()[-400:]}", "program_ended", "skyway demo", hint
            )
        if ports.exists() and _REGISTRY.search(said):
            return int(json.loads(ports.read_text(encoding="utf-8"))["listen"])
        time.sleep(0.05)
    raise ProgramError(
        f"the program does not serve after {START_S:.0f} s",
        "program_silent",
        "skyway demo",
        "run the program by hand: skyway demo",
    )
