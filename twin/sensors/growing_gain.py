"""The gain of a sensor that is not linear: it changes evenly, by ratio, with what goes through it.

gain^(1 + growth (x / reference - 1)) of x: the stated gain at the reference, and near it the
straight line 1 + (gain - 1) (1 + growth (x / reference - 1)) of a static characteristic that bends
(linearity: IEC 61298-2:2008, ISA-37.1). As a power it stays positive everywhere. x is a reading or
a true value, in the unit of the reference.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...array_types import Floats
from ..effects import Value, parameter

#: -1 / e, where Lambert's W begins, less the last digits in which it has no value.
_LOWEST = -np.exp(-1.0) * (1 - 1e-12)
#: Of a rate: less changes no digit of what any sensor reads, and has no inverse that is a number.
_LEAST_RATE = 1e-30


def growth_parameter(reference: str) -> Any:
    """The field of an effect for its growth, whose gain is stated at the `reference`, a size with
    its unit. It says how the gain acts, not whether. Likely: about 1, a characteristic that is
    right near zero and bends."""
    text = f"change of the gain's error over {reference}, over the error at {reference}"
    return parameter(
        text, "", default=0.0, low=0.0, high=1.5, off=0.0, likely=(0.5, 1.5), owner="channel"
    )


def gain_at(values: Floats, gain: Value, growth: Value, reference: float) -> Floats:
    """The gain at each of the values; where nothing grows the stated one, to the bit."""
    return np.asarray(gain ** (1 + growth * (values / reference - 1)))


def rate_of(gain: Value, growth: Value, reference: float) -> Value:
    """Derivative of the gain's logarithm for what goes through, in 1 over the unit of the
    reference."""
    return np.asarray(growth * np.log(gain) / reference)


def up_to_turn(values: Floats, rate: Value) -> Floats:
    """x no further than where x exp(rate x) would fall again, which no characteristic does."""
    falls = np.asarray(rate) < -_LEAST_RATE
    turn = np.where(falls, -1 / np.where(falls, rate, -1.0), np.inf)
    return np.minimum(values, turn)


def without_growing_gain(products: Floats, rate: Value) -> Floats:
    """x of products x exp(rate x), by Lambert's W; the turn, where no x has so large a product."""
    from scipy.special import lambertw

    grows = np.abs(rate) > _LEAST_RATE
    divisor = np.where(grows, rate, 1.0)
    inverse = np.real(lambertw(np.maximum(divisor * products, _LOWEST))) / divisor
    return np.where(grows, inverse, products)
