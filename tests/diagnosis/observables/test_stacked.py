"""Sets of effects as one set with arrays, and parameters by configuration as parameters by run."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.diagnosis.observables.base import at_rows, batched_changes, stacked
from pyroshock.diagnosis.observables.gun.stage import GunObservables
from pyroshock.twin.effects import effect
from support.records.gun_campaigns import gun_record

ROWS = np.array([2, 0, 0, 1])


def test_value_of_a_configuration_is_that_of_its_runs():
    own = at_rows([effect("gun.dead_volume", volume_m3=np.array([1e-4, 2e-4, 3e-4]))], ROWS)
    assert own[0].as_json()["volume_m3"] == [3e-4, 1e-4, 1e-4, 2e-4]
    effects = (effect("gun.dead_volume", volume_m3=1e-4), effect("sensor.velocity_gain", gain=1.1))
    assert at_rows(effects, ROWS) == effects
    valve = effect("gun.valve_flow", loss_coefficient=np.array([1.0, 2.0, 3.0]), opening_time_s=0.01)
    own = at_rows([valve], ROWS)[0].as_json()
    assert own["loss_coefficient"] == [3.0, 1.0, 1.0, 2.0]
    assert own["opening_time_s"] == 0.01
    assert at_rows([], ROWS) == ()
    own = stacked([[effect("sensor.velocity_gain", gain=g)] for g in (1.1, np.array([1.2, 1.3]))], 2)
    assert own[0].as_json()["gain"] == pytest.approx([1.1, 1.1, 1.2, 1.3])


def test_simulated_runs_have_their_configuration_s_value():
    """Run by run as if the whole campaign had the value of the run's configuration."""
    record = gun_record(pressures_pa=(0.5e5, 2e5), scatter=0.0)
    stage, gains = GunObservables(record), np.array([0.9, 1.0, 1.1, 1.2])
    together = stage.simulated(at_rows([effect("sensor.velocity_gain", gain=gains)], record.configuration_of))
    alone = np.array([stage.simulated([effect("sensor.velocity_gain", gain=float(gain))])[:, 0] for gain in gains])
    np.testing.assert_allclose(together[:, 0], alone[record.configuration_of, np.arange(len(record.runs))])


def test_sets_of_the_same_kinds_are_observed_together():
    """Of one case each: the effects' numbers are what is observed."""
    calls = []

    def observed(effects, count):
        calls.append(([effect.id for effect in effects], count))
        values = [np.asarray(value) for effect in effects for value in vars(effect).values()]
        return sum(values, np.zeros(count))[:, None]

    loss, gain = effect("gun.dead_volume", volume_m3=2e-3), effect("sensor.velocity_gain", gain=1.1)
    sets = [[loss], [], [gain, loss], [effect("gun.dead_volume", volume_m3=1e-3)], [loss, gain]]
    assert batched_changes(sets, observed)[:, 0, 0] == pytest.approx([0.002, 0.0, 1.102, 0.001, 1.102])
    assert calls == [
        ([], 1),
        (["gun.dead_volume"], 2),
        (["gun.dead_volume", "sensor.velocity_gain"], 2),
    ]
