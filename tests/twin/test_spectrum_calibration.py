"""What measured shots teach of spectra and peaks: planted errors come back, bands hold what was not
learned from."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np
import pytest
from pyroshock.twin.chain import Twin
from pyroshock.twin.contact_interface import ForcePulses, ImpactBatch
from pyroshock.twin.discrepancy.kernels import Coordinates
from pyroshock.twin.discrepancy.shot_correction import Discrepancy
from pyroshock.twin.measured_shots import MeasuredShots
from pyroshock.twin.plate.stage import PlateStage
from pyroshock.twin.setting import THESIS
from pyroshock.twin.spectrum_calibration import TERMS, SpectrumCalibration, stretched
from pyroshock.twin.srs.ringing_window import ringing_spectra
from support.records.twin_parts import HalfSine, ringing_plate, setting

LINES = 100 * 2.0 ** (np.arange(12) / 2)
SENSORS = ("a1", "a2")
STATED_DB = float(np.sqrt(sum(term.sd_db**2 for term in TERMS)))


def settings_of(count: int, seed: int = 0):
    """Different configurations, at velocities of impact."""
    tips, anvils = (
        (THESIS["steel"], THESIS["PLA"], THESIS["aluminum"]),
        (None, THESIS["steel"], THESIS["aluminum"]),
    )
    grid = list(itertools.product(tips, anvils, ("#1", "#2"), (3.0, 8.0, 15.0), (0.2, 0.5, 1.0)))
    picked = np.random.default_rng(seed).permutation(len(grid))[:count]
    return [
        setting(tip=grid[i][0], anvil=grid[i][1], impact_position=grid[i][2],
        impact_velocity_m_s=grid[i][3],
                impactor_mass_kg=grid[i][4])
        for i in picked
    ]  # fmt: skip


def measured(settings, levels_db, configuration) -> MeasuredShots:
    """Shots that show `levels_db` (n, sensors, 1 + lines), peaks first."""
    values, n = 10 ** (levels_db / 20), len(settings)
    nothing = np.full(n, np.nan)
    return MeasuredShots(
        settings=tuple(settings),
        configuration=np.asarray(configuration, dtype=np.intp),
        impact_velocity_m_s=np.array([s.impact_velocity_m_s for s in settings]),
        impact_velocity_u_m_s=nothing,
        contact_time_s=nothing,
        peak_force_n=nothing,
        impulse_n_s=nothing,
        sensors=SENSORS,
        peak_acceleration_m_s2=values[..., 0],
        frequency_hz=LINES,
        q=10.0,
        spectra_m_s2=values[..., 1:],
    )


def db(factors):
    return 20 * np.log10(factors)


def planted_db(settings, rng, shrink=1.0):
    """Errors of a bench drawn from the prior, (n, sensors, 1 + lines), one of them for each
    sensor."""
    lines = np.append(LINES, 4 * LINES[-1])
    terms = tuple(replace(term, sd_db=shrink * term.sd_db) for term in TERMS)
    joint = Discrepancy(lines, terms)
    at = Coordinates.of(settings)
    alike = np.array([term.of_settings(at, at) for term in terms])
    roots = np.linalg.cholesky(
        np.tensordot(joint.variances.T, alike, axes=1) + 1e-9 * np.eye(len(settings))
    )
    parts = [
        np.einsum("fnm,fm->nf", roots, rng.standard_normal((lines.size, len(settings))))
        @ joint.patterns.T
        for _ in SENSORS
    ]
    return np.roll(np.stack(parts, axis=1), 1, axis=-1)


def test_without_shots_nothing_is_corrected_and_the_spread_is_the_stated_one():
    calibration = SpectrumCalibration.untaught(SENSORS, LINES)
    z = np.random.default_rng(0).standard_normal((4_000, calibration.normals))
    (new,) = settings_of(1)
    assert calibration.shots == 0
    assert np.all(calibration.factors([new], SENSORS) == 1.0)
    drawn = db(calibration.factors([new], SENSORS, z))
    assert drawn.shape == (4_000, 1, 2, LINES.size + 1)
    assert drawn.std(axis=0) == pytest.approx(np.full((1, 2, LINES.size + 1), STATED_DB), rel=0.1)


def test_what_all_shots_show_is_corrected_for_each_sensor_and_the_peak():
    settings = settings_of(24)
    wrong = np.zeros((24, 2, LINES.size + 1))
    wrong[:, 0, 1:], wrong[:, 1, 1:], wrong[:, 1, 0] = 4.0, -3.0, 6.0
    predicted = np.full_like(wrong, 40.0)
    calibration = SpectrumCalibration.of(
        measured(settings, predicted + wrong, np.arange(24)), predicted
    )
    unseen = settings_of(40)[24:]
    corrections = db(calibration.factors(unseen, SENSORS)).mean(axis=0)
    assert calibration.shots == 24
    assert corrections[0, 1:] == pytest.approx(np.full(LINES.size, 4.0), abs=0.3)
    assert corrections[0, 0] == pytest.approx(0.0, abs=0.3)
    assert corrections[1, 0] == pytest.approx(6.0, abs=0.5)
    assert np.array_equal(
        calibration.factors(unseen, ("a2",))[:, 0], calibration.factors(unseen, SENSORS)[:, 1]
    )


@pytest.mark.parametrize("shrink", [0.2, 1.0, 2.0])
def test_bands_hold_nine_tenths_of_what_was_not_learned_from(shrink):
    """Benches whose errors are smaller and larger than stated, 24 configurations of 2 shots, 24
    others."""
    inside = []
    for seed in range(4):
        settings = settings_of(48, seed)
        errors = planted_db(
            [s for s in settings for _ in range(2)], np.random.default_rng(seed), shrink
        )
        repeats = [s for s in settings for _ in range(2)]
        shots = measured(repeats, errors, np.repeat(np.arange(48), 2)).take(np.arange(48))
        calibration = SpectrumCalibration.of(shots, np.zeros((48, 2, LINES.size + 1)))
        z = np.random.default_rng(99).standard_normal((400, calibration.normals))
        low, high = np.quantile(
            db(calibration.factors(repeats[48:], SENSORS, z)), (0.05, 0.95), axis=0
        )
        inside.append(np.mean((low <= errors[48:]) & (errors[48:] <= high)))
    assert 0.85 <= np.mean(inside) <= 0.97


def test_more_shots_narrow_the_bands():
    settings = settings_of(40)
    errors = planted_db(settings, np.random.default_rng(3), 0.3)
    widths = []
    for count in (0, 6, 30):
        shots = measured(settings, errors, np.arange(40)).take(np.arange(count))
        calibration = SpectrumCalibration.of(shots, np.zeros((count, 2, LINES.size + 1)))
        z = np.random.default_rng(0).standard_normal((500, calibration.normals))
        widths.append(db(calibration.factors(settings[30:], SENSORS, z)).std(axis=0).mean())
    assert widths[2] < 0.6 * widths[0]
    assert widths[2] < widths[1] < widths[0] * 1.05


def test_what_a_sensor_did_not_record_teaches_it_nothing_and_unknown_sensors_are_refused():
    settings = settings_of(8)
    levels = np.full((8, 2, LINES.size + 1), 3.0)
    levels[:, 0] = np.nan
    calibration = SpectrumCalibration.of(
        measured(settings, levels, np.arange(8)), np.zeros_like(levels)
    )
    corrections = db(calibration.factors(settings, SENSORS))
    assert np.all(corrections[:, 0] == 0)
    assert np.all(corrections[:, 1] > 1.0)
    settings = settings_of(2)
    shots = measured(settings, np.zeros((2, 2, LINES.size + 1)), [0, 1])
    with pytest.raises(ValueError, match="predicted_db has shape"):
        SpectrumCalibration.of(shots, np.zeros((2, 2, LINES.size)))
    with pytest.raises(LookupError, match="no sensor 'b' is calibrated; there are: a1, a2"):
        SpectrumCalibration.untaught(SENSORS, LINES).factors(settings, ("b",))


def test_pulses_get_the_measured_peak_and_impulse():
    pulses = HalfSine().pulses(ImpactBatch([setting(), setting()], np.array([4.0, 8.0])))
    measured_pulses = stretched(pulses, pulses, np.array([12e3, np.nan]), np.array([3.0, 3.0]))
    assert measured_pulses.peak_force_n[0] == pytest.approx(12e3, rel=1e-12)
    assert measured_pulses.impulse_n_s[0] == pytest.approx(3.0, rel=1e-12)
    assert measured_pulses.compression_time_s[0] == pytest.approx(
        measured_pulses.contact_time_s[0] / 2
    )
    for name in ("force_n", "contact_time_s"):
        assert np.array_equal(getattr(measured_pulses, name)[1], getattr(pulses, name)[1])


def twin(**own) -> Twin:
    return Twin(contact=HalfSine(), plate=PlateStage({"aluminum": ringing_plate()}), samples=4_000,
                frequency_hz=LINES, **own)  # fmt: skip


def shown_by(model: Twin, settings, louder: float = 1.0) -> MeasuredShots:
    """What a bench that is the nominal twin, but louder, would have shown, with other pulses than
    the law has."""
    velocity = np.array([s.impact_velocity_m_s for s in settings])
    law = model.contact.pulses(ImpactBatch(settings, velocity))
    pulses = ForcePulses(1.3 * law.contact_time_s, 0.7 * law.force_n, law.compression_time_s)
    records = louder * model.accelerations(settings, pulses)
    spectra = ringing_spectra(
        records, model.sampling_rate_hz, LINES, 10.0, float(pulses.contact_time_s.max())
    )
    levels = 20 * np.log10(
        np.concatenate([np.abs(records).max(axis=-1)[..., None], spectra], axis=-1)
    )
    shots = measured(settings, levels, np.arange(len(settings)))
    return replace(shots, peak_force_n=pulses.peak_force_n, impulse_n_s=pulses.impulse_n_s)


def test_shots_are_replayed_with_their_own_forces_and_places():
    """The shape of the law, stretched to the force that was measured, is the pulse that was
    played."""
    places = [(v, p) for v in (4.0, 9.0) for p in ("#1", "#2")]
    shots = shown_by(
        model := twin(), [setting(impact_velocity_m_s=v, impact_position=p) for v, p in places]
    )
    levels = 10 ** (model.replayed_db(shots) / 20)
    assert levels[..., 0] == pytest.approx(shots.peak_acceleration_m_s2, rel=1e-9)
    assert levels[..., 1:] == pytest.approx(shots.spectra_m_s2, rel=1e-9)
    settings = [setting(), setting(), setting(plate=THESIS["steel"]), setting(impact_position="#9")]
    shots = measured(settings, np.zeros((4, 2, LINES.size + 1)), np.arange(4))
    forced = replace(
        shots, peak_force_n=np.array([1e4, np.nan, 1e4, 1e4]), impulse_n_s=np.full(4, 4.0)
    )
    assert np.isfinite(twin().replayed_db(forced)).all(axis=(1, 2)).tolist() == [
        True,
        False,
        False,
        False,
    ]
    assert np.isfinite(twin().replayed_db(shots)).all(axis=(1, 2)).tolist() == [
        True,
        True,
        False,
        False,
    ]


def test_a_calibrated_twin_is_as_loud_as_its_bench():
    bare, settings = twin(), [setting(impact_velocity_m_s=v) for v in np.linspace(3, 12, 10)]
    shots = shown_by(bare, settings, louder=1.5)
    model = replace(bare, calibration=SpectrumCalibration.of(shots, bare.replayed_db(shots)))
    new = setting(impact_velocity_m_s=7.3)
    assert model.spectra([new]) == pytest.approx(1.5 * bare.spectra([new]), rel=0.02)
    shot, nominal = model.predict(new, draws=0), bare.predict(new, draws=0)
    louder = shot.peak_acceleration_m_s2("a2").mean / nominal.peak_acceleration_m_s2("a2").mean
    assert louder == pytest.approx(1.5, rel=0.02)
    assert shot.force_n.mean == pytest.approx(nominal.force_n.mean)


def test_bands_of_a_prediction_are_those_of_its_draws():
    model = twin(calibration=SpectrumCalibration.untaught(SENSORS, LINES))
    model = replace(model, contact=HalfSine(scatter=0.0))
    band = model.predict(setting(), draws=400, rng=np.random.default_rng(0)).spectra_m_s2["a1"]
    drawn = model.draws(
        [setting(), setting(impact_velocity_m_s=4.0)], 400, np.random.default_rng(0), "a1"
    )
    width = db(band.upper / band.lower)
    assert width == pytest.approx(np.full(LINES.size, 2 * 1.645 * STATED_DB), rel=0.15)
    assert db(
        np.quantile(drawn[:, 0], 0.95, axis=0) / np.quantile(drawn[:, 0], 0.05, axis=0)
    ) == pytest.approx(width, rel=0.1)
    apart = np.log(drawn[:, 0] / drawn[:, 1])
    assert apart.std(axis=0).max() < 1e-9  # settings of one draw have the same luck


@dataclass(frozen=True)
class OnAnvil(HalfSine):
    """Half of the tip's force reaches the plate, for twice the time."""

    def plate_pulses(self, strikes, z, pulses):
        del strikes, z
        return ForcePulses(
            2 * pulses.contact_time_s, 0.5 * pulses.force_n, 2 * pulses.compression_time_s
        )


def test_the_plate_feels_what_passes_the_anvil_and_the_prediction_shows_the_tip():
    """In a prediction, in many spectra, and where measured forces are replayed."""
    law, model, (new,) = (
        OnAnvil(scatter=0.0),
        replace(twin(), contact=OnAnvil(scatter=0.0)),
        [setting()],
    )
    pulses = law.pulses(ImpactBatch([new], np.array([8.0])))
    below = model.accelerations([new], law.plate_pulses(None, None, pulses))
    shot = model.predict(new, draws=0)
    assert shot.peak_force_n.mean == pytest.approx(float(pulses.peak_force_n[0]))
    assert shot.accelerations_m_s2 == pytest.approx(below)
    assert model.spectra([new])[0] == pytest.approx(shot.spectra_m_s2["a1"].mean)
    shots = replace(measured([new], np.zeros((1, 2, LINES.size + 1)), [0]),
                    peak_force_n=2 * pulses.peak_force_n,
                    impulse_n_s=2 * pulses.impulse_n_s)  # fmt: skip
    twice = 10 ** (model.replayed_db(shots)[0, :, 0] / 20)
    assert twice == pytest.approx(2 * np.abs(below[0]).max(axis=1))
