"""Every design has its column of figures, on scales that no design sets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from numpy.typing import NDArray
from pyroshock.app.figures.design_quality import draw_quality
from pyroshock.doe.space import gun_space

GUN = gun_space()
SIZES = [axis.size for axis in GUN.axes]


def test_quality_is_drawn_for_each_design() -> None:
    figure = Figure()
    draw_quality(figure, GUN, {"every": GUN.all_treatments(), "some": GUN.all_treatments()[::7]})
    assert [axes.get_title() for axes in figure.axes[:2]] == ["every: 810 runs", "some: 116 runs"]
    assert figure.axes[0].images[0].get_array().shape == (sum(SIZES), sum(SIZES))
    limits = [axes.get_xlim() + axes.get_ylim() for axes in figure.axes[4:6]]
    assert limits[0] == limits[1]
    scales = {axes.images[0].get_clim() for axes in figure.axes[:4]}
    assert scales == {(-1.0, 1.0), (0.0, 1.0)}  # whatever the designs are
    figure.canvas.draw()
    space = replace(GUN, factors=GUN.factors[:1], axes=GUN.axes[:1], rules=())
    draw_quality(figure, space, {"two": space.all_treatments()})
    figure.canvas.draw()


@pytest.mark.parametrize("drawn", [{}, {"none": np.zeros((0, 6), dtype=np.int64)}])
def test_nothing_to_draw_is_refused(drawn: dict[str, NDArray[np.int64]]) -> None:
    with pytest.raises(ValueError, match="expected at least one"):
        draw_quality(Figure(), GUN, drawn)
