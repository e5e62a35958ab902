"""Corner's relation between leakage and velocity (eq. 5.3): v / v_tight = (1 - psi)^0.7.

psi is 0 for a perfect seal and 1 for gas that all blows by. Source: Corner, Theory of the Interior Ballistics of Guns
(Wiley, 1950), as the thesis quotes it. The thesis puts psi of its gun between 0.4 and 0.6.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

_EXPONENT = 0.7


def corner_velocity_ratio(leakage: ArrayLike) -> NDArray[np.float64]:
    """v / v_tight for psi in [0, 1]. Raises `ValueError` naming the first value outside."""
    return np.asarray((1 - _share("leakage", leakage)) ** _EXPONENT)


def corner_leakage(velocity_ratio: ArrayLike) -> NDArray[np.float64]:
    """psi for v / v_tight in [0, 1], the efficiency of eq. 2.18 for example. Raises as the other way round."""
    return np.asarray(1 - _share("velocity_ratio", velocity_ratio) ** (1 / _EXPONENT))


def _share(name: str, value: ArrayLike) -> NDArray[np.float64]:
    values = np.asarray(value, dtype=np.float64)
    good = (values >= 0) & (values <= 1)
    if not np.all(good):
        raise ValueError(f"{name} = {float(values[~good].flat[0])!r}: expected 0 to 1")
    return values
