"""Where a predictor's value comes from: one visible list of sources, each reads an
`ImpactSource`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ..schema.known_factors import NONE

#: Young's modulus, Poisson ratio, density and yield strength of a material, SI, by name.
Properties = Mapping[str, float]
#: Properties of materials by the store's name.
Materials = Mapping[str, Properties]

#: Property of a material -> (column of `materials`, unit).
PROPERTIES: dict[str, tuple[str, str]] = {
    "youngs_modulus": ("youngs_modulus_pa", "Pa"),
    "poisson_ratio": ("poisson_ratio", ""),
    "density": ("density_kg_m3", "kg/m3"),
    "yield_strength": ("yield_strength_pa", "Pa"),
}
#: A free factor by which a lab states what its plate weighs, whatever its shape.
STATED_PLATE_MASS = "plate_mass_kg"
FACTOR = "factor."


@dataclass(frozen=True)
class ImpactSource:
    """What one impact was made with; None where the store does not know. `words` and `numbers` are
    factors (SI)."""

    words: Mapping[str, str]
    numbers: Mapping[str, float]
    velocity_m_s: float | None
    impactor_mass_kg: float | None
    bench_plate_material: str | None
    plate_thickness_m: float | None
    plate_area_m2: float | None

    @property
    def tip(self) -> str | None:
        return self.words.get("tip_material")

    @property
    def plate(self) -> str | None:
        """The material of the plate: the row's own, else that of the bench."""
        return self.words.get("plate_material", self.bench_plate_material)

    @property
    def target(self) -> str | None:
        """The material of the first layer hit. Unknown where no row says whether there is an
        anvil."""
        anvil = self.words.get("anvil_material")
        return self.plate if anvil == NONE else anvil


Number = Callable[[ImpactSource, Materials], float | None]
Word = Callable[[ImpactSource], str | None]

_PARTS: dict[str, Word] = {
    "tip": lambda case: case.tip,
    "target": lambda case: case.target,
    "plate": lambda case: case.plate,
}


def _property(part: Word, column: str) -> Number:
    def read(case: ImpactSource, materials: Materials) -> float | None:
        name = part(case)
        return None if name is None else materials.get(name, {}).get(column)

    return read


def _plate_mass(case: ImpactSource, materials: Materials) -> float | None:
    """As stated, else area times thickness times density."""
    if STATED_PLATE_MASS in case.numbers:
        return case.numbers[STATED_PLATE_MASS]
    density = materials.get(case.plate or "", {}).get("density_kg_m3")
    if density is None or case.plate_area_m2 is None or case.plate_thickness_m is None:
        return None
    return case.plate_area_m2 * case.plate_thickness_m * density


#: Name -> (unit, how it is read).
NUMBERS: dict[str, tuple[str, Number]] = {
    **{
        f"{part}.{name}": (unit, _property(of, column))
        for part, of in _PARTS.items()
        for name, (column, unit) in PROPERTIES.items()
    },
    "impact.velocity": ("m/s", lambda case, _: case.velocity_m_s),
    "impactor.mass": ("kg", lambda case, _: case.impactor_mass_kg),
    "plate.thickness": ("m", lambda case, _: case.plate_thickness_m),
    "plate.mass": ("kg", _plate_mass),
}
#: Name -> how the word is read: for categories.
WORDS: dict[str, Word] = {f"{part}.material": of for part, of in _PARTS.items()}
#: The source that repetitions do not share: treatments are told apart without it.
VELOCITY = "impact.velocity"


def known_sources() -> str:
    """The sources there are, for messages."""
    return ", ".join((*sorted({*NUMBERS, *WORDS}), f"{FACTOR}NAME"))


def read_number(source: str, case: ImpactSource, materials: Materials) -> float | None:
    """A number of an impact, SI; None where the store does not know it.

    Parameters:
        source: A source of `NUMBERS`, such as "tip.density", or "factor.NAME".
        case: What the impact was made with.
        materials: Properties of the materials by name.
    """
    if source.startswith(FACTOR):
        return case.numbers.get(source.removeprefix(FACTOR))
    return NUMBERS[source][1](case, materials)


def read_word(source: str, case: ImpactSource) -> str | None:
    """A word of an impact; None where the store does not know it.

    Parameters:
        source: A source of `WORDS`, such as "tip.material", or "factor.NAME".
        case: What the impact was made with.
    """
    return (
        case.words.get(source.removeprefix(FACTOR))
        if source.startswith(FACTOR)
        else WORDS[source](case)
    )
