"""Many answers at once: columns in, columns out."""

from __future__ import annotations

import array
from typing import TYPE_CHECKING, Any

from .errors import RequestError
from .results import NodeId

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd

    from .network import Network

_NAMES = ("service_from", "service_to", "destination")


def columns_of(network: Network, *given: Any) -> tuple[tuple[Any, Any, Any], bool]:
    """Three columns of 64-bit integers: ids of nodes where these are integers, else the numbers of the nodes."""
    if network.has_integer_ids:
        first, second, third = (_integers(column, name) for column, name in zip(given, _NAMES, strict=True))
        return (first, second, third), True
    number = {node: place for place, node in enumerate(network.node_ids)}
    columns = []
    for column, name in zip(given, _NAMES, strict=True):
        ids = [str(one) for one in column]
        unknown = next((row for row, one in enumerate(ids) if one not in number), None)
        if unknown is not None:
            message = f"the network '{network.name}' has no node '{ids[unknown]}'"
            raise RequestError(message, "unknown_node", f"{name}[{unknown}]", "give ids as in network.node_ids")
        columns.append(array.array("q", [number[one] for one in ids]))
    first, second, third = columns
    return (first, second, third), False


def _integers(column: Any, name: str) -> Any:
    try:
        if isinstance(column, array.array):
            return column if column.typecode == "q" else array.array("q", column)
        if hasattr(column, "to_numpy"):
            column = column.to_numpy()
        if hasattr(column, "astype") and column.dtype.kind in "iu":
            return column.astype("int64", copy=False)
        return array.array("q", [int(one) for one in column])
    except (TypeError, ValueError, OverflowError) as fault:
        raise RequestError(str(fault), "not_a_column", name, "give a column of node ids") from fault


class Recompositions:
    """The answers to many reports, a column for each figure and a row for each report. Frozen: all of it is read only.

    Columns are arrays of numpy where it is there, else memoryviews. A length that there is not is NaN.
    """

    __slots__ = ("_by_id", "_columns", "_network", "_told", "strategy")

    def __init__(self, network: Network, columns: tuple[Any, Any, Any], by_id: bool, strategy: str, told: dict[str, Any]) -> None:
        for name, value in (
            ("_network", network),
            ("_columns", columns),
            ("_by_id", by_id),
            ("strategy", strategy),
            ("_told", told),
        ):
            object.__setattr__(self, name, value)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"cannot assign to '{name}': answers are frozen")

    def __len__(self) -> int:
        return len(self._told["outcome"])

    def _column(self, name: str, kind: str) -> Any:
        try:
            import numpy as np
        except ImportError:
            return memoryview(self._told[name]).cast(kind)
        return np.frombuffer(self._told[name], dtype=kind)

    @property
    def outcome_codes(self) -> np.ndarray[Any, np.dtype[np.uint8]]:
        """Places in `outcome_names`."""
        return self._column("outcome", "B")

    @property
    def outcome_names(self) -> tuple[str, ...]:
        """The outcomes that there are: rerouted, unaffected, hold, diverted, no_route."""
        return tuple(self._told["outcomes"])

    @property
    def remaining_length_m(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """The whole remaining route."""
        return self._column("remaining_length_m", "d")

    @property
    def recomposed_length_m(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """The new part: A to B for a local strategy, all of it for exact."""
        return self._column("recomposed_length_m", "d")

    @property
    def settled_nodes(self) -> np.ndarray[Any, np.dtype[np.uint32]]:
        """Nodes settled by all searches of a report."""
        return self._column("settled_nodes", "I")

    @property
    def path_offsets(self) -> np.ndarray[Any, np.dtype[np.uint64]]:
        """Where the path of each row begins in `path_nodes`; one more than there are rows."""
        return self._column("offsets", "Q")

    @property
    def path_nodes(self) -> np.ndarray[Any, np.dtype[np.uint32]]:
        """All paths, one after the other, as places in `network.node_ids`."""
        return self._column("nodes", "I")

    def outcome(self, row: int) -> str:
        """The outcome of a row."""
        return self.outcome_names[self.outcome_codes[row]]

    def nodes(self, row: int) -> tuple[NodeId, ...]:
        """The path of a row by the ids of its nodes; empty for no_route."""
        if not 0 <= row < len(self):
            raise IndexError(f"there is no row {row}; there are {len(self)}")
        offsets, ids = self.path_offsets, self._network.node_ids
        return tuple(ids[number] for number in self.path_nodes[int(offsets[row]) : int(offsets[row + 1])])

    def to_frame(self) -> pd.DataFrame:
        """A DataFrame with a row for each report. Needs pandas and numpy."""
        import numpy as np
        import pandas as pd

        asked: dict[str, Any] = {}
        for name, column in zip(_NAMES, self._columns):
            numbers = np.asarray(column)
            asked[name] = numbers if self._by_id else np.asarray(self._network.node_ids, dtype=object)[numbers]
        return pd.DataFrame(
            asked
            | {
                "outcome": pd.Categorical.from_codes(self.outcome_codes.astype("int8"), list(self.outcome_names)),
                "remaining_length_m": self.remaining_length_m,
                "recomposed_length_m": self.recomposed_length_m,
                "settled_nodes": self.settled_nodes,
                "path_node_count": np.diff(self.path_offsets.astype("int64")),
            }
        )

    def __repr__(self) -> str:
        return f"<skyway.Recompositions: {len(self)} answers of {self.strategy}>"
