"""What strikes and what is struck, as arrays of impacts."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...array_types import Floats


class MissingQuantityError(ValueError):
    """A law wants a quantity that these bodies do not tell. `quantity` names it, as the field of
    `Bodies` does."""

    def __init__(self, quantity: str, law: str) -> None:
        super().__init__(f"{law} needs {quantity}, which is not known for every impact")
        self.quantity = quantity


@dataclass(frozen=True, eq=False)
class Bodies:
    """n impacts of a spherical tip on a flat target; every array is (n,), SI. `Bodies.of`
    broadcasts.

    None stands for what is not known: only the laws that want it refuse. `target_*` is the first
    layer hit, `plate_thickness_m` the resonant plate's. Raises `ValueError` naming the quantity and
    the value where one is unphysical or not finite.
    """

    impactor_radius_m: Floats
    impactor_youngs_modulus_pa: Floats
    impactor_poisson_ratio: Floats
    impactor_density_kg_m3: Floats
    target_youngs_modulus_pa: Floats
    target_poisson_ratio: Floats
    target_density_kg_m3: Floats
    impact_velocity_m_s: Floats
    impactor_mass_kg: Floats | None = (
        None  # all that moves with the tip, where the tip is not the whole impactor
    )
    impactor_yield_strength_pa: Floats | None = None
    target_yield_strength_pa: Floats | None = None
    plate_thickness_m: Floats | None = None

    def __post_init__(self) -> None:
        for item in fields(self):
            values = getattr(self, item.name)
            if values is None:
                continue
            if values.shape != self.impact_velocity_m_s.shape or values.ndim != 1:
                raise ValueError(
                    f"{item.name} has shape {values.shape}: "
                    f"expected (n,) as all; Bodies.of broadcasts"
                )
            poisson = item.name.endswith("poisson_ratio")
            good = (
                (values > -1) & (values <= 0.5) if poisson else (values > 0) & np.isfinite(values)
            )
            if not np.all(good):
                expected = "above -1 and at most 0.5" if poisson else "positive and finite"
                raise ValueError(f"{item.name} = {float(values[~good][0])!r}: expected {expected}")

    @classmethod
    def of(cls, **quantities: ArrayLike | None) -> Self:
        """Impacts from numbers and arrays (n,) that broadcast.

        Parameters:
            quantities: Values of the fields by name, SI; None is left out.

        Raises:
            ValueError: As the class, and for shapes that do not broadcast.
            TypeError: For a name that is no field, and where a field without a default is missing.
        """
        arrays = {
            name: np.asarray(value, dtype=np.float64)
            for name, value in quantities.items()
            if value is not None
        }
        shape = np.broadcast_shapes((1,), *(value.shape for value in arrays.values()))
        return cls(**{name: np.broadcast_to(value, shape) for name, value in arrays.items()})

    def __len__(self) -> int:
        return len(self.impact_velocity_m_s)

    def take(self, rows: NDArray[np.intp]) -> Self:
        """Some of the impacts.

        Parameters:
            rows: Their row numbers.
        """
        arrays = {name: values[rows] for name, values in vars(self).items() if values is not None}
        return replace(self, **arrays)

    def needed(self, quantity: str, law: str) -> Floats:
        """A quantity (n,) that may be unknown.

        Parameters:
            quantity: Name of the field.
            law: What the message calls the law that wants it.

        Raises:
            MissingQuantityError: Where it is unknown; the message names quantity and law.
        """
        values: Floats | None = getattr(self, quantity)
        if values is None:
            raise MissingQuantityError(quantity, law)
        return values

    @property
    def compliance_1_pa(self) -> Floats:
        """1/E* = (1 - nu_s^2) / E_s + (1 - nu_p^2) / E_p, (n,)."""
        tip = (1 - self.impactor_poisson_ratio**2) / self.impactor_youngs_modulus_pa
        return np.asarray(tip + (1 - self.target_poisson_ratio**2) / self.target_youngs_modulus_pa)

    @property
    def hertz_stiffness_n_m15(self) -> Floats:
        """k = (4/3) E* sqrt(R) of F = k delta^1.5, (n,): eq. 1.16 with n = 3/2 (Johnson, Contact
        Mechanics, 1985)."""
        return np.asarray(4 / 3 * np.sqrt(self.impactor_radius_m) / self.compliance_1_pa)

    @property
    def sphere_mass_kg(self) -> Floats:
        """Mass of a whole sphere of the tip's radius and density, (n,): the impactor of Hunter,
        Reed and Zener."""
        return np.asarray(4 / 3 * np.pi * self.impactor_density_kg_m3 * self.impactor_radius_m**3)
