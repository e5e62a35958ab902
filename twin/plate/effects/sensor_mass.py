"""Mass loading by the sensors: frequencies fall most where the shape at a sensor is large.

Glossary: Phi (sensors, m) shapes, Omega (m,) circular frequencies, C = diag(2 zeta Omega), V (m, m)
new modes in terms of the old ones.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ....array_types import Floats
from ...effects import Value, parameter
from ..modal import ModalPlate, PlateEffect


@dataclass(frozen=True)
class SensorMass(PlateEffect):
    """A mass at every sensor, one for all or (sensors,), solved exactly within the modes there are.

    Modes that the plate does not list would take a part: the shift comes out too small, less so the
    more modes. Of the damping matrix the diagonal is kept (light damping). Rigid modes stay at 0
    Hz.
    """

    # From a miniature shock accelerometer (1 g) to a triaxial one on its mounting block and cable.
    mass_kg: Value = parameter(
        "mass of each sensor",
        "kg",
        default=0.027,
        low=0.0,
        high=5.0,
        off=0.0,
        likely=(0.0, 0.3),
        owner="channel",
    )

    id = "plate.sensor_mass"
    law = "Omega^2 V = (1 + sum_s m Phi_s' Phi_s) V Omega'^2"
    source = (
        "Ewins, Modal Testing, 2nd ed. (2000), on structural modification; 0.027 "
        "kg: PCB 350B43 (thesis 2.2.1)"
    )

    def changed(self, plate: ModalPlate) -> ModalPlate:
        from scipy.linalg import eigh

        omega = 2 * np.pi * plate.frequency_hz
        sensors = self.values("mass_kg", "sensors", len(plate.shapes))
        mass = np.eye(omega.size) + (plate.shapes.T * sensors) @ plate.shapes
        squares, vectors = eigh(np.diag(omega**2), mass)
        squares[: np.count_nonzero(omega == 0)] = 0.0  # else the root of a rounding error
        loaded = np.sqrt(np.abs(squares))
        return replace(
            plate,
            frequency_hz=loaded / (2 * np.pi),
            damping_ratio=_ratios(plate.damping_ratio, omega, loaded, vectors),
            shape_impact=plate.shape_impact @ vectors,
            shapes=plate.shapes @ vectors,
        )


def _ratios(ratio: Floats, omega: Floats, loaded: Floats, vectors: Floats) -> Floats:
    """Ratios (m,) from the diagonal of V' C V; a rigid mode keeps its own."""
    losses = (vectors**2).T @ (2 * ratio * omega)
    elastic = loaded > 0
    return np.where(elastic, losses / np.where(elastic, 2 * loaded, 1), ratio)
