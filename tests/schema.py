"""The JSON Schema of the native format: bundled networks follow it, and it refuses what the reader refuses."""

import json
import pathlib
import sys

from jsonschema import Draft202012Validator

ROOT = pathlib.Path(__file__).resolve().parent.parent
CORRIDOR = (ROOT / "data/corridor-san-marcos-san-antonio.geojson").read_text()
SYDNEY = (ROOT / "data/sydney-cbd.geojson").read_text()
FAULTS = [
    ('"format":1', '"format":2'),
    ('"coordinates":"geographic"', '"coordinates":"polar"'),
    ('"attribution"', '"atribution"'),
    ('"pads":', '"pad":'),
    ('"pads":', '"pads":-'),
    ('"role":"both"', '"role":"all"'),
    ('"altitude_reference":"agl"', '"altitude_reference":"ground"'),
    ('"from":', '"form":'),
    ('"length_m":', '"length_m":-'),
    ('"id":1,', ""),
]


def main() -> int:
    schema = json.loads((ROOT / "docs/network.schema.json").read_text())
    Draft202012Validator.check_schema(schema)
    validator = Draft202012Validator(schema)
    passed = failed = 0

    def expect(right: bool, what: str) -> None:
        nonlocal passed, failed
        passed += right
        failed += not right
        if not right:
            print(f"FAILED: {what}")

    for name, text in [("Sydney", SYDNEY), ("the corridor", CORRIDOR)]:
        errors = [error.message for error in validator.iter_errors(json.loads(text))]
        expect(not errors, f"{name} follows the schema: {errors[:3]}")
    for original, replacement in FAULTS:
        expect(original in CORRIDOR, f"the corridor has {original}")
        document = json.loads(CORRIDOR.replace(original, replacement, 1))
        expect(not validator.is_valid(document), f"the schema refuses {replacement or 'a node without id'}")
    print(f"{passed} passed, {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
