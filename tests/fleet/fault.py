"""What a judge finds in a record about one plan."""

import dataclasses


@dataclasses.dataclass(frozen=True)
class Fault:
    """A plan that is not accounted for, or a version that leads through a zone."""

    rule: str
    at_s: float
    plan: str
    text: str
