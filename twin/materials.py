"""Materials as the twin's stages take them."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class ElasticMaterial:
    """An isotropic elastic material. Raises `ValueError` naming the material, the field and the value."""

    name: str
    youngs_modulus_pa: float
    poisson_ratio: float
    density_kg_m3: float
    yield_strength_pa: float | None = None

    def __post_init__(self) -> None:
        for name in ("youngs_modulus_pa", "density_kg_m3", "yield_strength_pa"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0):
                raise ValueError(f"{self.name}: {name} = {value!r}; expected positive and finite")
        if not -1 < self.poisson_ratio < 0.5:
            raise ValueError(f"{self.name}: poisson_ratio = {self.poisson_ratio!r}; expected above -1 and below 0.5")


#: Thesis, Table 4.2; PLA: Farah, Anderson and Langer, Adv. Drug Deliv. Rev. 107 (2016) 367, solid, mid-range.
THESIS: dict[str, ElasticMaterial] = {
    m.name: m
    for m in (
        ElasticMaterial("aluminum", 69.9e9, 0.33, 2700.0, 276e6),
        ElasticMaterial("steel", 200e9, 0.30, 7800.0, 400e6),
        ElasticMaterial("delrin", 3.20e9, 0.35, 1410.0, 71.7e6),
        ElasticMaterial("polyurethane", 0.03e9, 0.39, 1210.0, 51.0e6),
        ElasticMaterial("PLA", 3.5e9, 0.36, 1240.0, 50e6),
    )
}
