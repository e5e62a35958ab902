"""What a user may ask of a diagnosis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ..twin.contact_interface import ContactStage
from .probability_maps import UnknownMap

#: Of each stage: velocity and peak force as shares, spectra in dB. What the observables' tolerances stand for.
TOLERANCES = {"gun": 0.01, "contact": 0.03, "plate": 0.5}

#: Stages whose nominal parameters may be declared uncertain.
_UNCERTAIN = ("gun", "contact")


@dataclass(frozen=True)
class Options:
    """`tolerances` by stage (gun and contact: shares, plate: dB); a gap within them is none.

    `uncertain`: standard deviations of nominal parameters, "gun.friction_coefficient" in SI, "contact.impactor_mass_kg"
    and what else an impact is made of as shares. `contact`: a registered model in the place of Hertz' impact, which may
    want to know `plate_mass_kg`. `catalogue`: ids of the effects that are looked for (`diagnose --with`);
    None: all there are. `without`: ids that are left out (`diagnose --without`).
    `unknown_map`: from log odds to the probability of something outside of the catalogue. `shrink`, `where`, `plan`
    and `rate_pulses` (ISO 18571) leave out parts of the report that take time. Raises `ValueError` for a stage there is
    none of and for a tolerance that is not positive.
    """

    seed: int = 0
    tolerances: Mapping[str, float] = field(default_factory=dict)
    uncertain: Mapping[str, float] = field(default_factory=dict)
    contact: ContactStage | None = None
    plate_mass_kg: float | None = None
    catalogue: tuple[str, ...] | None = None
    without: tuple[str, ...] = ()
    unknown_map: UnknownMap = field(default_factory=UnknownMap)
    shrink: bool = True
    where: bool = True
    plan: bool = True
    rate_pulses: bool = True

    def __post_init__(self) -> None:
        for stage, value in self.tolerances.items():
            if stage not in TOLERANCES:
                raise ValueError(f"tolerance of {stage!r}: no such stage; expected one of {', '.join(TOLERANCES)}")
            if not value > 0:
                raise ValueError(f"tolerance of {stage} = {value!r}: expected a positive number")
        for name in self.uncertain:
            if name.partition(".")[0] not in _UNCERTAIN:
                names = " or ".join(f"{stage}.NAME" for stage in _UNCERTAIN)
                raise ValueError(f"uncertain {name!r}: expected {names}, a nominal parameter of that stage")

    @property
    def tolerance_scale(self) -> dict[str, float]:
        """By how much each stage's tolerances are widened."""
        return {stage: value / TOLERANCES[stage] for stage, value in self.tolerances.items()}

    def uncertain_of(self, stage: str) -> dict[str, float]:
        """By the name that the stage knows."""
        prefix = f"{stage}."
        return {name.removeprefix(prefix): value for name, value in self.uncertain.items() if name.startswith(prefix)}
