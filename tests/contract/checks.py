"""Counts what holds and what does not."""


class Checks:
    """Expectations of one part of the contract."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.passed = 0
        self.failed = 0

    def expect(self, right: bool, what: str) -> bool:
        """Counts one expectation, and prints it where it does not hold."""
        if right:
            self.passed += 1
        else:
            self.failed += 1
            print(f"FAILED: {self.name}: {what}")
        return bool(right)

    def equal(self, found, expected, what: str) -> bool:
        """Counts one comparison."""
        return self.expect(found == expected, f"{what}: {found!r} is not {expected!r}")

    def told(self) -> str:
        """The result in a line."""
        return f"{self.name}: {self.passed} passed, {self.failed} failed"
