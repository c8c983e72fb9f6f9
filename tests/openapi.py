"""The description of the REST API is valid OpenAPI 3.1."""

import json
import pathlib
import sys

from openapi_spec_validator import OpenAPIV31SpecValidator

ROOT = pathlib.Path(__file__).resolve().parent.parent


def main() -> int:
    description = json.loads((ROOT / "docs/openapi.json").read_text())
    errors = list(OpenAPIV31SpecValidator(description).iter_errors())
    for error in errors:
        print(f"FAILED: {'/'.join(map(str, error.absolute_path))}: {error.message}")
    operations = sum(len(item) for item in description["paths"].values())
    print(f"openapi.json: {operations} operations, {len(errors)} errors")
    return 1 if errors or not operations else 0


if __name__ == "__main__":
    sys.exit(main())
