"""The contract of a running edge, from outside: its description, its two dialects, and what it does with nonsense.

    run.py                  what scripts/test runs
    run.py --examples 1000  more generated requests for every operation
    run.py --seed 7         others

It starts the edge itself, on free ports, once for every part, and ends it by SIGTERM, which has to end it well.
"""

import argparse
import os
import pathlib
import subprocess
import sys
import tempfile

import requests
from openapi_spec_validator import OpenAPIV31SpecValidator

import events
import grpc_story
import parity
from checks import Checks
from edge_process import ROOT, EdgeProcess

BINARY = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release/skyway"
SCHEMATHESIS = pathlib.Path(sys.executable).with_name("schemathesis")
SETTINGS = pathlib.Path(__file__).with_name("schemathesis.toml")
SEED = 20261121
EXAMPLES = 25
# The worst case, which says that something hangs; it takes a minute for 25 examples.
BASE_S, PER_EXAMPLE_S = 600, 6


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--binary", type=pathlib.Path, default=BINARY)
    arguments.add_argument("--examples", type=int, default=EXAMPLES, help="for each operation")
    arguments.add_argument("--seed", type=int, default=SEED)
    given = arguments.parse_args()
    failed = 0
    for part in (grpc_story, parity, events):
        with EdgeProcess(given.binary) as edge:
            checks = part.run(edge.url, edge.address)
        print(checks.told(), flush=True)
        failed += checks.failed
    with EdgeProcess(given.binary) as edge:
        for checks in (description(edge), generated_requests(edge, given.examples, given.seed)):
            print(checks.told(), flush=True)
            failed += checks.failed
    return 1 if failed else 0


def description(edge: EdgeProcess) -> Checks:
    """What the edge says of itself is OpenAPI 3.1."""
    checks = Checks("description")
    served = requests.get(f"{edge.url}/openapi.json", timeout=30).json()
    errors = [error.message for error in OpenAPIV31SpecValidator(served).iter_errors()]
    checks.equal(errors, [], "errors of the description")
    checks.expect(served["openapi"].startswith("3.1."), f"its version is {served['openapi']}")
    return checks


def generated_requests(edge: EdgeProcess, examples: int, seed: int) -> Checks:
    """Every operation, with requests that its description allows and forbids."""
    checks = Checks(f"generated requests, {examples} for each operation, seed {seed}")
    command = [
        str(SCHEMATHESIS),
        f"--config-file={SETTINGS}",
        "run",
        f"{edge.url}/openapi.json",
        f"--max-examples={examples}",
        f"--seed={seed}",
        "--continue-on-failure",
        "--request-timeout=30",
        "--generation-database=none",
        "--warnings=off",
        "--no-color",
    ]
    with tempfile.TemporaryFile("w+") as output:
        status: int | str
        try:
            done = subprocess.run(
                command, stdout=output, stderr=subprocess.STDOUT, timeout=BASE_S + PER_EXAMPLE_S * examples, check=False
            )
            status = done.returncode
        except subprocess.TimeoutExpired:
            status = "timeout"
        output.seek(0)
        told = output.read()
    is_right = checks.equal(status, 0, f"schemathesis with seed {seed}")
    print(told if not is_right else "\n".join(told.splitlines()[-12:]))
    checks.expect(edge.is_running(), f"the edge is there after it:\n{edge.log()}")
    checks.expect("panicked" not in edge.log(), f"nothing panics:\n{edge.log()}")
    return checks


if __name__ == "__main__":
    sys.exit(main())
