"""Small gun campaigns that the twin shoots itself, with planted effects and scatter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pyroshock.diagnosis.observables.gun.stage import GunObservables
from pyroshock.diagnosis.record import CampaignRecord, Run, RunConfiguration
from pyroshock.twin.effects import Effect
from pyroshock.twin.gun.bench import GunBench

BENCH = GunBench(0.0095, 0.049, 0.048, 0.885, 0.2, 1.4, 1.0)


def gun_record(
    effects: Sequence[Effect] = (),
    *,
    scatter: float = 0.004,
    repetitions: int = 3,
    pressures_pa: Sequence[float] = (0.3e5, 0.8e5, 2.4e5),
    masses_kg: Sequence[float] = (0.25, 1.0),
    seed: int = 0,
) -> CampaignRecord:
    """Every pressure with every mass, `repetitions` times in a shuffled order; `scatter` of ln
    velocity."""
    rng = np.random.default_rng(seed)
    settings = [(p, m) for p in pressures_pa for m in masses_kg]
    configurations = tuple(
        RunConfiguration(f"{p:g} Pa, {m:g} kg", {"tank_pressure": p, "bullet_mass": m})
        for p, m in settings
    )
    order = rng.permutation(np.tile(np.arange(len(settings)), repetitions))
    nominal = tuple(
        Run(int(c), place, 1, place, settings[c][0], settings[c][1], 10.0, 0.1)
        for place, c in enumerate(order)
    )
    stage = GunObservables(CampaignRecord("shots", "gun", configurations, nominal, BENCH))
    velocities = np.exp(stage.simulated(effects)[:, 0] + scatter * rng.standard_normal(len(order)))
    runs = tuple(
        replace(run, velocity_m_s=float(velocity), velocity_u_m_s=scatter * float(velocity))
        for run, velocity in zip(nominal, velocities, strict=True)
    )
    return CampaignRecord("shots", "gun", configurations, runs, BENCH)
