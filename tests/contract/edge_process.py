"""A private edge for the contract tests: started on free ports, ended by SIGTERM, which has to end it well."""

import json
import os
import pathlib
import signal
import subprocess
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
START_S = 30.0
END_S = 30.0
POLL_S = 0.02
# What an edge logs of an answer that the checker did not let pass.
REFUSED_ANSWER = "the checker did not let an answer pass"


class EdgeProcess:
    """`skyway edge` as a process. As a context it is there within, and gone after."""

    def __init__(self, binary: pathlib.Path, *arguments: str) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="skyway-contract-")
        folder = pathlib.Path(self._folder.name)
        self._ports_file = folder / "ports.json"
        self.log_file = folder / "edge.log"
        self._command = [
            str(binary),
            "edge",
            "--no-store",
            "--listen=127.0.0.1:0",
            "--admin-listen=127.0.0.1:0",
            f"--ports-file={self._ports_file}",
            *arguments,
        ]
        self._process: subprocess.Popen | None = None
        self.port = 0
        self.admin_port = 0

    def __enter__(self) -> "EdgeProcess":
        # Settings of the person who runs the tests are not settings of this edge, which plans by distance unless told.
        environment = {name: value for name, value in os.environ.items() if not name.startswith("SKYWAY_")}
        environment["SKYWAY_EDGE_FLIGHT_AIRFRAME"] = "none"
        with self.log_file.open("wb") as log:
            self._process = subprocess.Popen(self._command, stdout=log, stderr=log, env=environment)
        try:
            self._wait_for_ports()
        except BaseException:
            self._process.kill()
            self._process.wait()
            raise
        return self

    def _wait_for_ports(self) -> None:
        give_up = time.monotonic() + START_S
        while time.monotonic() < give_up:
            if self._process.poll() is not None:
                raise RuntimeError(f"the edge ended with {self._process.returncode}:\n{self.log()}")
            ports = self._ports()
            if ports is not None:
                self.port = ports["listen"]
                self.admin_port = ports["admin_listen"]
                return
            time.sleep(POLL_S)
        raise RuntimeError(f"the edge wrote no ports within {START_S:.0f} s:\n{self.log()}")

    def _ports(self) -> dict | None:
        try:
            return json.loads(self._ports_file.read_text())
        except (FileNotFoundError, json.JSONDecodeError):
            return None

    def hang(self, hangs: bool) -> None:
        """Stops it where it is, or lets it go on: its connections stay open and say nothing."""
        self._process.send_signal(signal.SIGSTOP if hangs else signal.SIGCONT)

    def __exit__(self, kind, *_) -> None:
        status = self._end()
        log = self.log()
        self._folder.cleanup()
        if kind is None and status != 0:
            raise RuntimeError(f"after SIGTERM the edge ended with {status}, not 0:\n{log}")
        if kind is None and REFUSED_ANSWER in log:
            raise RuntimeError(f"an answer did not pass the checker:\n{log}")

    def _end(self) -> int | str:
        if self._process.poll() is not None:
            return f"{self._process.returncode} before it was told to"
        self._process.send_signal(signal.SIGTERM)
        try:
            return self._process.wait(timeout=END_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
            return f"nothing within {END_S:.0f} s"

    def is_running(self) -> bool:
        """Whether it has not ended by itself."""
        return self._process.poll() is None

    def log(self) -> str:
        """The last lines of what it wrote."""
        lines = self.log_file.read_text(errors="replace").splitlines()
        return "\n".join(lines[-40:])

    @property
    def url(self) -> str:
        """Where REST is."""
        return f"http://127.0.0.1:{self.port}"

    @property
    def address(self) -> str:
        """Where gRPC is."""
        return f"127.0.0.1:{self.port}"
