"""Effects of many impacts at once: whose they are, some impacts' out of a stack, and readings made true."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ....twin.contact.effect import ContactEffect
from ....twin.effects import Effect
from ....twin.sensors.chain import SensorChain
from ....twin.sensors.effect import SensorEffect

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]
E = TypeVar("E", bound=Effect)


def split(effects: Iterable[Effect]) -> tuple[tuple[ContactEffect, ...], SensorChain]:
    """Those of the contact in their order, and those of the sensors as a chain; of other stages none."""
    given = tuple(effects)
    contact = tuple(each for each in given if isinstance(each, ContactEffect))
    return contact, SensorChain.of(each for each in given if isinstance(each, SensorEffect))


def taken(effect: E, rows: Rows) -> E:
    """The effect on some impacts: parameters that are one for each are taken with them."""
    values = {item.name: getattr(effect, item.name) for item in effect.parameters()}
    return replace(effect, **{name: value[rows] for name, value in values.items() if np.ndim(value) > 0})


def true_velocity(chain: SensorChain, reading_m_s: Floats) -> Floats:
    """Velocities (n,) from readings: the chain walked backwards, exact for gains and offsets."""
    low, high = chain.measured_velocity_m_s(reading_m_s), chain.measured_velocity_m_s(2 * reading_m_s)
    slope = (high - low) / reading_m_s
    return np.asarray(reading_m_s + (reading_m_s - low) / slope)
