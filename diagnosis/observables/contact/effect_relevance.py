"""Which effects have a part in a contact and its record."""

from __future__ import annotations

import numpy as np

from ....twin.contact.bodies import MissingQuantityError
from ....twin.contact.effect import ContactEffect
from ....twin.contact.impacts import Impacts
from ....twin.effects import Effect
from ....twin.sensors.effect import SensorEffect


def acts(kind: type[Effect], nominal: Impacts) -> bool:
    """Whether it changes anything of these impacts or of their record."""
    if not issubclass(kind, ContactEffect):
        return concerns(kind)
    try:
        changed = kind().prepare(nominal)
    except MissingQuantityError:
        return False
    quantities = (name for name, value in vars(nominal).items() if isinstance(value, np.ndarray))
    return any(not np.array_equal(getattr(changed, name), getattr(nominal, name)) for name in quantities)


def concerns(kind: type[Effect]) -> bool:
    """Effects of the contact, and of the sensors on either side of it."""
    hooks = ("measured_force_n", "measured_velocity_m_s")
    sensor = issubclass(kind, SensorEffect)
    return issubclass(kind, ContactEffect) or (
        sensor and any(getattr(kind, hook) is not getattr(SensorEffect, hook) for hook in hooks)
    )
