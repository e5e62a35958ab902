"""More or less mass behind the tip than the nominal one."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from ...effects import Value, parameter
from ..impacts import ContactEffect, Impacts


@dataclass(frozen=True)
class EffectiveMass(ContactEffect):
    """Hand, arm or fixture that moves with the tip while the contact lasts, or a part of it that
    does not."""

    id: ClassVar[str] = "contact.effective_mass"
    law: ClassVar[str] = "m' = g m"
    source: ClassVar[str] = "momentum: the impulse is (1 + e) m' u"

    # a hand behind a light hammer at most triples it; a hollow or split impactor has half of it
    mass_factor: Value = parameter(
        "g, mass over the nominal one",
        "",
        default=1.2,
        low=0.1,
        high=10,
        off=1,
        likely=(0.5, 3),
        owner="bullet",
    )

    def prepare(self, impacts: Impacts) -> Impacts:
        return replace(impacts, mass_kg=impacts.mass_kg * self._each(self.mass_factor, impacts))
