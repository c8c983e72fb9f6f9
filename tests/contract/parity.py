"""The same scenarios through REST and gRPC: the same outcome or the same code, told as the table of problems says.

What only operators do is REST alone, and held against the table of problems, too.
"""

import html
import re

import requests

from checks import Checks
from dialects import Answer, Grpc, Rest
from parity_scenarios import SCENARIOS, SETTING, Scenario

ROW = re.compile(r'<tr id="([a-z_]+)"><td>.*?</td><td>(\d+)</td><td>(\w+)</td>')


def run(url: str, address: str) -> Checks:
    """Plays every scenario on both."""
    checks = Checks("parity of REST and gRPC")
    rest, client = Rest(url), Grpc(address)
    try:
        columns = problem_columns(url)
        checks.expect(len(columns) > 20, f"the table of problems has {len(columns)} rows")
        set_the_scene(checks, rest)
        for scenario in SCENARIOS:
            play(checks, rest, client, columns, scenario)
    finally:
        client.close()
    return checks


def problem_columns(url: str) -> dict[str, tuple[str, str]]:
    """HTTP status and gRPC code of each problem, from the page that clients are pointed to."""
    page = html.unescape(requests.get(f"{url}/docs/problems", timeout=30).text)
    return {code: (status, upper_snake(name)) for code, status, name in ROW.findall(page)}


def upper_snake(name: str) -> str:
    """`InvalidArgument` as `INVALID_ARGUMENT`."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).upper()


def set_the_scene(checks: Checks, rest: Rest) -> None:
    for method, path, body in SETTING:
        answer = rest.call(method, path, body)
        checks.equal(answer.code, None, f"the setting, {method} {path}: {answer.told()}")


def play(checks: Checks, rest: Rest, client: Grpc, columns: dict, scenario: Scenario) -> None:
    over_rest = rest.call(*scenario.rest)
    told = f"{scenario.name}\n    REST: {over_rest.told()}"
    checks.equal(over_rest.code, scenario.code, f"REST, {told}")
    if scenario.grpc is None:
        rest_alone(checks, columns, scenario, over_rest, told)
        return
    over_grpc = client.call(*scenario.grpc)
    told = f"{told}\n    gRPC: {over_grpc.told()}"
    checks.equal(over_grpc.code, over_rest.code, f"gRPC, {told}")
    checks.equal(over_grpc.faults, over_rest.faults, f"faults, {told}")
    if scenario.code is not None:
        statuses = (over_rest.status, over_grpc.status)
        checks.equal(statuses, columns.get(scenario.code), f"statuses, {told}")
    elif over_rest.code is None and over_grpc.code is None:
        outcomes(checks, scenario, over_rest, over_grpc, told)


def rest_alone(checks: Checks, columns: dict, scenario: Scenario, answer: Answer, told: str) -> None:
    """What gRPC does not have: the status of the table, or an answer."""
    if scenario.code is not None:
        checks.equal(answer.status, columns.get(scenario.code, ("", ""))[0], f"status, {told}")
    elif answer.code is None:
        checks.expect(scenario.facts(answer.body), f"an outcome, {told}")


def outcomes(checks: Checks, scenario: Scenario, over_rest: Answer, over_grpc: Answer, told: str) -> None:
    one = scenario.facts(over_rest.body)
    other = scenario.facts(over_grpc.body)
    checks.equal(other, one, f"outcome, {told}")
    checks.expect(one, f"an outcome, {told}")
    if scenario.warnings is not None:
        codes = [warning["code"] for warning in over_rest.body["warnings"]]
        checks.expect(set(scenario.warnings) <= set(codes), f"warnings {scenario.warnings} among {codes}, {told}")
