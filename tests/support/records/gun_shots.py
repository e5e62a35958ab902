"""Gun campaigns for tests of the diagnosis: shots by the twin with planted effects, a background,
and noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pyroshock.diagnosis.observables.gun.stage import GunObservables
from pyroshock.diagnosis.record import CampaignRecord, Run, RunConfiguration
from pyroshock.twin.effects import Effect
from pyroshock.twin.gun.bench import GunBench

BENCH = GunBench(0.0095, 0.049, 0.048, 0.885, 0.2, 1.4, 1.0)
PRESSURES_PA = (0.3e5, 0.6e5, 1.2e5, 2.4e5)
MASSES_KG = (0.25, 0.5, 1.0)


def shots(
    effects: Sequence[Effect] = (),
    *,
    seed: int = 0,
    scatter: float = 0.015,
    background: float = 0.004,
    repetitions: int = 4,
    bias: float = 0.0,
) -> CampaignRecord:
    """Twelve settings. `scatter` (of ln velocity) from shot to shot, `background` from setting to
    setting."""
    rng = np.random.default_rng(seed)
    settings = [(p, m) for p in PRESSURES_PA for m in MASSES_KG]
    configurations = tuple(
        RunConfiguration(f"{p:g}, {m:g}", {"tank_pressure": p, "bullet_mass": m})
        for p, m in settings
    )
    nominal = tuple(Run(c, c, 1, c, p, m, 10.0, 0.1) for c, (p, m) in enumerate(settings))
    stage = GunObservables(CampaignRecord("shots", "gun", configurations, nominal, BENCH))
    true = stage.simulated(effects)[:, 0] + background * rng.standard_normal(len(settings)) + bias
    runs = []
    for number, (c, k) in enumerate(
        (c, k) for k in range(repetitions) for c in range(len(settings))
    ):
        velocity = float(np.exp(true[c] + scatter * rng.standard_normal()))
        runs.append(Run(c, c, k + 1, number, *settings[c], velocity, scatter * velocity))
    return CampaignRecord("shots", "gun", configurations, tuple(runs), BENCH)
