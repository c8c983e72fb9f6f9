"""The descriptions of the REST APIs are valid OpenAPI 3.1."""

import json
import pathlib
import sys

from openapi_spec_validator import OpenAPIV31SpecValidator

ROOT = pathlib.Path(__file__).resolve().parent.parent


FILES = ("openapi.json", "openapi-registry.json")


def check(name: str) -> bool:
    description = json.loads((ROOT / "docs" / name).read_text())
    errors = list(OpenAPIV31SpecValidator(description).iter_errors())
    for error in errors:
        print(f"FAILED: {name}: {'/'.join(map(str, error.absolute_path))}: {error.message}")
    operations = sum(len(item) for item in description["paths"].values())
    print(f"{name}: {operations} operations, {len(errors)} errors")
    return not errors and operations > 0


def main() -> int:
    return 0 if all([check(name) for name in FILES]) else 1


if __name__ == "__main__":
    sys.exit(main())
