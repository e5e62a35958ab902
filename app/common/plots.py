"""Pictures. matplotlib is imported here and nowhere else, and only when something is drawn."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ...files.atomic_write import atomic_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MEASURED, MODEL, QUIET = "#1b6ca8", "#d1495b", "#8d99ae"


def new_figure(width: float, height: float) -> Figure:
    """A figure that needs no display and no global state."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained", dpi=150)


def save(figure: Figure, path: Path) -> None:
    """Write a figure; the suffix decides the format. `ValueError` for one that cannot be drawn."""
    formats = figure.canvas.get_supported_filetypes()
    if path.suffix.lstrip(".").lower() not in formats:
        raise ValueError(
            f"cannot draw {path.name!r}; expected one of "
            f"{', '.join('.' + k for k in sorted(formats))}"
        )
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_file(path) as partial:
        figure.savefig(partial)
