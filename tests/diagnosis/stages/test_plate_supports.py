"""Supports at points that the plate's table does not know: the law of even springs, and what it leaves open."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.diagnosis.evidence import weighing
from pyroshock.diagnosis.evidence.scene import Scene
from pyroshock.diagnosis.evidence.surface import surfaces
from pyroshock.diagnosis.gap import GapTable
from pyroshock.diagnosis.stages.plate import PlateStage
from pyroshock.twin.effects import Effect, catalogue, effect
from pyroshock.twin.plate.modal import ModalPlate
from support.records.plate_records import plate, played

GAIN = effect("sensor.force_gain", gain=1.12)
CONTACTS = [(2e-4 + 4e-5 * i, 900.0 + 300 * i) for i in range(5)]


def on_supports(support_hz: float, seed: int) -> ModalPlate:
    """Ten modes on four springs, whose mean over modes is that of a foundation at `support_hz`."""
    free = plate()
    there = np.random.default_rng(seed).standard_normal((4, free.frequency_hz.size))
    there *= support_hz / np.sqrt(np.mean((there**2).sum(axis=0)))
    squares, turned = np.linalg.eigh(np.diag(free.frequency_hz**2) + there.T @ there)
    return replace(
        free,
        frequency_hz=np.sqrt(squares),
        shape_impact=free.shape_impact @ turned,
        shapes=free.shapes @ turned,
    )


def stage(bench: ModalPlate, seed: int = 1, *effects: Effect) -> PlateStage:
    """What a plate shows that is compared with the free one's table."""
    record = played(effects, bench=bench, contacts=CONTACTS, repetitions=3, noise=3e-4, seed=seed)
    return PlateStage(replace(record, plate=plate()))


@pytest.mark.parametrize("seed", [1, *(pytest.param(more, marks=pytest.mark.slow) for more in (2, 3))])
def test_supports_somewhere_are_found(seed: int) -> None:
    """Modes turn into each other, and rise more or less than on even springs: still no unknown cause."""
    one = stage(on_supports(110.0, seed))
    found = weighing.weigh(
        Scene.of(GapTable.of(one.record, (one,)), surfaces((one,), list(catalogue().values()))), stages=(one,)
    )
    assert next(iter(found.probability)) == "plate.boundary"


@pytest.mark.parametrize("seed", [pytest.param(1, marks=pytest.mark.slow), 2])
def test_a_gain_is_found_beside_supports_somewhere(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A pair has what the laws of its members leave open, as each has alone. Without, supports alone are likelier."""
    one = stage(on_supports(110.0, seed), seed, GAIN)
    kinds = [catalogue()[name] for name in ("plate.boundary", "sensor.force_gain", "plate.stiffness", "plate.damping")]
    scene = Scene.of(GapTable.of(one.record, (one,)), surfaces((one,), kinds))
    assert first(scene, one) == "plate.boundary+sensor.force_gain"
    monkeypatch.setattr(weighing, "left_open", lambda scene, *_, **__: [np.zeros((len(scene.cells.z), 0))])
    assert first(scene, one) == "plate.boundary"


def first(scene: Scene, one: PlateStage) -> str:
    return next(iter(weighing.weigh(scene, stages=(one,)).probability))


def test_what_is_left_open_is_that_of_low_modes() -> None:
    one = stage(plate())
    nothing = np.zeros((5, len(one.observables)))
    every = one.loose([effect("plate.boundary", support_frequency_hz=100.0)], nothing)
    assert every is not None and every.shape == nothing.shape
    assert np.ptp(every, axis=0).max() == 0  # the same in all configurations
    held = every[0]
    names = [each.name for each in one.observables]
    rises = [held[i] for i, name in enumerate(names) if "ln frequency" in name]
    assert rises[0] > 0.02 and all(np.diff(rises) < 0)
    assert all(held[i] == 0 for i, name in enumerate(names) if "damping" in name or "delay" in name or "rest" in name)
    assert all(held[i] > 0 for i, name in enumerate(names) if "spectrum" in name or "ln amplitude" in name)


def test_other_laws_are_definite() -> None:
    one = stage(plate())
    nothing = np.zeros((5, len(one.observables)))
    assert one.loose([], nothing) is None
    for name in ("plate.damping", "plate.stiffness", "plate.sensor_mass", "sensor.force_gain"):
        assert one.loose([effect(name)], nothing) is None


@pytest.mark.parametrize("seed", [pytest.param(4, marks=pytest.mark.slow), 5])
def test_free_plate_is_not_held(seed: int) -> None:
    one = stage(plate(), seed)
    found = weighing.weigh(
        Scene.of(GapTable.of(one.record, (one,)), surfaces((one,), list(catalogue().values()))), stages=(one,)
    )
    assert next(iter(found.probability)) == "none"
