"""How much damping a restitution takes in Hunt and Crossley's law, and the other way round.

Glossary: a damping number of F = k delta^1.5 (1 + a delta' / u), e restitution that the motion ends with.
The motion has the integral a (1 + e) = ln((1 + a) / (1 - e a)); with q = -ln(1 - e a) it reads
a - ln(1 + a) = q + exp(-q) - 1, which keeps its digits where e a comes close to one.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...array_types import Floats

#: Restitutions (n,) in (0, 1] to damping numbers (n,).
DampingLaw = Callable[[Floats], Floats]

_NEARLY_ELASTIC = 1e-4  # below this loss the first terms of the series are exact to 1e-8


def low_loss_damping(restitution: Floats) -> Floats:
    """a = (3/2) (1 - e), eq. 1.20: Hunt and Crossley, J. Appl. Mech. 42 (1975) 440.

    For small losses. The motion ends with more than the e asked for: 0.748 for 2/3, 0.516 for 0.1.
    """
    return np.asarray(1.5 * (1 - restitution))


def matched_damping(restitution: Floats) -> Floats:
    """The a (n,) whose motion ends with e exactly.

    Sources: Gonthier, McPhee, Lange and Piedboeuf, Multibody System Dynamics 11 (2004) 209; Zhang and Sharf, J. Appl.
    Mech. 76 (2009).
    """
    from scipy.optimize.elementwise import find_root

    def excess(q: Floats, e: Floats) -> Floats:
        a = -np.expm1(-q) / e
        return np.asarray(a - np.log1p(a) - q - np.expm1(-q))

    lossy = np.minimum(restitution, 1 - _NEARLY_ELASTIC)
    q = find_root(excess, (1 - lossy, 1 / lossy + 1), args=(lossy,)).x
    nearly = 1.5 * (1 - restitution) / restitution
    return np.where(restitution > 1 - _NEARLY_ELASTIC, nearly, -np.expm1(-q) / lossy)


def restitution_of(damping: Floats) -> Floats:
    """The e (n,) with which motions of damping numbers a (n,), not negative, end."""
    from scipy.optimize.elementwise import find_root

    def excess(q: Floats, a: Floats) -> Floats:
        return np.asarray(q + np.expm1(-q) - (a - np.log1p(a)))

    damped = np.maximum(damping, _NEARLY_ELASTIC)
    q = find_root(excess, (np.zeros_like(damped), damped + 1), args=(damped,)).x
    return np.where(damping < _NEARLY_ELASTIC, 1 / (1 + damping / 1.5), -np.expm1(-q) / damped)
