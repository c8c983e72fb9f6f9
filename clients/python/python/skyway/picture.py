"""Maps: an SVG that notebooks show by themselves."""

from __future__ import annotations

import os
import pathlib
from dataclasses import dataclass


@dataclass(frozen=True)
class Map:
    """A picture of a network and of what was found on it. The last line of a notebook's cell shows it."""

    svg: str
    """The text of the SVG: it refers to nothing outside itself and runs no script."""

    def _repr_svg_(self) -> str:
        return self.svg

    def _repr_html_(self) -> str:
        return f'<div style="max-width: 100%; overflow-x: auto">{self.svg}</div>'

    def __repr__(self) -> str:
        return f"Map of {len(self.svg)} bytes"

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the SVG to a file."""
        pathlib.Path(path).write_text(self.svg, encoding="utf-8")
