"""Records of uneven time on an even grid: the stated error is a bound, against sines in closed
form."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pyroshock.ingest.readers import ReadingOptions, RecordingError, open_recording
from pyroshock.ingest.readers.resampling import grid_rate, resampled

SHOT = Path("shot.csv")
RESAMPLE = ReadingOptions(resample_uneven_time=True)
STEP = 2e-5


def uneven_times(kind, rng, samples=1500):
    match kind:
        case "two rates":
            steps = np.where(
                np.arange(samples) < rng.integers(300, 1200), STEP, STEP * rng.uniform(0.4, 0.9)
            )
        case "drift":
            steps = STEP * np.linspace(1 + rng.uniform(0.02, 0.3), 0.8, samples)
        case _:
            steps = STEP * (1 + rng.uniform(0.05, 0.45) * rng.uniform(-1, 1, samples))
    return np.cumsum(steps)


@pytest.mark.parametrize("kind", ["two rates", "drift", "jitter"])
def test_stated_error_bounds_bands_up_to_nyquist(kind):
    rng = np.random.default_rng(30)
    for _ in range(150):
        times = uneven_times(kind, rng)
        nyquist = 0.5 / np.diff(times).max()
        frequency, phase, size = (
            rng.uniform(0.01, 0.95, 12) * nyquist,
            rng.uniform(0, 6.3, 12),
            rng.normal(size=12),
        )

        def signal(t, frequency=frequency, phase=phase, size=size):
            return np.sum(
                size[:, None] * np.sin(2 * np.pi * frequency[:, None] * t + phase[:, None]), axis=0
            )

        rate = grid_rate(SHOT, times)
        values, bound = resampled(SHOT, "acc", times, signal(times), rate)
        grid = times[0] + np.arange(values.size) / rate
        assert np.max(np.abs(values - signal(grid))) <= bound


def test_well_sampled_pulse_errs_by_parts_of_a_thousand():
    """0.5 ms half sine at 25 samples of uneven steps, smoothed at its ends as a force is."""
    times = uneven_times("jitter", np.random.default_rng(1))

    def pulse(t):
        return 8000 * np.where(
            np.abs(t - 0.01) < 0.5e-3, np.cos(np.pi * (t - 0.01) / 1e-3) ** 2, 0.0
        )

    rate = grid_rate(SHOT, times)
    values, bound = resampled(SHOT, "force", times, pulse(times), rate)
    error = np.max(np.abs(values - pulse(times[0] + np.arange(values.size) / rate)))
    assert error <= bound < 0.01 * 8000


def test_gap_is_not_filled():
    times = np.cumsum(np.r_[np.full(50, STEP), 0.01, np.full(50, 0.7 * STEP)])
    with pytest.raises(
        RecordingError, match=r"has a gap of 0\.01 s before sample 50, which cannot be resampled"
    ):
        grid_rate(SHOT, times)


def test_samples_that_are_no_numbers_are_refused():
    times = uneven_times("drift", np.random.default_rng(2))
    with pytest.raises(RecordingError, match="'acc' has samples that are not finite"):
        resampled(SHOT, "acc", times, np.full(times.size, np.nan), 5e4)


def test_recording_is_refused_or_resampled_as_the_laboratory_says(tmp_path):
    times = uneven_times("two rates", np.random.default_rng(3))
    path = tmp_path / "shot.npz"
    np.savez(
        path,
        t=times,
        acc=np.sin(2 * np.pi * 500 * times),
        counts=np.arange(times.size, dtype=np.int16),
    )
    with pytest.raises(RecordingError, match="its time has two rates, 50000 Hz"):
        open_recording(path)
    with open_recording(path, RESAMPLE) as recording:
        info = recording.info("acc")
        values = recording.read("acc")
        assert np.array_equal(recording.read("acc", 100, 200), values[100:200])
        assert recording.info("counts").dtype == "<f8"
    grid = info.start_s + np.arange(info.samples) / info.sampling_rate_hz
    share = info.header["resampled_time"]["error_share_of_peak"]
    assert np.max(np.abs(values - np.sin(2 * np.pi * 500 * grid))) <= share < 1e-3
    assert (info.start_s, values.dtype) == (times[0], np.float64)


def test_even_recording_is_left_as_it_is(tmp_path):
    path = tmp_path / "shot.npz"
    np.savez(path, t=np.arange(100) / 51200, counts=np.arange(100, dtype=np.int16))
    with open_recording(path, RESAMPLE) as recording:
        assert recording.info("counts").sampling_rate_hz == 51200
        assert recording.read("counts").dtype == np.int16


def test_given_rate_beside_uneven_time_is_refused(tmp_path):
    times = uneven_times("drift", np.random.default_rng(3))
    path = tmp_path / "shot.npz"
    np.savez(path, t=times, acc=np.sin(times))
    with pytest.raises(RecordingError, match="its time drifts"):
        open_recording(path, ReadingOptions(sampling_rate_hz=50000))
