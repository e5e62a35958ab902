"""Settings that one more shot could have."""

from __future__ import annotations

from dataclasses import replace

from pyroshock.diagnosis.next_runs import candidate_stages
from pyroshock.diagnosis.observables.gun.stage import GunObservables
from support.records.gun_shots import shots


def test_a_proposed_shot_has_the_travel_of_the_nearest_projectile() -> None:
    travels = {0.25: 0.885, 0.5: 0.6, 1.0: 0.45}
    record = shots()
    record = replace(record, runs=tuple(replace(run, travel_m=travels[run.bullet_mass_kg]) for run in record.runs))
    (stage,) = candidate_stages([GunObservables(record)])
    assert len(stage.record.configurations) > len(record.configurations)
    for run in stage.record.runs:
        nearest = min(travels, key=lambda mass: abs(mass - run.bullet_mass_kg))
        assert run.travel_m == travels[nearest]
