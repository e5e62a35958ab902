"""Four-coordinate paper: pseudo-velocity over frequency with equal decades on both axes, so that
the lines of constant acceleration fall and those of constant displacement rise at 45 degrees."""

from __future__ import annotations

import math

import numpy as np

from ....array_types import Floats
from ...common.unit_endings import STANDARD_GRAVITY_M_S2
from ...figures.figure import ColourRole, LineSeries, Plot, PlotAxis, TextLabel, as_floats

#: Lines go on beyond the frame by this factor, so that a page that is zoomed out still has them.
_BEYOND = 100.0
#: Shares of a falling line where its name may stand, the first that is free; a rising line counts
#: from its other end.
_SHARES = (0.15, 0.3, 0.45, 0.6, 0.05)
#: Decades along and across that two names are apart, on a chart of two decades and 250 px.
_APART = (0.4, 0.12)
#: Room about the curves.
_ROOM_HZ, _ROOM_M_S = 1.1, 1.6


def four_coordinate_plot(title: str, frequency_hz: Floats, curves: list[LineSeries]) -> Plot:
    """Curves of pseudo-velocity (m/s) over `frequency_hz` (f,) on four-coordinate paper."""
    values = np.concatenate([curve.y[curve.y > 0] for curve in curves])
    frequencies = float(frequency_hz.min()) / _ROOM_HZ, float(frequency_hz.max()) * _ROOM_HZ
    velocities = float(values.min()) / _ROOM_M_S, float(values.max()) * _ROOM_M_S
    paper, words = paper_lines(*frequencies, *velocities)
    return Plot(
        title,
        PlotAxis("natural frequency", "Hz", scale="log", limits=frequencies),
        PlotAxis("pseudo-velocity", "m/s", scale="log", limits=velocities),
        (*paper, *curves),
        labels=tuple(words),
        equal_decades=True,
    )


def paper_lines(
    lowest: float, right: float, low: float, high: float
) -> tuple[list[LineSeries], list[TextLabel]]:
    """Diagonals of whole decades within a frame of Hz and m/s: v = a / (2 pi f) and v = 2 pi f d,
    and their names."""
    frame = lowest, right, low, high
    corners = [(f, v) for f in (lowest, right) for v in (low, high)]
    diagonals = [
        (10.0**exponent * STANDARD_GRAVITY_M_S2 / (2 * math.pi), -1, f"{10.0**exponent:g} g")
        for exponent in _decades([2 * math.pi * f * v / STANDARD_GRAVITY_M_S2 for f, v in corners])
    ]
    diagonals += [
        (2 * math.pi * 10.0**exponent, 1, _length(10.0**exponent))
        for exponent in _decades([v / (2 * math.pi * f) for f, v in corners])
    ]
    lines: list[LineSeries] = []
    labels: list[TextLabel] = []
    for constant, slope, name in diagonals:
        drawn = _diagonal(constant, slope, frame, name, labels)
        if drawn is not None:
            lines.append(drawn[0])
            labels.append(drawn[1])
    return lines, labels


def _decades(values: list[float]) -> range:
    return range(math.ceil(math.log10(min(values))), math.floor(math.log10(max(values))) + 1)


def _length(metres: float) -> str:
    for unit, scale in (("m", 1.0), ("mm", 1e3), ("µm", 1e6), ("nm", 1e9)):
        if metres * scale >= 0.999:
            return f"{metres * scale:g} {unit}"
    return f"{metres:g} m"


def _diagonal(
    constant: float,
    slope: int,
    frame: tuple[float, float, float, float],
    name: str,
    labels: list[TextLabel],
) -> tuple[LineSeries, TextLabel] | None:
    """v = constant * f ** slope, and its name within the frame, apart from the `labels` that stand
    there; None where the line crosses a corner only."""
    lowest_hz, right, low, high = frame
    crossings = sorted((v / constant) ** slope for v in (low, high))
    begin, end = max(lowest_hz, crossings[0]), min(right, crossings[1])
    if end <= begin * 1.05:
        return None
    f = as_floats([begin / _BEYOND, end * _BEYOND])
    rule = LineSeries(
        f, constant * f**slope, width=1, detail=name, role=ColourRole.RULE, silent=True
    )
    # falling lines are named at their left, rising ones at their right: apart
    shares = _SHARES if slope < 0 else tuple(1 - share for share in _SHARES)
    places = [begin ** (1 - share) * end**share for share in shares]
    candidates = [TextLabel(name, place, constant * place**slope) for place in places]
    free = [label for label in candidates if not any(_touch(label, near) for near in labels)]
    return rule, (free or candidates)[0]


def _touch(label: TextLabel, near: TextLabel) -> bool:
    along, across = abs(math.log10(label.x / near.x)), abs(math.log10(label.y / near.y))
    return along < _APART[0] and across < _APART[1]
