"""Hammer campaigns of a known contact: forces solved finely, then sampled wherever the recorder
happens to sample."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pyroshock.diagnosis.record import CampaignRecord, Run, RunConfiguration, Series
from pyroshock.twin.contact.impact import impact
from pyroshock.twin.contact.impacts import ContactEffect, bodies_of, impedance
from pyroshock.twin.contact_interface import ImpactBatch
from pyroshock.twin.effects import Effect
from pyroshock.twin.sensors.chain import SensorChain
from pyroshock.twin.sensors.effect import SensorEffect
from pyroshock.twin.setting import THESIS, Setting

RATE_HZ = 51_200.0
MASS_KG = 0.32
_FINER = 32
#: Tip, its radius, anvil and insulator.
FOUR = (
    ("aluminum", 0.03, "none", "none"),
    ("delrin", 0.03, "steel", "none"),
    ("delrin", 0.03, "steel", "polymeric"),
    ("polyurethane", 0.015, "aluminum", "polymeric"),
)


def hammer_record(
    effects: Sequence[Effect] = (),
    *,
    settings: Sequence[tuple[str, float, str, str]] = FOUR,
    repetitions: int = 3,
    noise: float = 0.0,
    seed: int = 0,
) -> CampaignRecord:
    """Strikes at 0.7 to 2.1 m/s. `effects` act truly; the record knows nothing of them. Noise over
    each peak."""
    rng = np.random.default_rng(seed)
    names = ("tip_material", "tip_radius", "anvil_material", "insulator", "plate_material")
    configurations = tuple(
        RunConfiguration(f"setting {i}", dict(zip(names, (*each, "aluminum"), strict=True)))
        for i, each in enumerate(settings)
    )
    velocity = rng.uniform(0.7, 2.1, len(settings) * repetitions)
    forces = recorded(
        np.repeat(np.arange(len(settings)), repetitions), settings, velocity, effects, rng, noise
    )
    readings = SensorChain(_sensors(effects)).measured_velocity_m_s(velocity)
    runs = tuple(
        Run(
            i // repetitions,
            i + 1,
            i % repetitions + 1,
            i,
            velocity_m_s=float(reading),
            force=force,
        )
        for i, (reading, force) in enumerate(zip(readings, forces, strict=True))
    )
    return CampaignRecord(
        "strikes", "hammer", configurations, runs, hammer_mass_kg=MASS_KG, materials=THESIS
    )


def recorded(
    rows: np.ndarray,
    settings: Sequence[tuple[str, float, str, str]],
    velocity_m_s: np.ndarray,
    effects: Sequence[Effect],
    rng: np.random.Generator,
    noise: float,
) -> list[Series]:
    """Forces at 51.2 kHz; 0 s is where the contact begins, anywhere between two samples."""
    strikes = strikes_of([settings[row] for row in rows], velocity_m_s)
    own = [each for each in effects if isinstance(each, ContactEffect)]
    layer = np.array([settings[row][3] != "none" for row in rows])
    pulse = impact(
        bodies_of(strikes), own, insulated=layer, plate_impedance_n_s_m=impedance(strikes)
    )
    phase = np.linspace(0, 1, 4001)
    found = []
    for i, force in enumerate(pulse.force_at(phase)):
        count = int(np.ceil(6.0 * pulse.compression_time_s[i] * RATE_HZ))
        time = (np.arange(-12 * _FINER, count * _FINER) + rng.integers(_FINER)) / (_FINER * RATE_HZ)
        fine = np.interp(time, phase * pulse.contact_time_s[i], force, left=0.0, right=0.0)
        seen = SensorChain(_sensors(effects)).measured_force_n(fine, 1 / (_FINER * RATE_HZ))[
            ::_FINER
        ]
        found.append(
            Series(
                seen + noise * seen.max() * rng.standard_normal(seen.size), RATE_HZ, float(time[0])
            )
        )
    return found


def strikes_of(
    settings: Sequence[tuple[str, float, str, str]], velocity_m_s: np.ndarray
) -> ImpactBatch:
    """The insulator is left out: without an anvil the twin knows none."""
    return ImpactBatch([_setting(*arguments) for arguments in settings], velocity_m_s)


def _setting(tip: str, radius: float, anvil: str, _insulator: str) -> Setting:
    return Setting(
        impactor_mass_kg=MASS_KG, tip=THESIS[tip], tip_radius_m=radius, plate=THESIS["aluminum"],
        plate_thickness_m=0.01, plate_mass_kg=8.0, impact_velocity_m_s=1.0,
        anvil=None if anvil == "none" else THESIS[anvil],
    )  # fmt: skip


def without(record: CampaignRecord, row: int, **missing: object) -> CampaignRecord:
    runs = list(record.runs)
    runs[row] = replace(runs[row], **missing)
    return replace(record, runs=tuple(runs))


def _sensors(effects: Sequence[Effect]) -> tuple[SensorEffect, ...]:
    return tuple(each for each in effects if isinstance(each, SensorEffect))
