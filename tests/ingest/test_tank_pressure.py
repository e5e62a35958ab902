"""The tank's pressure from records whose level, noise and drop are known exactly."""

from __future__ import annotations

import re
import statistics

import numpy as np
import pytest
from pyroshock.ingest.segmentation import rest_level
from pyroshock.ingest.velocity import NoDropError, tank_pressure_before

LEVEL_PA = 40_000.0
#: Samples in a median by which the drop is found.
BLOCK = 16


def step(at: int, samples: int, *, fall: float = LEVEL_PA) -> np.ndarray:
    """A level that falls at once at a sample."""
    return np.where(np.arange(samples) < at, LEVEL_PA, LEVEL_PA - fall)


def flicker(samples: int) -> np.ndarray:
    """As often up as down: median 0, median deviation 1; that of the differences is 2, whatever one of them is."""
    return np.resize([1.0, -1.0, 1.0, 1.0, -1.0, -1.0, 1.0, -1.0], samples)


@pytest.mark.parametrize("at", range(600, 617))
def test_mean_ends_before_a_sudden_drop_by_two_blocks_at_most(at: int) -> None:
    result = tank_pressure_before(step(at, 1600), guard=0)
    assert at - 2 * BLOCK <= result.stop <= at
    assert result.pressure_pa == LEVEL_PA
    assert result.pressure_u_pa == 0


def test_guard_and_longest_stretch_are_kept_before_the_drop() -> None:
    record = step(800, 1600)
    drop = tank_pressure_before(record, guard=0).stop
    assert tank_pressure_before(record).stop == drop - BLOCK
    assert tank_pressure_before(record, guard=100).stop == drop - 100
    record = step(12_000, 15_000)
    taken = tank_pressure_before(record)
    assert taken.stop - taken.first == 10_000
    short = tank_pressure_before(record, longest_stretch=700)
    assert short.stop - short.first == 700
    assert short.stop == taken.stop
    record = step(800, 1600)
    assert tank_pressure_before(record, longest_stretch=16).pressure_pa == LEVEL_PA
    with pytest.raises(NoDropError, match=r"^15 samples before the drop: expected at least 16$"):
        tank_pressure_before(record, longest_stretch=15)


def test_four_blocks_are_enough_and_fewer_refused() -> None:
    result = tank_pressure_before(step(48, 64))
    assert (result.first, result.stop, result.pressure_pa) == (0, 16, LEVEL_PA)
    for samples in (0, 5, 63):
        with pytest.raises(NoDropError, match=f"^{samples} samples of pressure: expected at least 64$"):
            tank_pressure_before(step(32, samples))


@pytest.mark.parametrize(("guard", "left"), [(17, 15), (32, 0), (40, 0)])
def test_fewer_than_two_samples_for_each_piece_are_refused(guard: int, left: int) -> None:
    with pytest.raises(NoDropError, match=f"^{left} samples before the drop: expected at least 16$"):
        tank_pressure_before(step(48, 64), guard=guard)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_first_sample_that_is_not_finite_is_named(bad: float) -> None:
    record = step(800, 1600)
    record[[123, 1000]] = bad
    with pytest.raises(ValueError, match="sample 123 is not finite"):
        tank_pressure_before(record)


# --- how large a drop has to be --------------------------------------------------------------------------------------

#: A robust deviation is 1.4826 times the median one; a block of 16 has a quarter of the noise of a difference.
NOISE_PA = 1.4826 * 2 / 4


@pytest.mark.parametrize("margin", [8.2, 20.0])
def test_drop_beyond_eight_deviations_of_a_block_is_a_shot(margin: float) -> None:
    # Five blocks to the fall: the last before it lies four fifths of the fall above the chord.
    record = step(80, 320, fall=margin * NOISE_PA / 0.8) + flicker(320)
    result = tank_pressure_before(record)
    assert result.pressure_pa == pytest.approx(LEVEL_PA, abs=1e-9)


@pytest.mark.parametrize("margin", [0.5, 7.8])
def test_drop_within_eight_deviations_of_a_block_is_refused_with_its_numbers(margin: float) -> None:
    fall = margin * NOISE_PA / 0.8
    message = (
        f"no drop: pressure falls by {fall:.3g} Pa, by {0.8 * fall:.3g} Pa at once, with noise of {NOISE_PA:.3g} Pa; "
        "a shot is expected to exceed 8 times the noise, after 16 samples of rest"
    )
    with pytest.raises(NoDropError, match=f"^{re.escape(message)}$"):
        tank_pressure_before(step(80, 320, fall=fall) + flicker(320))


def test_still_pressure_and_an_even_leak_are_no_shot() -> None:
    with pytest.raises(NoDropError, match="no drop: pressure falls by 0 Pa, by 0 Pa at once, with noise of 0 Pa"):
        tank_pressure_before(np.full(1600, LEVEL_PA))
    with pytest.raises(NoDropError, match="no drop: pressure falls by 992 Pa, by 0 Pa at once"):
        tank_pressure_before(LEVEL_PA - np.arange(1024.0))


# --- where the drop is -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("slope", [0.0, 1 / 2, 4.0])
def test_leak_before_the_shot_does_not_move_the_drop(slope: float) -> None:
    sample = np.arange(3200)
    drop = tank_pressure_before(step(1600, 3200) - slope * np.minimum(sample, 1600), guard=0).stop
    assert 1600 - 2 * BLOCK <= drop <= 1600


def test_first_fall_is_the_drop_a_quarter_of_the_way_before_the_knee_in_spite_of_a_spike() -> None:
    """Half the pressure at once, and the rest at once after a long wait."""
    record = step(800, 3200, fall=LEVEL_PA / 2)
    record[1600:] = 0
    assert 800 - 2 * BLOCK <= tank_pressure_before(record, guard=0).stop <= 800
    # An even fall over 48 blocks from the middle of block 30: half of it is reached in block 55.
    sample = np.arange(1920)
    record = LEVEL_PA * (1 - np.clip((sample - 30 * BLOCK - 8) / (48 * BLOCK), 0, 1))
    assert tank_pressure_before(record, guard=0).stop == (30 - 25 // 4) * BLOCK
    record = step(320, 640)
    record[:BLOCK] = 5 * LEVEL_PA
    assert 320 - 2 * BLOCK <= tank_pressure_before(record, guard=0, longest_stretch=200).stop <= 320


# --- the mean and its uncertainty ------------------------------------------------------------------------------------


def test_uncertainty_is_that_of_the_mean_of_eight_pieces() -> None:
    pieces = [3.0, -1.0, 4.0, 1.0, -5.0, 9.0, -2.0, 6.0]
    record = step(192, 400)
    record[:160] += np.repeat(pieces, 20)
    result = tank_pressure_before(record)
    assert (result.first, result.stop) == (0, 160)
    assert result.pressure_pa == pytest.approx(LEVEL_PA + statistics.mean(pieces), rel=1e-12)
    assert result.pressure_u_pa == pytest.approx(statistics.stdev(pieces) / 8**0.5, rel=1e-9)


@pytest.mark.parametrize(("deviations", "kept"), [(0.9, True), (5.8, True), (6.0, True), (6.1, False), (50.0, False)])
@pytest.mark.parametrize("sign", [1, -1])
def test_values_beyond_six_robust_deviations_are_left_out(deviations: float, kept: bool, sign: int) -> None:
    record = step(192, 400) - LEVEL_PA  # about zero, where six deviations are six deviations to the last digit
    record[:160] += flicker(160)
    at = 40 + int(np.argmax(record[40:160] == sign))  # in the place of one alike: the median deviation stays 1
    record[at] = sign * deviations * rest_level(record[:160]).noise
    result = tank_pressure_before(record)
    assert (result.first, result.stop) == (0, 160)
    total = -sign + (record[at] if kept else 0.0)
    assert result.pressure_pa == pytest.approx(total / (160 if kept else 159), rel=1e-9)


def test_piece_beyond_six_deviations_is_left_out_whole_and_coarse_steps_count() -> None:
    steps = [3.0, -1.0, 4.0, 1.0, -5.0, 2.0, -2.0]
    record = step(192, 400)
    record[:160] += np.repeat([*steps[:3], 500.0, *steps[3:]], 20)
    result = tank_pressure_before(record)
    assert result.pressure_pa == pytest.approx(LEVEL_PA + statistics.mean(steps), rel=1e-12)
    assert result.pressure_u_pa == pytest.approx(statistics.stdev(steps) / 7**0.5, rel=1e-9)
    # Most samples at one step of the converter: the robust deviation is zero, and says nothing about the others.
    record = step(192, 400)
    record[:160] += 8 * (np.arange(160) % 4 == 0)
    assert tank_pressure_before(record).pressure_pa == pytest.approx(LEVEL_PA + 2, rel=1e-12)


@pytest.mark.parametrize("hum_samples", [53.0, 200.0])
def test_uncertainty_covers_hum(hum_samples: float) -> None:
    """Whatever its phase: neighbouring samples of hum are alike, and do not count as independent ones."""
    rng = np.random.default_rng(3)
    results = []
    for phase in rng.uniform(0, 2 * np.pi, 40):
        hum = 300 * np.sin(2 * np.pi * np.arange(2400) / hum_samples + phase)
        results.append(tank_pressure_before(step(1216, 2400) + hum))
    errors = np.array([result.pressure_pa - LEVEL_PA for result in results])
    assert np.abs(errors).max() < 2 * max(result.pressure_u_pa for result in results)


def test_uncertainty_of_a_wander_is_its_scatter() -> None:
    """Neighbours alike over a hundred samples: as if independent, the mean would look ten times better than it is."""
    rng = np.random.default_rng(4)
    results, white = [], []
    for _ in range(60):
        wander = 100 * np.repeat(rng.standard_normal(80), 100)
        record = step(6432, 8000) + wander
        results.append(tank_pressure_before(record))
        white.append(wander[:6400].std() / 80)
    scatter = np.std([result.pressure_pa for result in results])
    claimed = np.sqrt(np.mean([result.pressure_u_pa**2 for result in results]))
    assert claimed == pytest.approx(scatter, rel=0.3)
    assert scatter > 5 * np.mean(white)


# --- an exponential drop in noise -------------------------------------------------------------------------------------


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20)


def tank(rng: np.random.Generator, *, noise: float = 200.0, drop: int = 6000, samples: int = 15_000) -> np.ndarray:
    x = np.arange(samples) - drop
    return 40_420 * np.exp(-np.clip(x, 0, None) / 400) + noise * rng.standard_normal(samples)


def test_pressure_is_the_mean_before_the_drop_and_its_uncertainty_the_scatter(rng: np.random.Generator) -> None:
    result = tank_pressure_before(tank(rng))
    assert result.pressure_pa == pytest.approx(40_420, abs=5 * result.pressure_u_pa)
    assert 5850 < result.stop <= 6000
    results = [tank_pressure_before(tank(rng)) for _ in range(60)]
    scatter = np.std([r.pressure_pa for r in results])
    assert np.mean([r.pressure_u_pa for r in results]) == pytest.approx(scatter, rel=0.35)
    with pytest.raises(NoDropError, match="16"):
        tank_pressure_before(tank(rng, drop=10, samples=4000))


@pytest.mark.parametrize(("drop", "slowness"), [(600, 3000), (1000, 6000), (5000, 10_000)])
def test_slow_valve_takes_pieces_of_the_rest(rng: np.random.Generator, drop: int, slowness: int) -> None:
    """The drop is found late, and whole pieces before it have left their level: NaN once came out of them."""
    since = np.clip(np.arange(30_000) - drop, 0, None) / slowness
    result = tank_pressure_before(4e5 * np.exp(-(since**3)) + 50 * rng.standard_normal(30_000))
    assert result.pressure_pa == pytest.approx(4e5, rel=2e-3)
    assert 0 < result.pressure_u_pa < 800
