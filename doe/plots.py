"""A design's quality as a picture. Draws on a figure that it is given: matplotlib itself is the caller's affair."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..array_types import Floats, Levels
from .merit.space_filling import cell_counts, deviations, worst_deviation
from .space import Space

if TYPE_CHECKING:
    from matplotlib.figure import Figure


COLOUR, QUIET, MAP, LEVELS_MAP = "#1b6ca8", "#8d99ae", "RdBu_r", "viridis"


def draw_quality(figure: Figure, space: Space, designs: Mapping[str, Levels]) -> None:
    """Designs by name, treatments (n, axes) in order of run: a column each, on the same scales.

    From above: every pair of levels, counts minus share (the diagonal blocks show the levels themselves); how far the
    cells of three axes are from their share; the levels run by run, where long stripes are what is seldom changed.
    Raises `ValueError` where there is no design, a design has no run, or a row is no treatment.
    """
    if not designs:
        raise ValueError("designs is empty; expected at least one to draw")
    checked = {name: space.in_strata(treatments) for name, treatments in designs.items()}
    for name, rows in checked.items():
        if not len(rows):
            raise ValueError(f"design {name!r}: no run; expected at least one")
    sizes = [axis.strata for axis in space.axes]
    scale = max(_largest_deviation(rows, sizes) for rows in checked.values())
    reach = max(worst_deviation(rows, sizes, 3) for rows in checked.values()) or 1.0
    panels = figure.subplots(3, len(checked), squeeze=False, height_ratios=(5, 2, 2))
    for column, (name, rows) in enumerate(checked.items()):
        picture = draw_pairs(panels[0, column], space, designs[name], scale)
        panels[0, column].set_title(f"{name}: {len(rows)} runs")
        _draw_triples(panels[1, column], sizes, rows, reach)
        draw_runs(panels[2, column], space, designs[name])
    top = max(axes.get_ylim()[1] for axes in panels[1])
    for axes in panels[1]:
        axes.set_ylim(0.7, top)
    figure.colorbar(picture, ax=panels[0].tolist(), label="runs above the share", shrink=0.8)


def pair_matrix(space: Space, treatments: Levels) -> Floats:
    """Count minus share of each pair of levels, (levels, levels) of all axes in turn; NaN where levels exclude.

    A continuous factor has the parts of its range for levels.
    """
    rows, sizes = space.in_strata(treatments), [axis.strata for axis in space.axes]
    starts = np.cumsum([0, *sizes])
    result = np.full((starts[-1], starts[-1]), np.nan)
    for a, _ in enumerate(sizes):
        for b, _ in enumerate(sizes):
            block = result[starts[a] : starts[a + 1], starts[b] : starts[b + 1]]
            counts = cell_counts(rows, sizes, (a, b) if a != b else (a,))
            if a == b:
                np.fill_diagonal(block, counts - len(rows) / counts.size)
            else:
                block[:] = counts - len(rows) / counts.size
    return result


def _largest_deviation(cells: Levels, sizes: list[int]) -> float:
    """Of levels and pairs from their share; 1 where all are even."""
    return max(worst_deviation(cells, sizes, order) for order in (1, 2)) or 1.0


def draw_pairs(axes: Any, space: Space, treatments: Levels, scale: float | None = None) -> Any:
    """`pair_matrix` of treatments (n, axes) as a picture, which is returned; `scale` (runs) ends its colours."""
    scale = scale or _largest_deviation(space.in_strata(treatments), [axis.strata for axis in space.axes])
    picture = axes.imshow(pair_matrix(space, treatments), cmap=MAP, vmin=-scale, vmax=scale)
    space = space.stratified
    axes.set_facecolor(QUIET)  # where levels of one axis exclude each other
    for edge in np.cumsum([axis.size for axis in space.axes])[:-1] - 0.5:
        axes.axhline(edge, color="black", lw=0.5)
        axes.axvline(edge, color="black", lw=0.5)
    labels = [label for axis in space.axes for label in axis.labels]
    axes.set_xticks(range(len(labels)), labels, rotation=90, fontsize=6)
    axes.set_yticks(range(len(labels)), labels, fontsize=6)
    return picture


def _draw_triples(axes: Any, sizes: list[int], rows: Levels, reach: float) -> None:
    deviations_of_pairs = [deviation.ravel() for _, deviation in deviations(rows, sizes, 3)]
    if deviations_of_pairs:
        axes.hist(np.concatenate(deviations_of_pairs), bins=np.linspace(-reach, reach, 61), color=COLOUR)
        axes.set_yscale("log")
    axes.axvspan(-1, 1, color=QUIET, alpha=0.25, lw=0)
    axes.set_xlim(-1.05 * max(1.0, reach), 1.05 * max(1.0, reach))
    axes.set_xlabel("runs above the share, cells of three axes")
    axes.set_ylabel("cells")


def draw_runs(axes: Any, space: Space, treatments: Levels) -> None:
    """The level of each axis from run to run, lowest to highest, of treatments (n, axes)."""
    shares = space.checked(treatments) / np.maximum(1, [axis.size - 1 for axis in space.axes])
    axes.imshow(shares.T, cmap=LEVELS_MAP, aspect="auto", interpolation="nearest", vmin=0, vmax=1)
    axes.set_yticks(range(len(space.axes)), [axis.name for axis in space.axes], fontsize=6)
    axes.set_xlabel("run")
