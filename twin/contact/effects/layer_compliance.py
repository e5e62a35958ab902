"""The insulating layer as a spring in series with the contact."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from ...effects import Value, parameter
from ..effect import ContactEffect
from ..impacts import Impacts


@dataclass(frozen=True)
class LayerCompliance(ContactEffect):
    """Acts only where the insulator is present. A layer of thickness t and modulus E below an area A: t / (E A)."""

    id: ClassVar[str] = "contact.layer_compliance"
    law: ClassVar[str] = "x = delta + C F"
    source: ClassVar[str] = "springs in series"

    # up to 1 mm of rubber (E = 5 MPa) below 2 cm^2; a sheet of hard polymer has some 1e-9 to 1e-8
    compliance_m_n: Value = parameter("C of the layer", "m/N", default=1e-8, low=0, high=1e-4, off=0, likely=(0, 1e-6))

    def prepare(self, impacts: Impacts) -> Impacts:
        added = np.where(impacts.insulated, self._each(self.compliance_m_n, impacts), 0.0)
        return replace(impacts, layer_compliance_m_n=impacts.layer_compliance_m_n + added)
