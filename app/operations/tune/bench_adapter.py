"""What the tuner asks of a lab: which settings there are, what the bench refuses, what shots have
shown."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ....array_types import Floats
from ....doe.factors import DesignFactor
from ....doe.guards import PlannedShot, check_run
from ....doe.limits.bench import BenchLimits
from ....doe.limits.contact_force import Elastic, hertz_contact
from ....doe.space import Space
from ....twin.chain import Twin
from ....twin.contact_interface import ImpactBatch
from ....twin.setting import ElasticMaterial, Setting
from ....twin.srs.target import Target
from ....twin.tune.goal import Goal, Outside, Refusals
from ....twin.tune.probability import Proposal
from ....twin.tune.space import Amount, ContinuousRange, Levels, TuningSpace
from ....twin.tune.tuner import SettingToAvoid, Tuned
from ...twins.benches import LEAST_PRESSURE_PA

NONE = "none"
#: Settings to avoid that are told.
SHOWN = 10
#: Tips of a continuous radius that are tried.
_MOST_RADII = 9


@dataclass(frozen=True, eq=False)
class SensorTwin:
    """A twin as the tuner asks it: spectra at one sensor (None: its first)."""

    twin: Twin
    sensor: str | None = None

    @property
    def frequency_hz(self) -> Floats:
        return self.twin.frequency_hz

    def spectra(self, settings: Sequence[Setting]) -> Floats:
        return self.twin.spectra(settings, self.sensor)

    def draws(self, settings: Sequence[Setting], count: int, rng: np.random.Generator) -> Floats:
        return self.twin.draws(settings, count, rng, self.sensor)


def goal_of(target: Target, lines_hz: Floats, share: float) -> Goal:
    """A target at the lines of the twin, with its whole rule; a smaller `share` than the rule's
    goes before it.

    Raises `ValueError` for a line outside of the target's range.
    """
    at = target.at(lines_hz)
    least = min(share, at.rule.share_within)
    return Goal(lines_hz, 20 * np.log10(at.level_m_s2), at.upper_db, at.lower_db, least, at.rule)


def tuning_space(
    factors: Space,
    material: Callable[[str], ElasticMaterial],
    plate: ElasticMaterial,
    plate_thickness_m: float,
    plate_mass_kg: float,
    positions: Sequence[str],
    limits: BenchLimits,
    mass_kg: Amount | None = None,
) -> TuningSpace:
    """The lab's levels as the factors of its plans tell them, any pressure that the bench allows,
    on one plate.

    `mass_kg` None: the bullets of the plan's levels. Raises `ValueError` for factors without a tip,
    radius or mass; `material` raises for a level's that it does not know.
    """
    of = {factor.name: factor for factor in factors.factors}
    highest = min(
        limits.max_tank_pressure_pa, limits.max_regulated_pressure_pa, limits.max_valve_pressure_pa
    )
    anvils = _words(of.get("anvil_material"), (NONE,))
    return TuningSpace(
        plate=plate,
        plate_thickness_m=plate_thickness_m,
        plate_mass_kg=plate_mass_kg,
        tips=tuple(material(word) for word in _words(of.get("tip_material"), ())),
        tip_radii_m=tuple(1e-3 * number for number in _numbers(of, "tip_radius", _MOST_RADII)),
        anvils=tuple(None if word == NONE else material(word) for word in anvils),
        insulators=_words(of.get("insulator"), (NONE,)),
        impact_positions=tuple(positions),
        tank_pressure_pa=ContinuousRange(LEAST_PRESSURE_PA, highest),
        impactor_mass_kg=mass_kg or _masses(of),
    )


def _words(factor: DesignFactor | None, otherwise: tuple[str, ...]) -> tuple[str, ...]:
    return factor.levels if factor is not None else otherwise


def _numbers(
    factors: Mapping[str, DesignFactor], name: str, most: int | None = None
) -> tuple[float, ...]:
    """The numbers of a factor; of a continuous one `most` of them, at equal distances, its ends
    included."""
    factor = factors.get(name)
    if factor is None or factor.numbers is None:
        raise ValueError(f"the factors have no numbers of {name}; there are: {', '.join(factors)}")
    if most is None or not factor.continuous or len(factor.numbers) <= most:
        return factor.numbers
    return tuple(
        factor.numbers[place]
        for place in np.linspace(0, len(factor.numbers) - 1, most).round().astype(int)
    )


def _masses(factors: Mapping[str, DesignFactor]) -> Amount:
    factor = factors.get("bullet_mass")
    if factor is not None and factor.continuous:
        return ContinuousRange(*factor.limits)
    return Levels(_numbers(factors, "bullet_mass"))


def bench_refusals(twin: Twin, limits: BenchLimits) -> Refusals:
    """What the guard of a plan says of a setting fired at once: Hertz's force, which errs on the
    safe side."""

    def refusals(settings: Sequence[Setting]) -> list[tuple[str, ...]]:
        return [
            _refused(s, v, limits)
            for s, v in zip(settings, twin.velocities(settings).tolist(), strict=True)
        ]

    return refusals


def _refused(setting: Setting, velocity_m_s: float, limits: BenchLimits) -> tuple[str, ...]:
    if not velocity_m_s > 0:
        return ("the bullet does not leave the barrel",)
    contact = hertz_contact(
        _elastic(setting.tip),
        _elastic(setting.target),
        tip_radius_m=setting.tip_radius_m,
        bullet_mass_kg=setting.impactor_mass_kg,
        impact_velocity_m_s=velocity_m_s,
    )
    shot = PlannedShot(
        run="proposed",
        tank_pressure_pa=setting.tank_pressure_pa or 0.0,
        bullet_mass_kg=setting.impactor_mass_kg,
        impact_velocity_m_s=velocity_m_s,
        plate=setting.plate.name,
        anvil=setting.anvil.name if setting.anvil else NONE,
        peak_force_n=contact.peak_force_n,
        contact_time_s=contact.contact_time_s,
    )
    return tuple(exceeded.message for exceeded in check_run(shot, limits))


def _elastic(material: ElasticMaterial) -> Elastic:
    return Elastic(material.youngs_modulus_pa, material.poisson_ratio)


def outside_of(twin: Twin) -> Outside:
    """What the contact stage says of settings at their nominal velocity, as `predict` says it."""
    from ..predict.validity import outside_sentence

    def outside(settings: Sequence[Setting]) -> list[tuple[str, ...]]:
        out_of_domain = twin.contact.outside(ImpactBatch(settings, twin.velocities(settings)))
        return [
            tuple(str(outside_sentence(item, twin.models["contact"])).rstrip(".") for item in items)
            for items in out_of_domain
        ]

    return outside


def setting_json(setting: Setting) -> dict[str, Any]:
    """As `impacts` names them, SI."""
    return {
        "tank_pressure_pa": setting.tank_pressure_pa,
        "bullet_mass_kg": setting.impactor_mass_kg,
        "tip_material": setting.tip.name,
        "tip_radius_m": setting.tip_radius_m,
        "plate_material": setting.plate.name,
        "anvil_material": setting.anvil.name if setting.anvil else NONE,
        "insulator": setting.insulator,
        "impact_position": setting.impact_position,
    }


def proposal_json(proposal: Proposal, rank: int) -> dict[str, Any]:
    """A row of `tune --json`."""
    return {
        "rank": rank,
        "settings": setting_json(proposal.setting),
        "probability_met": proposal.probability_met,
        "probability_within": proposal.probability_within,
        "probability_95_percent_within": proposal.probability_95,
        "share_within": proposal.share_within,
        "probability_overtest": proposal.probability_overtest,
        # a side of the band that is free has no edge: JSON knows no infinity
        "worst_margin_db": proposal.worst_margin_db
        if math.isfinite(proposal.worst_margin_db)
        else None,
        "worst_frequency_hz": proposal.worst_frequency_hz,
        "expected_m_s2": level_m_s2(proposal.level_db).tolist(),
        "lower_m_s2": level_m_s2(proposal.lower_db).tolist(),
        "upper_m_s2": level_m_s2(proposal.upper_db).tolist(),
        "outside_domain": list(proposal.outside),
        "alternatives": [setting_json(setting) for setting in proposal.alternatives],
    }


def proposal_rows(tuned: Tuned) -> list[dict[str, Any]]:
    """What is told of the settings to choose from, the best first."""
    return [
        proposal_json(choice.proposal, rank) | choice.as_json()
        for rank, choice in enumerate(tuned.choices, 1)
    ]


def avoid_json(avoid: SettingToAvoid) -> dict[str, Any]:
    """A row of `tune --avoid FILE`."""
    return {
        "settings": setting_json(avoid.setting),
        "avoid": avoid.reason,
        "mean_level_error_db": avoid.level_error_db,
    }


def level_m_s2(level_db: Floats) -> Floats:
    """The inverse of `twin.tune.goal.level_db`."""
    return np.asarray(10 ** (level_db / 20))
