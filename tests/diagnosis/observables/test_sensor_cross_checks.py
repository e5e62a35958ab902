"""What a sensor does to several stages or channels at once is compared such that the physics of one
stage cannot imitate it: impulse against the plate's momentum, and accelerometers against each
other."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from pyroshock.array_types import Floats
from pyroshock.diagnosis.observables.plate.stage import PlateObservables
from pyroshock.twin.effects import Effect, effect
from scipy.optimize import nnls
from support.records.plate_records import played

#: What the plate itself may do, each small and large, and to either side where it has two.
PHYSICS = [
    *(effect("plate.damping", factor=factor) for factor in (0.5, 0.9, 1.1, 2.0)),
    *(effect("plate.stiffness", frequency_factor=factor) for factor in (0.94, 0.99, 1.01, 1.08)),
    *(effect("plate.sensor_mass", mass_kg=mass_kg) for mass_kg in (0.02, 0.15)),
    *(
        effect("plate.boundary", support_frequency_hz=frequency_hz)
        for frequency_hz in (30.0, 110.0)
    ),
]
FORCE_GAIN = effect("sensor.force_gain", gain=1.2)
ACCELERATION_GAIN = effect("sensor.acceleration_gain", gain=1 / 1.2)


@cache
def stage() -> PlateObservables:
    return PlateObservables(played(noise=0.003))


def change(acting: Effect) -> Floats:
    """(N,): what an effect does to all cells, in tolerances."""
    tolerance = np.array([item.tolerance for item in stage().observables])
    return np.nan_to_num(stage().changes([[acting]])[0] / tolerance).ravel()


def rest_share(acting: Effect, imitating: list[Effect]) -> float:
    """Share of the rms of an effect's change that is left by the best sum of others, each times a
    positive scale."""
    wanted = change(acting)
    table = np.column_stack([change(other) for other in imitating])
    return float(nnls(table, wanted)[1] / np.linalg.norm(wanted))


@pytest.mark.parametrize("acting", [FORCE_GAIN, ACCELERATION_GAIN], ids=lambda acting: acting.id)
def test_plate_cannot_imitate_a_gain_because_its_momentum_is_compared_with_the_impulse(
    acting: Effect,
) -> None:
    assert rest_share(acting, PHYSICS) > 0.5


def test_gain_of_one_accelerometer_is_told_by_the_others_even_from_a_gain_of_the_force() -> None:
    channels = stage().signals.channels
    assert len(channels) > 1
    of_first = effect(
        "sensor.acceleration_gain", gain=np.where(np.arange(len(channels)) == 0, 1 / 1.2, 1.0)
    )
    assert rest_share(of_first, [*PHYSICS, FORCE_GAIN]) > 0.5


def test_the_plate_alone_knows_only_the_ratio_of_both_gains() -> None:
    """Only what else is known of one of them (the contact, a certificate) settles which is off."""
    assert rest_share(ACCELERATION_GAIN, [FORCE_GAIN]) < 0.05
