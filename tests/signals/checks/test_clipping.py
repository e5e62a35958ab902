from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyroshock.signals.channel import Channel, Sensor
from pyroshock.signals.checks import Contact
from pyroshock.signals.checks.clipping import check_clipping

G_M_S2 = 9.80665


@pytest.fixture(scope="module")
def endaq(real_data):
    with np.load(real_data / "endaq-ide" / "windows_300ms.npz") as file:
        return {name: file[name] for name in file}


def endaq_channel(channel_of, window, axis):
    rate_hz = float(1 / np.median(np.diff(window[:, 0])))
    return channel_of(window[:, "xyz".index(axis) + 1], "acceleration", rate_hz, unit="g")


def test_saturated_sensor_is_found_on_its_axis_alone(channel_of, endaq):
    (finding,) = check_clipping(
        endaq_channel(channel_of, endaq["water6mps_40g_DC_Acceleration"], "x"), ()
    )
    assert finding.evidence["samples"] == 13
    assert finding.evidence["level"] == pytest.approx(42.01 * G_M_S2, rel=1e-3)
    flagged = [
        (name, axis)
        for name, window in endaq.items()
        for axis in "xyz"
        if check_clipping(endaq_channel(channel_of, window, axis), ())
    ]
    assert flagged == [("water6mps_40g_DC_Acceleration", "x")]


def test_cut_is_located_and_rejects_its_contact_alone(channel_of, half_sine):
    x = half_sine(first=400, width=60, height=1000.0)
    cut = np.minimum(x, 800.0)
    (finding,) = check_clipping(channel_of(cut, rate_hz=1000.0), ())
    at = np.flatnonzero(x >= 800.0)
    assert finding.evidence["first_sample"] == at[0]
    assert finding.evidence["first_time_s"] == pytest.approx(at[0] / 1000.0)
    assert finding.evidence["samples"] == at.size
    assert finding.evidence["share"] == pytest.approx(at.size / x.size)
    whole, cut = half_sine(first=400, height=700.0), np.minimum(half_sine(first=1200), 800.0)
    contacts = (Contact(400, 430, 459), Contact(1200, 1230, 1259))
    (finding,) = check_clipping(channel_of(whole + cut), contacts)
    assert (finding.contact, finding.severity) == (1, "reject")
    (finding,) = check_clipping(channel_of(whole - cut, "acceleration"), contacts[:1])
    assert (finding.contact, finding.severity, finding.evidence["level"]) == (
        None,
        "warning",
        -800.0,
    )


def test_rails_of_either_sign_of_two_codes_or_of_one_sample_are_found(channel_of, half_sine):
    x = np.clip(
        1000.0 * np.sin(np.arange(4000) * 0.01) * np.exp(-np.arange(4000) / 3000), -600.0, 600.0
    )
    levels = [f.evidence["level"] for f in check_clipping(channel_of(x, "acceleration"), ())]
    assert levels == [600.0, -600.0]
    rng = np.random.default_rng(3)
    codes = np.round(half_sine(height=30000.0, noise=3.0, rng=rng))
    top = codes > 24000
    codes[top] = 24000 + rng.integers(0, 2, top.sum())
    assert check_clipping(channel_of(codes.astype(np.int16)), ())
    # One neighbour of the flat top was within a few codes of it; it hid the cut in one of 1000
    # random pulses.
    codes = np.round(half_sine(width=10, height=30000.0, noise=0.6, rng=np.random.default_rng(8)))
    at = np.flatnonzero(codes >= 24000)
    codes[at] = [24000, 24000, 24000, 23992]
    assert check_clipping(channel_of(codes), ())
    x = np.round(np.clip(33.0 * cut(9, 0.5, 2.0), -32768, 32767)).astype(np.int16)
    assert np.count_nonzero(x == 32767) == 1
    (finding,) = check_clipping(channel_of(x, "acceleration"), ())
    assert finding.severity == "reject"


def test_flattened_crest_rest_at_zero_and_irvines_records_are_no_cut(
    channel_of, half_sine, real_data
):
    """Four codes of noise pressed three samples of the crest into one code in one of 1000 random
    pulses."""
    crest = -np.array(
        [727, 570, 440, 316, 213, 140, 77, 32, 0, 1, 1, 27, 78, 144, 219, 324, 441, 576, 736]
    )
    x = np.round(np.random.default_rng(4).normal(scale=4.0, size=4096))
    x[2000 : 2000 + crest.size] = 37220 + crest
    assert check_clipping(channel_of(x), ()) == []
    # Between two pulses the record comes from far away, stays at its minimum for 20 samples, and
    # leaves again.
    x = half_sine(first=400, width=300) + half_sine(first=720, width=300)
    assert check_clipping(channel_of(x), ()) == []
    with np.load(real_data / "vibrationdata-irvine" / "records.npz") as file:
        records = {name: file[name] for name in file if file[name].shape[1] == 2}
    assert len(records) == 14
    assert [
        n
        for n, r in records.items()
        if check_clipping(channel_of(r[:, 1], "acceleration", unit="g"), ())
    ] == []


@settings(max_examples=60)
@given(
    bits=st.integers(7, 16),
    width=st.integers(8, 20000),
    noise_codes=st.sampled_from([0.0, 0.3, 1.0, 3.0]),
    seed=st.integers(0, 2**32 - 1),
)
def test_crest_rounded_to_codes_is_never_clipped(bits, width, noise_codes, seed):
    """However slow the pulse: at 7 bits and 20,000 samples the top code alone lasts for hundreds of
    samples."""
    rng = np.random.default_rng(seed)
    x = np.zeros(3 * width)
    x[width : 2 * width] = 2**bits * np.sin(np.pi * (np.arange(width) + rng.random()) / width)
    codes = np.round(x + rng.normal(scale=noise_codes, size=x.size))
    assert (
        check_clipping(Channel(Sensor("force", "force", "N"), codes.astype(np.int32), 51200.0), ())
        == []
    )


def cut(width: int, phase: float, share: float) -> np.ndarray:
    """A half sine of 1000 whose samples lie `phase` off its zero, in noise of 0.01, held at a share
    of its height."""
    x = np.random.default_rng(0).normal(scale=0.01, size=2048)
    x[400 : 400 + width] += 1000.0 * np.sin(np.pi * (np.arange(width) + phase) / width)
    return np.minimum(x, 1000.0 * share)


@pytest.mark.parametrize("phase", [0.2, 0.35, 0.7, 0.85])
@pytest.mark.parametrize("quantity", ["force", "acceleration"])
def test_two_samples_at_the_rail_are_found(channel_of, phase, quantity):
    x = np.round(cut(9, phase, 0.93) / 0.03) * 0.03
    assert np.count_nonzero(x == x.max()) == 2
    (finding,) = check_clipping(channel_of(x, quantity), ())
    assert (finding.severity, finding.evidence["samples"]) == ("reject", 2)


@pytest.mark.parametrize("width", range(6, 14))
@pytest.mark.parametrize("phase", np.linspace(0.0, 1.0, 21))
def test_whole_crest_of_a_short_pulse_is_left_alone(channel_of, width, phase):
    """Sampled evenly as well, where its two highest samples are equal."""
    assert check_clipping(channel_of(np.round(cut(width, phase, 2.0) / 0.03) * 0.03), ()) == []
