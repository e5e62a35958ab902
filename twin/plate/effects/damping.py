"""Modal damping other than the table says."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...effects import Value, parameter
from ..modal import ModalPlate, PlateEffect

_MOST = 0.99


@dataclass(frozen=True)
class Damping(PlateEffect):
    """Cables, joints and the air add to what a plate loses by itself. Ratios are kept below 0.99;
    the factor is one for all modes, or (m,)."""

    # Bolted and hung structures lose up to some times what a bare plate does, and a table's ratios
    # scatter by half (Cremer, Heckl and Petersson, Structure-Borne Sound, 3rd ed. 2005, on losses
    # at joints).
    factor: Value = parameter(
        "every ratio times this",
        "",
        default=1.5,
        low=0.0,
        high=20.0,
        off=1.0,
        likely=(0.3, 6.0),
        owner="mode band",
    )
    # Not looked for: on ratios that are much alike it is the factor by another name.
    added_ratio: float = parameter(
        "added to every ratio after that", "", default=0.0, low=0.0, high=0.5, off=0.0
    )

    id = "plate.damping"
    law = "zeta' = factor * zeta + added_ratio"
    source = "Ewins, Modal Testing, 2nd ed. (2000), on proportional damping; the shapes stay"

    def changed(self, plate: ModalPlate) -> ModalPlate:
        factor = self.values("factor", "modes", plate.damping_ratio.size)
        ratio = np.minimum(factor * plate.damping_ratio + self.added_ratio, _MOST)
        return replace(plate, damping_ratio=ratio)
