"""Random pulses of the twin's contact before anything was learned, for rows of a dataset."""

from __future__ import annotations

import numpy as np

from ..dataset.table import Floats, PulseTable
from ..schema.velocity_kinds import INTEGRATED
from ..twin.bands import stratified_normals
from ..twin.contact.prior import PriorContact
from ..twin.contact.target_motion import PulseMoments, TargetMotion, velocity_before_contact
from ..twin.materials import Material
from ..twin.setting import Setting
from ..twin.strikes import ContactStage, Pulses, Strikes
from .models.analytic import bodies

PRIOR = "the prior of the contact"
#: A mass that a contact does not ask for: the whole plate's.
_PLATE_MASS_KG = 10.0
_NO_LAYER = "none"


def prior_contact(pulses: PulseTable) -> ContactStage:
    """The contact of which nothing was learned. A bullet's mass is a predictor; without it, a hand holds a hammer."""
    names = [predictor.name for predictor in pulses.predictors]
    return PriorContact(hand_held="bullet_mass" not in names)


def prior_pulses(
    pulses: PulseTable, draws: int, rng: np.random.Generator, velocity_kind: str | None = None
) -> list[Pulses]:
    """For each draw the pulses of all rows, whose velocities are of this kind (`schema.velocity_kinds`).

    Raises `LookupError` for predictors that do not tell bodies and materials, `ValueError` for values that are
    unphysical or not known.
    """
    contact = prior_contact(pulses)
    strikes = Strikes(settings_of(pulses), velocity_before(pulses, velocity_kind))
    n = len(pulses)
    # The draws of one row are stratified, and those of the rows apart from each other.
    z = np.stack([stratified_normals(draws, contact.normals, rng) for _ in range(n)], axis=1)
    return [contact.pulses(strikes, z[draw]) for draw in range(draws)]


def velocity_before(pulses: PulseTable, velocity_kind: str | None) -> Floats:
    """Velocities before contact (n,), m/s. One that was integrated to the peak of the force is converted with the pulse
    that was measured, as a twin reads its shots. Raises as `prior_pulses`."""
    velocity = pulses.column("impact_velocity")
    if velocity_kind != INTEGRATED:
        return velocity
    motion = TargetMotion.of_strikes(Strikes(settings_of(pulses), velocity))
    return velocity_before_contact(velocity, PulseMoments.of(pulses.force_n), motion)[0]


def settings_of(pulses: PulseTable) -> list[Setting]:
    """The settings of rows, as far as a contact asks. The target is the first layer hit: of a plate below an anvil the
    material is not a predictor, and the anvil's stands for it. Raises as `prior_pulses`.
    """
    struck = bodies(pulses)
    if struck.impactor_mass_kg is None or struck.plate_thickness_m is None:
        raise ValueError("the impactor's mass or the plate's thickness is not known for every pulse of the dataset")
    names = [predictor.name for predictor in pulses.predictors]
    layers = _words(pulses, "insulator") if "insulator" in names else [_NO_LAYER] * len(pulses)
    anvils = _words(pulses, "anvil_material") if "anvil_material" in names else [_NO_LAYER] * len(pulses)
    tips = _materials("impactor", pulses.tip_material.tolist(), struck)
    targets = _materials("target", pulses.target_material.tolist(), struck)
    return [
        Setting(
            impactor_mass_kg=float(struck.impactor_mass_kg[row]),
            tip=tips[row],
            tip_radius_m=float(struck.impactor_radius_m[row]),
            plate=targets[row],
            plate_thickness_m=float(struck.plate_thickness_m[row]),
            plate_mass_kg=_PLATE_MASS_KG,
            impact_velocity_m_s=float(struck.impact_velocity_m_s[row]),
            anvil=None if anvils[row] == _NO_LAYER else targets[row],
            insulator=layers[row] if anvils[row] != _NO_LAYER else _NO_LAYER,
        )
        for row in range(len(pulses))
    ]


def _words(pulses: PulseTable, name: str) -> list[str]:
    (levels,) = (predictor.levels for predictor in pulses.predictors if predictor.name == name)
    return [levels[int(value)] for value in pulses.column(name)]


def _materials(part: str, names: list[str], struck: object) -> list[Material]:
    def column(quantity: str) -> Floats | None:
        values: Floats | None = getattr(struck, f"{part}_{quantity}")
        return values

    modulus, poisson, density = (column(name) for name in ("youngs_modulus_pa", "poisson_ratio", "density_kg_m3"))
    strength = column("yield_strength_pa")
    assert modulus is not None and poisson is not None and density is not None  # bodies have them
    return [
        Material(
            name or part,
            float(modulus[row]),
            float(poisson[row]),
            float(density[row]),
            None if strength is None else float(strength[row]),
        )
        for row, name in enumerate(names)
    ]
