"""Plates that the measured one may be, so that its modes are recognised where they moved."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ....twin.effects import catalogue
from ....twin.plate.effect import PlateEffect
from ....twin.plate.modal import ModalPlate

#: From one tried plate to the next no mode moves by more than this, in ln frequency; so many at most to each effect.
_STEP, _MOST = 0.015, 16


def tried_plates(nominal: ModalPlate) -> list[ModalPlate]:
    """The nominal plate and those that any one effect of the plate makes of it within what is likely.

    All have the same number of modes in rising order, the k-th of each the k-th of the nominal one.
    """
    found = [nominal]
    for kind in catalogue().values():
        if issubclass(kind, PlateEffect):
            for item in kind.parameters():
                if item.likely is not None:
                    found += _along(nominal, kind, item.name, item.likely)
    return found


def _along(
    nominal: ModalPlate, kind: type[PlateEffect], name: str, likely: tuple[float, float]
) -> Iterator[ModalPlate]:
    ends = [kind(**{name: value}).apply(nominal) for value in likely]
    apart = _apart(*ends)
    count = min(_MOST, int(np.ceil(apart / _STEP)) + 1)
    if count > 1:
        yield from (kind(**{name: float(value)}).apply(nominal) for value in np.linspace(*likely, count))


def _apart(one: ModalPlate, other: ModalPlate) -> float:
    elastic = (one.frequency_hz > 0) & (other.frequency_hz > 0)
    return float(np.max(np.abs(np.log(one.frequency_hz[elastic] / other.frequency_hz[elastic])), initial=0.0))
