"""What a report draws of a diagnosis beside its numbers: residuals and curves before and after the first cause."""

from __future__ import annotations

from dataclasses import dataclass

from ..array_types import Floats


@dataclass(frozen=True, eq=False)
class ResidualPicture:
    """One observable over the configurations: measured less simulated, means over runs, NaN where there is none.

    `before` (C,) is the nominal simulator's, `after` (C,) with the fitted cause, None without one. `floor` (C,) is
    what repetitions leave of such a mean, one standard deviation. All in `unit`.
    """

    name: str
    stage: str
    unit: str
    tolerance: float
    before: Floats
    after: Floats | None
    floor: Floats


@dataclass(frozen=True, eq=False)
class CurvePicture:
    """A record as it was measured, and as it is simulated before and after: a pulse (x in s), a spectrum (x in Hz)."""

    title: str
    x_name: str
    x_unit: str
    y_name: str
    y_unit: str
    x: Floats
    measured: Floats
    before: Floats
    after: Floats | None = None
    logarithmic: bool = False


@dataclass(frozen=True)
class Pictures:
    """What is drawn. `configurations` are the labels of the C configurations."""

    configurations: tuple[str, ...] = ()
    residuals: tuple[ResidualPicture, ...] = ()
    curves: tuple[CurvePicture, ...] = ()
