"""Figures as pictures for a page: PNG with few colours, a third of what they would take
otherwise."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from pyroshock.files.atomic_write import atomic_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Colours of what was measured, of a model, and of what stands behind.
MEASURED, MODEL, QUIET = "#1b6ca8", "#d1495b", "#8d99ae"
#: Enough for lines with smooth edges and a colour scale.
COLOURS = 200


def write(figure: Figure, path: Path) -> None:
    """The figure at `path`, a .png; the same figure gives the same bytes."""
    from PIL import Image

    # without the name of the software, which changes with its version
    buffer = BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    whole = Image.open(buffer).convert("RGB")
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_file(path) as partial:
        whole.quantize(COLOURS, dither=Image.Dither.NONE).save(partial, format="PNG", optimize=True)
