"""Random pulses of the contact law that the twin takes without a model, for rows of a dataset."""

from __future__ import annotations

import numpy as np

from ...array_types import Floats
from ...dataset.table import PulseTable
from ...schema.impacts import INTEGRATED
from ...twin.contact.prior import MOST_PULSES, PriorContact
from ...twin.contact.target_motion import PulseMoments, TargetMotion, velocity_before_contact
from ...twin.contact_interface import ForcePulses, ImpactBatch
from ...twin.measured_shots import MeasuredShots
from ...twin.prediction import stratified_normals
from ...twin.setting import ElasticMaterial, Setting
from .analytic import bodies
from .base import ContactPrediction

#: A mass that a contact does not ask for: the whole plate's.
_PLATE_MASS_KG = 10.0
_NO_LAYER = "none"


def prior_contact(pulses: PulseTable) -> PriorContact:
    """The contact of which nothing was learned. A bullet's mass is a predictor; without it, a hand
    holds a hammer."""
    names = [predictor.name for predictor in pulses.predictors]
    return PriorContact(hand_held="bullet_mass" not in names)


def updated_contact(
    pulses: PulseTable, velocity_kind: str | None = None, plates: PulseTable | None = None
) -> PriorContact:
    """The contact updated by these pulses as a twin without a model updates it, by at most
    `MOST_PULSES`.

    Raises as `prior_pulses`.
    """
    return prior_contact(pulses).updated(
        measured_shots(pulses, velocity_kind, plates).evenly(MOST_PULSES)
    )


def measured_shots(
    pulses: PulseTable, velocity_kind: str | None = None, plates: PulseTable | None = None
) -> MeasuredShots:
    """What the rows show of the contact, without any acceleration; velocities are of this kind.
    `plates` as in `settings_of`. Raises as `prior_pulses`."""
    n = len(pulses)
    velocity, uncertainty = velocity_before(pulses, velocity_kind, plates)
    return MeasuredShots(
        settings=tuple(settings_of(pulses, plates)),
        configuration=np.unique(pulses.configuration, return_inverse=True)[1].astype(np.intp),
        impact_velocity_m_s=velocity,
        impact_velocity_u_m_s=uncertainty,
        contact_time_s=pulses.contact_time_s,
        peak_force_n=pulses.peak_force_n,
        impulse_n_s=pulses.impulse_n_s,
        sensors=(),
        peak_acceleration_m_s2=np.zeros((n, 0)),
        frequency_hz=np.zeros(0),
        q=10.0,
        spectra_m_s2=np.zeros((n, 0, 0)),
    )


def prior_pulses(
    contact: PriorContact,
    pulses: PulseTable,
    draws: int,
    rng: np.random.Generator,
    velocity_kind: str | None = None,
    plates: PulseTable | None = None,
) -> list[ForcePulses]:
    """For each draw the contact's pulses of all rows, whose velocities are of this kind
    (`schema.velocity_kinds`). `plates` as in `settings_of`.

    Raises `LookupError` for predictors that do not tell bodies and materials, `ValueError` for
    values that are unphysical or not known.
    """
    settings, n = settings_of(pulses, plates), len(pulses)
    velocity, _ = velocity_before(pulses, velocity_kind, plates)
    # The draws of one row are stratified, and those of the rows apart from each other.
    z = np.stack([stratified_normals(draws, contact.normals, rng) for _ in range(n)], axis=1)
    strikes = ImpactBatch(settings * draws, np.tile(velocity, draws))
    drawn = contact.pulses(strikes, z.reshape(draws * n, contact.normals))
    times, forces, turns = (
        np.split(values, draws)
        for values in (drawn.contact_time_s, drawn.force_n, drawn.compression_time_s)
    )
    return [ForcePulses(*parts) for parts in zip(times, forces, turns, strict=True)]


def velocity_before(
    pulses: PulseTable, velocity_kind: str | None, plates: PulseTable | None = None
) -> tuple[Floats, Floats]:
    """Velocities before contact and their standard uncertainties, both (n,), m/s.

    One that was integrated to the peak of the force is converted with the pulse that was measured,
    as a twin reads its shots; of others a dataset states no uncertainty: NaN. Raises as
    `prior_pulses`.
    """
    velocity = pulses.column("impact_velocity")
    if velocity_kind != INTEGRATED:
        return velocity, np.full(len(velocity), np.nan)
    motion = TargetMotion.of_strikes(ImpactBatch(settings_of(pulses, plates), velocity))
    return velocity_before_contact(velocity, PulseMoments.of(pulses.force_n), motion)


def settings_of(pulses: PulseTable, plates: PulseTable | None = None) -> list[Setting]:
    """The settings of rows, as far as a contact asks.

    A row tells the material of the first layer hit. Of a plate below an anvil, rows of `plates` (by
    default, of the same table) without an anvil tell it, where they are of the same campaign and
    mass of the plate, and agree; else the anvil's material stands for it. Raises as `prior_pulses`.
    """
    struck = bodies(pulses)
    if struck.impactor_mass_kg is None or struck.plate_thickness_m is None:
        raise ValueError(
            "the impactor's mass or the plate's thickness is not known for "
            "every pulse of the dataset"
        )
    names = [predictor.name for predictor in pulses.predictors]
    layers = _words(pulses, "insulator") if "insulator" in names else [_NO_LAYER] * len(pulses)
    anvils = (
        _words(pulses, "anvil_material") if "anvil_material" in names else [_NO_LAYER] * len(pulses)
    )
    tips = _materials("impactor", pulses.tip_material.tolist(), struck)
    targets = _materials("target", pulses.target_material.tolist(), struck)
    below = _bare_plates(pulses if plates is None else plates)
    keys = _plate_keys(pulses)
    return [
        Setting(
            impactor_mass_kg=float(struck.impactor_mass_kg[row]),
            tip=tips[row],
            tip_radius_m=float(struck.impactor_radius_m[row]),
            plate=targets[row] if anvils[row] == _NO_LAYER else below.get(keys[row], targets[row]),
            plate_thickness_m=float(struck.plate_thickness_m[row]),
            plate_mass_kg=_PLATE_MASS_KG,
            impact_velocity_m_s=float(struck.impact_velocity_m_s[row]),
            anvil=None if anvils[row] == _NO_LAYER else targets[row],
            insulator=layers[row] if anvils[row] != _NO_LAYER else _NO_LAYER,
        )
        for row in range(len(pulses))
    ]


def _plate_keys(pulses: PulseTable) -> list[tuple[str, float]]:
    """What tells plates apart: the campaign, and the mass where it is a predictor."""
    weighed = any(predictor.name == "plate_mass" for predictor in pulses.predictors)
    masses = pulses.column("plate_mass") if weighed else np.full(len(pulses), _PLATE_MASS_KG)
    pairs = zip(pulses.campaign.tolist(), masses.tolist(), strict=True)
    return [(campaign, round(mass, 9)) for campaign, mass in pairs]


def _bare_plates(pulses: PulseTable) -> dict[tuple[str, float], ElasticMaterial]:
    """Materials of plates that were struck without an anvil, where a key (`_plate_keys`) has a
    single one."""
    if all(predictor.name != "anvil_material" for predictor in pulses.predictors):
        return {}
    bare = pulses.take(np.array(_words(pulses, "anvil_material")) == _NO_LAYER)
    if not len(bare):
        return {}
    materials: dict[tuple[str, float], set[ElasticMaterial]] = {}
    targets = _materials("target", bare.target_material.tolist(), bodies(bare))
    for key, material in zip(_plate_keys(bare), targets, strict=True):
        materials.setdefault(key, set()).add(material)
    return {key: next(iter(several)) for key, several in materials.items() if len(several) == 1}


def _words(pulses: PulseTable, name: str) -> list[str]:
    (levels,) = (predictor.levels for predictor in pulses.predictors if predictor.name == name)
    return [levels[int(value)] for value in pulses.column(name)]


def _materials(part: str, names: list[str], target: object) -> list[ElasticMaterial]:
    def column(quantity: str) -> Floats | None:
        values: Floats | None = getattr(target, f"{part}_{quantity}")
        return values

    modulus, poisson, density = (
        column(name) for name in ("youngs_modulus_pa", "poisson_ratio", "density_kg_m3")
    )
    strength = column("yield_strength_pa")
    assert modulus is not None and poisson is not None and density is not None  # bodies have them
    return [
        ElasticMaterial(
            name or part,
            float(modulus[row]),
            float(poisson[row]),
            float(density[row]),
            None if strength is None else float(strength[row]),
        )
        for row, name in enumerate(names)
    ]


def random_pulses(prediction: ContactPrediction, z: Floats, momentum_n_s: Floats) -> ForcePulses:
    """Pulses of normal numbers z (n, 2) about the mean ones, as `RegisteredContact` says; momenta
    (n,) in N s."""
    mean = mean_pulses(prediction)
    force_s, time_s = log_spreads(prediction).T
    together = (
        np.zeros(len(z)) if prediction.log_correlation is None else prediction.log_correlation
    )
    time = time_s * z[:, 1]
    force = force_s * (together * z[:, 1] + np.sqrt(1 - together**2) * z[:, 0])
    most = np.log(
        np.maximum(2 * prediction.impulse_allowance * momentum_n_s / mean.impulse_n_s, 1.0)
    )
    force = np.minimum(force + time, most) - time
    time = np.exp(time)
    return ForcePulses(
        mean.contact_time_s * time,
        mean.force_n * np.exp(force)[:, None],
        mean.compression_time_s * time,
    )


def log_spreads(prediction: ContactPrediction) -> Floats:
    """Standard deviations (n x 2) of the logarithms of peak force and contact time of a random
    pulse; 0 where the model states no spread."""
    if prediction.log_spread is not None:
        return prediction.log_spread
    mean = mean_pulses(prediction)
    rows, peak = np.arange(len(mean.force_n)), mean.force_n.argmax(axis=1)
    force, time = prediction.force_spread_n, prediction.contact_time_spread_s
    return np.column_stack(
        [
            _logarithmic(None if force is None else force[rows, peak], mean.peak_force_n),
            _logarithmic(time, mean.contact_time_s),
        ]
    )


def _logarithmic(spread: Floats | None, mean: Floats) -> Floats:
    """Deviation (n,) of the logarithm of a log-normal quantity, from the deviation over the
    mean."""
    return (
        np.zeros(len(mean))
        if spread is None
        else np.asarray(np.sqrt(np.log1p((spread / mean) ** 2)))
    )


def mean_pulses(prediction: ContactPrediction) -> ForcePulses:
    """The mean pulses. Models force nothing at the ends of contact, where the force is 0 by what
    contact means."""
    force = np.maximum(prediction.force_n, 0.0)
    force[:, [0, -1]] = 0.0
    share = np.argmax(force, axis=1) / (force.shape[1] - 1)
    return ForcePulses(prediction.contact_time_s, force, share * prediction.contact_time_s)
