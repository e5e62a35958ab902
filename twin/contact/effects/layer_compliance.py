"""The insulating layer as a spring in series with the contact."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from ...effects import Value, parameter
from ..impacts import ContactEffect, Impacts


@dataclass(frozen=True)
class LayerCompliance(ContactEffect):
    """Acts only where the insulator is present. A layer of thickness t and modulus E below an area
    A: t / (E A).

    A sheet that is pressed together grows stiffer, as its modulus over what is left of its
    thickness does: rubbers and foams by half at a few tenths of strain. Its stiffness grows with
    the force, by `stiffening_1_n`.
    """

    id: ClassVar[str] = "contact.layer_compliance"
    law: ClassVar[str] = "x = delta + C F; a layer that stiffens: x = delta + (C / h) ln(1 + h F)"
    source: ClassVar[str] = (
        "springs in series; stiffening: Mindlin, Bell System Tech. J. 24 "
        "(1945) 353, on cushions whose stiffness grows"
    )

    # up to 1 mm of rubber (E = 5 MPa) below 2 cm^2; a sheet of hard polymer has some 1e-9 to 1e-8
    compliance_m_n: Value = parameter(
        "C of the layer",
        "m/N",
        default=1e-8,
        low=0,
        high=1e-4,
        off=0,
        likely=(0, 1e-6),
        owner="layer",
    )
    # stiffness doubles at 1 / h: some tenths of strain of a sheet, 0.1 to 10 kN below a tip
    stiffening_1_n: Value = parameter(
        "h, by which its stiffness grows with force",
        "1/N",
        default=0,
        low=0,
        high=1,
        off=0,
        likely=(0, 1e-2),
        owner="layer",
    )
    regimes: ClassVar[tuple[tuple[str, ...], ...]] = (
        ("compliance_m_n",),
        ("compliance_m_n", "stiffening_1_n"),
    )

    def prepare(self, impacts: Impacts) -> Impacts:
        added = np.where(impacts.insulated, self._each(self.compliance_m_n, impacts), 0.0)
        return replace(
            impacts,
            layer_compliance_m_n=impacts.layer_compliance_m_n + added,
            layer_stiffening_1_n=impacts.layer_stiffening_1_n
            + self._each(self.stiffening_1_n, impacts),
        )
