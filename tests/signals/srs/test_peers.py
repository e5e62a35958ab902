"""Spectra against those of others."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.signals.srs.spectrum import oscillator_response, shock_response_spectrum
from scipy.signal import lfilter
from support.checks.printed_filters import absolute_acceleration, relative_displacement

with (
    np.printoptions()
):  # parts of pyyeti set the print options of all, by which pandas then writes CSV
    from pyyeti import srs as pyyeti

RATE = 1e5
LINES = np.geomspace(100, 30_000, 40)


@pytest.fixture(params=[1, 2, 3])
def record(request):
    return np.random.default_rng(request.param).normal(size=5000)


def peer(record, **options):
    options = {"rolloff": "none", "parallel": "no", "time": "primary", **options}
    return pyyeti.srs(record, RATE, LINES, options.pop("Q", 10), **options)


@pytest.mark.parametrize("q", [5.0, 10.0, 50.0])
def test_pyyeti_gives_the_same_absolute_acceleration(record, q):
    ours = shock_response_spectrum(record, RATE, LINES, resample_within=None, q=q)
    assert ours.primary == pytest.approx(peer(record, Q=q), rel=1e-9, abs=0)


def test_pyyeti_gives_the_same_of_either_sign_and_of_residual_and_pseudo_velocity(record):
    quiet = np.append(record, np.zeros(5))  # both ends at rest, and what comes later is less
    ours = shock_response_spectrum(quiet, RATE, LINES, resample_within=None)
    ends = ours.residual < 0.9 * np.minimum(ours.positive, ours.negative)
    assert ends.sum() > 20
    assert ours.positive[ends] == pytest.approx(peer(quiet, peak="poss")[ends], rel=1e-9, abs=0)
    assert -ours.negative[ends] == pytest.approx(peer(quiet, peak="negs")[ends], rel=1e-9, abs=0)
    # Its coefficients lose digits: 1e-9 from 100 Hz on is what is left of them.
    ours = shock_response_spectrum(
        np.append(record, np.zeros(2000)), RATE, LINES[5:], resample_within=None
    )
    theirs = peer(np.append(record, np.zeros(2000)), stype="pvelo")[5:]
    late = ours.residual < 0.5 * ours.primary
    assert late.sum() > 20
    assert ours.pseudo_velocity_m_s[late] == pytest.approx(theirs[late], rel=1e-9, abs=0)
    # Theirs is the largest sample of one cycle of the lowest line, so it is less, by the sampling
    # error at most.
    ours = shock_response_spectrum(record, RATE, LINES, resample_within=None)
    theirs = peer(record, time="residual")
    assert np.all(theirs <= ours.residual * (1 + 1e-9))
    assert np.all(theirs >= ours.residual * np.cos(np.pi * LINES / RATE) * (1 - 1e-9))


@pytest.mark.parametrize(
    ("coefficients", "theirs"),
    [(absolute_acceleration, pyyeti.absacce), (relative_displacement, pyyeti.reldisp)],
)
def test_pyyeti_has_the_same_filters(coefficients, theirs):
    omega = 2 * np.pi * np.array([500.0, 2000.0, 30_000.0])
    ours = coefficients(omega, 1 / RATE, 0.05)
    for i, one in enumerate(omega):
        b, a = theirs(10, 1 / RATE, one)
        assert ours.b[:, i] == pytest.approx(b, rel=1e-7, abs=0)
        assert ours.a[:, i] == pytest.approx(a, rel=1e-13, abs=0)


@pytest.mark.parametrize("line", [300.0, 3000.0, 40_000.0])
def test_printed_filters_give_the_same_series(record, line):
    ours = oscillator_response(record, RATE, line, q=25)
    omega = np.array([2 * np.pi * line])
    for coefficients, series in (
        (absolute_acceleration, ours.absolute_acceleration_m_s2),
        (relative_displacement, ours.relative_displacement_m),
    ):
        printed = coefficients(omega, 1 / RATE, 0.02)
        theirs = lfilter(printed.b[:, 0], printed.a[:, 0], record)
        assert series == pytest.approx(theirs, rel=0, abs=1e-10 * np.abs(theirs).max())


@pytest.mark.parametrize(
    ("record", "reference", "q"),
    [
        ("srs2000G_accel_txt", "srs2000_pn_txt", 10.0),
        ("zone4_acceleration_txt", "zone4_SRS_txt", 25.0),
    ],
)
def test_irvine_gives_the_same_spectrum(real_data, record, reference, q):
    """Within 0.01 dB, positive and negative, at each line up to half the sampling rate."""
    with np.load(real_data / "vibrationdata-irvine" / "records.npz") as records:
        time, acceleration = records[record].T
        line, *theirs = records[reference].T
    rate = (time.size - 1) / (time[-1] - time[0])
    ours = shock_response_spectrum(acceleration, rate, line, resample_within=None, q=q)
    apart = 20 * np.log10([ours.positive / theirs[0], ours.negative / theirs[1]])
    assert np.abs(apart).max() < 0.01
