"""Flexural waves that the plate carries away while the contact lasts."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from ...effects import Value, parameter
from ..bodies import MissingQuantityError
from ..impacts import ContactEffect, Impacts


@dataclass(frozen=True)
class PlateCompliance(ContactEffect):
    """The plate's surface gives way with F / Z, Z = 8 sqrt(D rho h) of the plate without edges: no
    echo comes back.

    A part of it stands for a plate whose echoes return some of the loss. Needs the plate's
    thickness or impedance.
    """

    id: ClassVar[str] = "contact.plate_compliance"
    law: ClassVar[str] = "x' = v - s F / Z, Z = 8 sqrt(D rho h)"
    source: ClassVar[str] = "Zener, Phys. Rev. 59 (1941) 669; thesis, eq. 1.13 and 1.14"

    # 1 far from edges, 2.3 on a free one (Cremer, 5.4: 3.5 for 8); more in a corner, less with
    # echoes
    share: Value = parameter(
        "s, mobility over that of the plate without edges",
        "",
        default=1,
        low=0,
        high=10,
        off=0,
        likely=(0, 3),
        owner="plate",
    )

    def prepare(self, impacts: Impacts) -> Impacts:
        if impacts.plate_impedance_n_s_m is None:
            raise MissingQuantityError("plate_thickness_m", self.id)
        added = self._each(self.share, impacts) / impacts.plate_impedance_n_s_m
        return replace(impacts, plate_mobility_m_n_s=impacts.plate_mobility_m_n_s + added)
