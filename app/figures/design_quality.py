"""A design's quality, on a figure or on axes of matplotlib that the caller gives."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ...array_types import Levels
from ...doe.merit.model_terms import interaction_terms, main_terms, term_correlations
from ...doe.merit.pair_balance import level_labels, pair_matrix
from ...doe.merit.space_filling import deviations
from ...doe.space import Space

if TYPE_CHECKING:
    from matplotlib.figure import Figure


COLOUR, QUIET, MAP, LEVELS_MAP = "#1b6ca8", "#8d99ae", "RdBu_r", "viridis"


def draw_quality(figure: Figure, space: Space, designs: Mapping[str, Levels]) -> None:
    """Designs by name, treatments (n, axes) in order of run: a column each, on scales that no
    design sets.

    From above: every pair of levels (`pair_matrix`); how far each two effects go together, from 0
    to 1; how far the cells of three axes are from their share, beside runs drawn at random; the
    levels run by run, where long stripes are what is seldom changed. Raises `ValueError` where
    there is no design, a design has no run, or a row is no treatment.
    """
    if not designs:
        raise ValueError("designs is empty; expected at least one to draw")
    for name, treatments in designs.items():
        if not len(space.checked(treatments)):
            raise ValueError(f"design {name!r}: no run; expected at least one")
    panels = figure.subplots(4, len(designs), squeeze=False, height_ratios=(5, 5, 2, 2))
    for column, (name, treatments) in enumerate(designs.items()):
        pairs = draw_pairs(panels[0, column], space, treatments)
        panels[0, column].set_title(f"{name}: {len(treatments)} runs")
        correlations = _draw_correlations(panels[1, column], space, treatments)
        _draw_triples(panels[2, column], space, treatments)
        draw_runs(panels[3, column], space, treatments)
    top = max(axes.get_ylim()[1] for axes in panels[2])
    for axes in panels[2]:
        axes.set_ylim(0.7, top)
    figure.colorbar(pairs, ax=panels[0].tolist(), label=PAIR_SCALE, shrink=0.8)
    figure.colorbar(
        correlations, ax=panels[1].tolist(), label="correlation of two effects", shrink=0.8
    )


#: What a colour of `draw_pairs` says.
PAIR_SCALE = "runs beyond the balanced share, over the share"


def draw_pairs(axes: Any, space: Space, treatments: Levels) -> Any:
    """`pair_matrix` of treatments (n, axes) as a picture, which is returned; its colours end at -1
    and 1."""
    picture = axes.imshow(pair_matrix(space, treatments), cmap=MAP, vmin=-1, vmax=1)
    space = space.stratified
    axes.set_facecolor(QUIET)  # where levels of one axis exclude each other
    for edge in np.cumsum([axis.size for axis in space.axes])[:-1] - 0.5:
        axes.axhline(edge, color="black", lw=0.5)
        axes.axvline(edge, color="black", lw=0.5)
    labels = level_labels(space)
    axes.set_xticks(range(len(labels)), labels, rotation=90, fontsize=6)
    axes.set_yticks(range(len(labels)), labels, fontsize=6)
    return picture


#: Names on the correlation map, beyond which they would be specks.
_MOST_NAMES = 60


def _draw_correlations(axes: Any, space: Space, treatments: Levels) -> Any:
    """`model_terms.term_correlations` of main effects and, beyond the line, interactions of two
    factors."""
    mains = main_terms(space, treatments)
    terms = [*mains, *interaction_terms(mains)]
    picture = axes.imshow(term_correlations(terms), cmap="Blues", vmin=0, vmax=1)
    axes.axhline(len(mains) - 0.5, color="black", lw=0.5)
    axes.axvline(len(mains) - 0.5, color="black", lw=0.5)
    names = [term.name.replace("_", " ") for term in terms] if len(terms) <= _MOST_NAMES else []
    axes.set_xticks(range(len(names)), names, rotation=90, fontsize=5)
    axes.set_yticks(range(len(names)), names, fontsize=5)
    return picture


#: Runs above or below the share that the histogram of triples shows; what is further off is counted
#: at its ends.
_REACH = 5.0


def _draw_triples(axes: Any, space: Space, treatments: Levels) -> None:
    """Deviations of the cells of three axes, and in outline those of as many runs drawn at random
    (seed 0)."""
    random_rows = np.random.default_rng(0).integers(
        0, [axis.size for axis in space.axes], treatments.shape
    )
    bins = np.linspace(-_REACH, _REACH, 51)
    for rows, style in (
        (treatments, {"color": COLOUR}),
        (random_rows, {"histtype": "step", "color": "black"}),
    ):
        cells = space.in_strata(rows)
        parts = [
            deviation.ravel()
            for _, deviation in deviations(cells, [axis.strata for axis in space.axes], 3)
        ]
        if parts:
            label = "this plan" if rows is treatments else "runs drawn at random"
            axes.hist(
                np.clip(np.concatenate(parts), -_REACH, _REACH), bins=bins, label=label, **style
            )
            axes.set_yscale("log")
            axes.legend(fontsize=6)
    axes.axvspan(-1, 1, color=QUIET, alpha=0.25, lw=0)
    axes.set_xlim(-1.05 * _REACH, 1.05 * _REACH)
    axes.set_xlabel("runs above the share, cells of three factors")
    axes.set_ylabel("cells")


def draw_runs(axes: Any, space: Space, treatments: Levels) -> None:
    """The level of each axis from run to run, lowest to highest, of treatments (n, axes)."""
    shares = space.checked(treatments) / np.maximum(1, [axis.size - 1 for axis in space.axes])
    axes.imshow(shares.T, cmap=LEVELS_MAP, aspect="auto", interpolation="nearest", vmin=0, vmax=1)
    axes.set_yticks(
        range(len(space.axes)), [axis.name.replace("_", " ") for axis in space.axes], fontsize=6
    )
    axes.set_xlabel("run")
