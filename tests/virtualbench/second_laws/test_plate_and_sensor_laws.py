"""The second laws of plate and sensors against limits and closed forms, and which laws there
are."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.validation.cases.plates import plate_of
from pyroshock.virtualbench.effects import CATALOGUE
from pyroshock.virtualbench.second_laws import LAWS, SPLITS, law_of
from pyroshock.virtualbench.second_laws import plate as plate_law
from pyroshock.virtualbench.second_laws import sensors as law
from pyroshock.virtualbench.second_laws.owners import bullet_share
from pyroshock.virtualbench.second_laws.plate import changed_modes

PLATE = plate_of("plate", 0)
MODES, SUPPORTS = PLATE.modes, PLATE.supports
RATE = 102_400.0
EFFECTS = sorted(
    effect for effect, split in LAWS if effect.startswith("plate.") and split == "sealed"
)


@pytest.mark.parametrize("split", SPLITS)
@pytest.mark.parametrize("effect", EFFECTS)
def test_plate_without_strength_is_its_table(effect: str, split: str) -> None:
    same = changed_modes(MODES, SUPPORTS, {effect: 0.0}, split)
    np.testing.assert_allclose(same.frequencies_hz, MODES.frequencies_hz)
    np.testing.assert_allclose(same.damping, MODES.damping)


def test_damping_thickness_and_supports_change_modes_as_they_say() -> None:
    added = (
        changed_modes(MODES, SUPPORTS, {"plate.damping": 5.0}, "development").damping
        - MODES.damping
    )
    middle = np.argsort(np.abs(MODES.frequencies_hz - np.median(MODES.frequencies_hz)))[:2]
    assert np.argmin(added) in middle
    np.testing.assert_allclose(added[middle], 0.5 * np.median(MODES.damping), rtol=0.02)
    added = changed_modes(MODES, SUPPORTS, {"plate.damping": 5.0}, "sealed").damping - MODES.damping
    square = np.sum(MODES.shapes**2, axis=0)
    np.testing.assert_allclose(added / added.sum(), square / square.sum())
    ratio = (
        changed_modes(MODES, SUPPORTS, {"plate.stiffness": 2.0}, "development").frequencies_hz
        / MODES.frequencies_hz
    )
    assert ratio[0] == pytest.approx(1.02, abs=1e-4)
    assert ratio[-1] == pytest.approx(1 + 0.02 * (1 - plate_law.SHEAR))
    ratio = (
        changed_modes(MODES, SUPPORTS, {"plate.stiffness": 2.0}, "sealed").frequencies_hz
        / MODES.frequencies_hz
    )
    np.testing.assert_allclose(ratio[::2], 1.02)
    np.testing.assert_allclose(ratio[1::2], 1 + 0.02 * plate_law.ACROSS)
    held = changed_modes(MODES, SUPPORTS, {"plate.boundary": 50.0}, "development")
    felt = np.sum(SUPPORTS**2, axis=0) / np.mean(np.sum(SUPPORTS**2, axis=0))
    np.testing.assert_allclose(held.frequencies_hz**2, MODES.frequencies_hz**2 + 2500 * felt)
    assert np.all(held.damping > MODES.damping)
    # The sum of the squares grows by that of the springs, whatever the coupling.
    held = changed_modes(MODES, SUPPORTS, {"plate.boundary": 50.0}, "sealed")
    grown = np.sum(held.frequencies_hz**2) - np.sum(MODES.frequencies_hz**2)
    assert grown == pytest.approx(2500 * MODES.frequencies_hz.size, rel=1e-6)


def test_calibration_plate_radiates_relaxes_and_lies_on_foam() -> None:
    f = MODES.frequencies_hz
    added = (
        changed_modes(MODES, SUPPORTS, {"plate.damping": 5.0}, "calibration").damping
        - MODES.damping
    )
    np.testing.assert_allclose(added, 0.5 * np.median(MODES.damping) * plate_law.radiated(f))
    # At coincidence it is largest; far above the efficiency is 1, and the loss falls as 1 / f; far
    # below it is linear.
    levels = plate_law.radiated(plate_law.COINCIDENCE_HZ * np.array([0.1, 1.0, 1.001, 50.0, 100.0]))
    np.testing.assert_allclose(levels[:3], [0.1, 1.0, 1.0], rtol=2e-3)
    np.testing.assert_allclose(levels[3:], 1 / (1.5 * np.array([50.0, 100.0])), rtol=0.02)
    ratio = (
        changed_modes(MODES, SUPPORTS, {"plate.stiffness": 2.0}, "calibration").frequencies_hz / f
    )
    np.testing.assert_allclose(
        ratio, 1 + 0.02 * (1 + plate_law.PER_DECADE * np.log10(f / np.median(f)))
    )
    held = changed_modes(MODES, SUPPORTS, {"plate.boundary": 50.0}, "calibration")
    np.testing.assert_allclose(
        held.frequencies_hz**2 - f**2, 2500 * (f / f[0]) ** plate_law.FOAM_ORDER
    )
    assert np.all(held.damping > MODES.damping)


def test_wide_block_weighs_by_its_mean_over_a_disc() -> None:
    """The mean of J0(k r) over a disc is 2 J1(k a) / (k a): by quadrature."""
    from scipy.special import j0

    mass, f = 1e-4, MODES.frequencies_hz
    lowered = changed_modes(
        MODES, SUPPORTS, {"plate.sensor_mass": mass}, "calibration"
    ).frequencies_hz
    r = (np.arange(4000) + 0.5) / 4000 * plate_law.BLOCK_RADIUS_M
    wavenumbers = np.sqrt(2 * np.pi * f / plate_law.BENDING_M2_S)
    means = (j0(wavenumbers[:, None] * r) * r).sum(axis=1) / r.sum()
    wanted = mass * means**2 * np.sum(MODES.shapes**2, axis=0)
    np.testing.assert_allclose((f / lowered) ** 2 - 1, wanted, rtol=1e-4)
    assert means[-1] ** 2 < 0.7


@pytest.mark.parametrize("split", SPLITS)
def test_small_mass_lowers_a_mode_by_its_square(split: str) -> None:
    """Rayleigh: df / f = - m phi^2 / 2, of one sensor or of both, for a low mode."""
    mass = 1e-4
    f = changed_modes(MODES, SUPPORTS, {"plate.sensor_mass": mass}, split).frequencies_hz
    share = np.array([1.0, plate_law.SECOND_SENSOR if split == "sealed" else 1.0])
    wanted = -mass / 2 * share @ MODES.shapes[:, :1] ** 2
    assert f[0] / MODES.frequencies_hz[0] - 1 == pytest.approx(float(wanted[0]), rel=0.1)


@pytest.mark.parametrize("split", SPLITS)
def test_sensors_without_strength_read_what_is_there_and_a_low_pass_keeps_the_impulse(
    split: str,
) -> None:
    pulse, ringing = np.hanning(200) * 5000, np.random.default_rng(1).standard_normal((2, 300))
    assert law.pressure_bar(1.3, {}, split) == 1.3
    np.testing.assert_allclose(
        law.velocity_factor(np.array([3.0]), np.array([0.2]), ["steel"], 0.0, split, hand=True), 1
    )
    np.testing.assert_array_equal(law.force_read(pulse, 1e-6, {}, split, 25e3), pulse)
    np.testing.assert_array_equal(law.accelerations_read(ringing, RATE, {}, split, 45e3), ringing)
    step, corner = 1e-6, 5e3
    low = {"sensor.force_bandwidth": 25e3 / corner}
    impulse = np.zeros(4000)
    impulse[10] = 1.0
    read = law.force_read(impulse, step, low, split, 25e3)
    assert read.sum() == pytest.approx(1.0, rel=1e-3)
    response = np.abs(np.exp(-2j * np.pi * corner * step * np.arange(read.size)) @ read)
    assert response == pytest.approx(np.sqrt(0.5), rel=0.02)


@pytest.mark.parametrize(
    ("name", "strength", "split", "bar", "expected", "within"),
    [
        ("sensor.pressure_offset", 0.1, "development", law.SPAN_BAR, law.SPAN_BAR, {}),
        (
            "sensor.pressure_offset",
            0.1,
            "development",
            0.5,
            0.5 - 0.1 * (1 - 0.5 / law.SPAN_BAR),
            {},
        ),
        (
            "sensor.pressure_offset",
            0.1,
            "sealed",
            8 * law.FOOT_BAR,
            8 * law.FOOT_BAR,
            {"abs": 1e-4},
        ),
        ("sensor.pressure_offset", 0.1, "calibration", 0.1, 0.0, {"abs": 3e-3}),
        ("sensor.pressure_offset", 0.1, "calibration", 2.5, 2.3, {}),
        ("sensor.pressure_gain", 0.02, "calibration", 4.0, 4 / 1.02, {}),
        ("sensor.pressure_gain", 0.02, "calibration", 2.0, 2 / 1.005, {}),
        ("sensor.pressure_gain", 0.02, "development", law.SPAN_BAR, law.SPAN_BAR / 1.02, {}),
        ("sensor.pressure_gain", 0.02, "development", 0.04, 0.04, {"rel": 3e-4}),
        ("sensor.pressure_gain", 0.02, "sealed", 3.0, 3 / 1.02, {"rel": 1e-4}),
        ("sensor.pressure_gain", 0.02, "sealed", 0.2, 0.2 / 1.004, {"rel": 1e-3}),
    ],
)
def test_pressure_errs_over_its_range_as_stated(
    name, strength, split, bar, expected, within
) -> None:
    """A zero error is gone at full scale, or above the foot, or twice as large at half of the
    shut-in gas; a gain error is the stated one in the upper range, or at its end."""
    assert law.pressure_bar(bar, {name: strength}, split) == pytest.approx(expected, **within)


def test_velocity_force_and_acceleration_err_as_they_say() -> None:
    v = np.array([5.0, 10.0])
    factor = law.velocity_factor(
        v, np.array([0.2, 0.2]), ["steel"] * 2, 0.03, "development", hand=False
    )
    assert (factor[1] - 1) / (factor[0] - 1) == pytest.approx(2.0)
    masses = np.array([0.1, 0.5])
    factor = law.velocity_factor(
        np.array([5.0, 5.0]), masses, ["steel"] * 2, 0.01, "sealed", hand=False
    )
    np.testing.assert_allclose(factor, [1 + 0.01 * bullet_share(m) for m in masses])
    read = law.force_read(
        np.array([0.0, law.FULL_FORCE_N]), 1e-6, {"sensor.force_gain": 0.02}, "development", 25e3
    )
    assert read[1] == pytest.approx(1.02 * law.FULL_FORCE_N)
    gain = {"sensor.force_gain": 0.05}
    factors = [
        law.force_read(np.array([0.0, top]), 1e-6, gain, "sealed", 25e3)[1] / top
        for top in (200.0, 8000.0)
    ]
    np.testing.assert_allclose(factors, [1 + 0.05 * law.LOW_RANGE, 1.05], rtol=1e-3)
    time = np.arange(10240) / RATE
    rows = np.stack([np.sin(2 * np.pi * f * time) for f in (1000.0, 10_000.0)])
    read = law.accelerations_read(
        rows, RATE, {"sensor.acceleration_gain": 0.05}, "development", 45e3
    )
    np.testing.assert_allclose(read.std(axis=1) / rows.std(axis=1), [1.0, 0.95], rtol=1e-3)
    rows = np.full((2, 10), law.FULL_ACCELERATION_M_S2)
    read = law.accelerations_read(rows, RATE, {"sensor.acceleration_gain": 0.1}, "sealed", 45e3)
    np.testing.assert_allclose(read[:, 0] / rows[:, 0], [1.1, 1 + 0.1 * law.SECOND_CHANNEL])


def test_mountings_have_their_transmissibility_or_two_resonances() -> None:
    resonance, damping, frequency = 9e3, law.SOFT_MOUNT_DAMPING, 6e3
    time = np.arange(20480) / RATE
    rows = np.sin(2 * np.pi * frequency * time)[None]
    read = law.accelerations_read(rows, RATE, {"sensor.mount_resonance": 5.0}, "development", 45e3)
    r = frequency / resonance
    wanted = np.sqrt((1 + (2 * damping * r) ** 2) / ((1 - r**2) ** 2 + (2 * damping * r) ** 2))
    assert read[0, 4000:].std() / rows[0, 4000:].std() == pytest.approx(wanted, rel=0.05)
    impulse = np.zeros((1, 8192))
    impulse[0, 1] = 1.0
    read = law.accelerations_read(impulse, RATE, {"sensor.mount_resonance": 5.0}, "sealed", 45e3)
    level = np.abs(np.fft.rfft(read[0]))
    spectrum_hz = np.fft.rfftfreq(8192, 1 / RATE)
    peaks = [
        spectrum_hz[1:-1][
            (level[1:-1] > level[:-2]) & (level[1:-1] > level[2:]) & (level[1:-1] > 1.2)
        ]
    ]
    assert np.abs(peaks[0] / 9e3 - 1).min() < 0.03
    assert np.abs(peaks[0] / (9e3 * law.BLOCK_RATIO) - 1).min() < 0.06


def test_zero_shift_begins_at_the_peak_and_swings_through_zero_behind_a_high_pass() -> None:
    rows = np.zeros((1, 5000))
    rows[0, 100] = 100.0
    for split in SPLITS:
        shift = law.accelerations_read(rows, RATE, {"sensor.zero_shift": 0.01}, split, 45e3) - rows
        assert np.all(shift[0, :100] == 0)
        assert shift[0, 100] == pytest.approx(1.0)
    rows = np.zeros((1, round(0.5 * RATE)))
    rows[0, 0] = 1.0
    shift = law.accelerations_read(rows, RATE, {"sensor.zero_shift": 0.01}, "sealed", 45e3) - rows
    assert shift[0].min() < 0
    assert shift[0].sum() == pytest.approx(0.0, abs=0.02 * np.abs(shift[0]).sum())


def test_calibration_sensors_err_with_duration_level_and_frequency_as_they_say() -> None:
    v = np.array([5.0, 10.0])
    factor = law.velocity_factor(
        v, np.array([0.2, 0.2]), ["steel"] * 2, 0.03, "calibration", hand=False
    )
    np.testing.assert_allclose((factor - 1) * v, 0.03 * law.DRAG_SHARE * law.FULL_SPEED_M_S["gun"])
    # Of two pulses of one peak, ten times as long: 0.6 of the stated share more.
    gain = {"sensor.force_gain": 0.05}
    pulses = [np.hanning(n) * 1000 for n in (401, 4001)]
    factors = [
        law.force_read(pulse, 1e-6, gain, "calibration", 25e3).max() / 1000 for pulse in pulses
    ]
    assert factors[1] - factors[0] == pytest.approx(0.05 * law.PER_DECADE, rel=1e-3)
    time = np.arange(20480) / RATE
    rows = np.stack([np.sin(2 * np.pi * f * time) for f in (100.0, law.RELAXATION_HZ, 20_000.0)])
    read = law.accelerations_read(
        rows, RATE, {"sensor.acceleration_gain": 0.1}, "calibration", 45e3
    )
    np.testing.assert_allclose(
        read.std(axis=1) / rows.std(axis=1), [1.1, abs(1 + 0.1 / (1 + 1j)), 1.0], rtol=7e-3
    )
    # The same resonance at a higher level is lower, and raises what it shows below it.
    rows = np.sin(2 * np.pi * 2000 * time) * np.array([[1.0], [1e5]])
    read = law.accelerations_read(rows, RATE, {"sensor.mount_resonance": 5.0}, "calibration", 45e3)
    shown = read[:, 4000:].std(axis=1) / rows[:, 4000:].std(axis=1)
    np.testing.assert_allclose(
        shown, 1 / (1 - (2 / (9 * np.array([1.0, 1 - law.JOINT_SOFTENING]))) ** 2), rtol=0.01
    )
    rows = np.zeros((1, round(0.5 * RATE)))
    rows[0, 0] = 1.0
    shift = (
        law.accelerations_read(rows, RATE, {"sensor.zero_shift": 0.01}, "calibration", 45e3) - rows
    )
    assert shift[0, round(3 * law.CREEP_S * RATE)] == pytest.approx(0.005, rel=1e-3)


def test_running_means_have_their_zeros() -> None:
    """(sin x / x)^3 with x = pi f T: nothing of a period that is as long as a mean."""
    impulse = np.zeros(4000)
    impulse[10] = 1.0
    read = law.force_read(impulse, 1e-6, {"sensor.force_bandwidth": 5.0}, "calibration", 25e3)
    for frequency, wanted in (
        (5e3 / law.MEAN_OVER_PERIOD, 0.0),
        (2.5e3 / law.MEAN_OVER_PERIOD, (2 / np.pi) ** 3),
    ):
        level = np.abs(np.exp(-2j * np.pi * frequency * 1e-6 * np.arange(read.size)) @ read)
        assert level == pytest.approx(wanted, abs=3e-3)


@pytest.mark.parametrize(
    "reading",
    [
        lambda: law.pressure_bar(1.0, {}, "tuning"),
        lambda: law.velocity_factor(np.ones(1), np.ones(1), ["steel"], 0.1, "tuning", hand=True),
        lambda: law.force_read(np.ones(3), 1e-6, {}, "tuning", 25e3),
        lambda: law.accelerations_read(np.ones((1, 3)), RATE, {}, "tuning", 45e3),
        lambda: changed_modes(MODES, SUPPORTS, {}, "tuning"),
    ],
)
def test_split_without_laws_is_told(reading) -> None:
    with pytest.raises(
        ValueError, match="'tuning': expected one of development, calibration, sealed"
    ):
        reading()


def test_every_effect_has_a_law_of_its_own_for_each_split() -> None:
    effects = {name for name in CATALOGUE if not name.startswith("bench.")}
    assert set(LAWS) == {(effect, split) for effect in effects for split in SPLITS}
    texts = [law.text for law in LAWS.values()]
    assert len(set(texts)) == len(texts)
    assert all(law.source for law in LAWS.values())
    with pytest.raises(ValueError, match=r"gun\.wear"):
        law_of("gun.wear", "sealed")
