"""Settings that one more shot could have."""

from __future__ import annotations

from dataclasses import replace

from pyroshock.diagnosis.candidates import candidates
from pyroshock.diagnosis.observables.gun.stage import GunStage
from support.records.gun_shots import shots


def test_a_proposed_shot_has_the_travel_of_the_nearest_projectile() -> None:
    travels = {0.25: 0.885, 0.5: 0.6, 1.0: 0.45}
    record = shots()
    record = replace(record, runs=tuple(replace(run, travel_m=travels[run.bullet_mass_kg]) for run in record.runs))
    found = candidates([GunStage(record)])
    assert found is not None
    for run in found.record.runs:
        nearest = min(travels, key=lambda mass: abs(mass - run.bullet_mass_kg))
        assert run.travel_m == travels[nearest]
