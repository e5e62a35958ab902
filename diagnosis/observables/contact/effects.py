"""Effects of a contact and its sensors: which have a part in it, and readings made true."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ....twin.contact.bodies import MissingQuantityError
from ....twin.contact.effect import ContactEffect
from ....twin.contact.impacts import Impacts
from ....twin.effects import Effect
from ....twin.sensors.chain import SensorChain
from ....twin.sensors.effect import SensorEffect
from ...record import Floats


def applies_to_contact(kind: type[Effect]) -> bool:
    """Whether it is an effect of the contact, or of the sensors on either side of it."""
    hooks = ("measured_force_n", "measured_velocity_m_s")
    if issubclass(kind, SensorEffect):
        return any(getattr(kind, hook) is not getattr(SensorEffect, hook) for hook in hooks)
    return issubclass(kind, ContactEffect)


def is_active(kind: type[Effect], nominal: Impacts) -> bool:
    """Whether it changes anything of these impacts or of their record."""
    if not issubclass(kind, ContactEffect):
        return applies_to_contact(kind)
    try:
        changed = kind().prepare(nominal)
    except MissingQuantityError:
        return False
    quantities = (name for name, value in vars(nominal).items() if isinstance(value, np.ndarray))
    return any(not np.array_equal(getattr(changed, name), getattr(nominal, name)) for name in quantities)


def split_effects(effects: Iterable[Effect]) -> tuple[tuple[ContactEffect, ...], SensorChain]:
    """Those of the contact in their order, and those of the sensors as a chain; of other stages none."""
    effects = tuple(effects)
    contact = tuple(effect for effect in effects if isinstance(effect, ContactEffect))
    return contact, SensorChain.of(effect for effect in effects if isinstance(effect, SensorEffect))


def true_velocity(chain: SensorChain, reading_m_s: Floats) -> Floats:
    """Velocities (n,) from readings: the chain walked backwards, exact for gains and offsets."""
    low, high = chain.measured_velocity_m_s(reading_m_s), chain.measured_velocity_m_s(2 * reading_m_s)
    slope = (high - low) / reading_m_s
    return np.asarray(reading_m_s + (reading_m_s - low) / slope)
