"""The pictures of a diagnosis: residuals before and after with the floor shaded, records beside their simulation."""

from __future__ import annotations

import numpy as np

from ...array_types import Floats
from ...diagnosis.verdict import CurvePicture, Pictures, ResidualPicture
from ..diagnoses.labels import observable_label
from .svg import band, chart, dots, frame_of, level, line

#: The floor is shaded to so many standard deviations.
SIGMAS = 2.0
_LARGEST_LOG = 20.0
#: SI units in those of a screen: the unit that is shown, and how many of them one SI unit is.
_SHOWN = {"s": ("ms", 1e3), "N": ("kN", 1e-3)}


def residual_title(picture: ResidualPicture) -> str:
    """The physical name of an observable, and its stage."""
    return f"{observable_label(picture.name).text} ({picture.stage})"


def residual_chart(picture: ResidualPicture, configurations: tuple[str, ...]) -> str:
    """Residuals over the configurations; those of logarithms as per cent of the simulated value."""
    count = picture.before.size
    label = observable_label(picture.name)
    x = np.arange(1, count + 1, dtype=np.float64)
    names = configurations if len(configurations) == count else tuple(f"configuration {i}" for i in range(1, count + 1))
    ends = np.array([0.5, count + 0.5])
    shade = SIGMAS * picture.floor
    # the first and last floors reach to the edges of the frame
    edges = np.concatenate([ends[:1], x, ends[1:]])
    wide = np.concatenate([shade[:1], shade, shade[-1:]])
    shown = _in_percent if label.relative else _as_it_is
    low, high, room = shown(-wide), shown(wide), shown(np.array([-picture.tolerance, picture.tolerance]))
    before = shown(picture.before)
    after = [] if picture.after is None else [shown(picture.after)]
    frame = frame_of([ends], [before, *after, low, high, room])
    marks = [
        band(frame, edges, low, high, "floor"),
        level(frame, 0.0, "zero"),
        *(level(frame, float(value), "tolerance") for value in room),
        dots(frame, x, before, "before", names),
        *(dots(frame, x, residual, "after", names) for residual in after),
    ]
    unit = " (%)" if label.relative else "" if picture.unit == "1" else f" ({picture.unit})"
    title = f"measured {'over' if label.relative else 'less'} simulated{unit}"
    return chart(residual_title(picture), frame, marks, "configuration", title, whole=True)


def _in_percent(logarithms: Floats) -> Floats:
    """By how many per cent measured exceeds simulated; logarithms that no bench reaches are drawn at the edge."""
    return np.asarray(100 * np.expm1(np.clip(logarithms, -_LARGEST_LOG, _LARGEST_LOG)))


def _as_it_is(values: Floats) -> Floats:
    return values


def curve_chart(picture: CurvePicture) -> str:
    """A record, and its simulation before and after."""
    x_unit, x_scale = _SHOWN.get(picture.x_unit, (picture.x_unit, 1.0))
    y_unit, y_scale = _SHOWN.get(picture.y_unit, (picture.y_unit, 1.0))
    x = x_scale * picture.x
    curves = {"before": picture.before, "after": picture.after, "measured": picture.measured}
    shown = {f"{kind}-line": y_scale * y for kind, y in curves.items() if y is not None}
    frame = frame_of([x], list(shown.values()), logarithmic=picture.logarithmic)
    marks = [line(frame, x, y, kind) for kind, y in shown.items()]
    titles = (f"{name} ({unit})" for name, unit in ((picture.x_name, x_unit), (picture.y_name, y_unit)))
    return chart(picture.title, frame, marks, *titles)


def legend(pictures: Pictures) -> str:
    """What the marks of the charts mean."""
    keys = legend_keys(pictures)
    return "".join(f'<span class="key"><i class="key-{kind}"></i>{words}</span>' for kind, words in keys)


def legend_keys(pictures: Pictures) -> tuple[tuple[str, str], ...]:
    """The marks of the charts by kind, and their meaning."""
    later = [picture.after for picture in pictures.residuals] + [picture.after for picture in pictures.curves]
    after = any(values is not None for values in later)
    keys = [("before", "nominal model")] + ([("after", "with the first cause")] if after else [])
    keys += [("measured", "measured")] if pictures.curves else []
    return (*keys, ("floor", "measurement noise, two standard deviations"), ("tolerance", "tolerance"))
