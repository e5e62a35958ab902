from __future__ import annotations

import numpy as np
import pytest
from pyroshock.signals.checks import Contact
from pyroshock.signals.checks.saturation import check_saturation


def pressed(half_sine, rng, ripple=1.0):
    """A pulse of 1000 that an amplifier holds at 700, with noise of the converter on top."""
    return np.minimum(half_sine(width=120), 700.0) + rng.normal(scale=ripple, size=2048)


def test_full_scale_of_either_sign_is_rejected_and_less_is_not(channel_of, half_sine):
    x = np.minimum(half_sine(width=9), 990.0)  # two samples at the rail: no plateau to see
    (finding,) = check_saturation(
        channel_of(x / 1000.0, range=0.99, unit="kN"), (Contact(400, 404, 408),)
    )
    assert (finding.severity, finding.contact) == ("reject", 0)
    assert finding.evidence["samples"] == np.count_nonzero(x >= 990.0)
    # The top code of a converter is full scale; the range of a temperature says nothing.
    codes = np.clip(np.round(half_sine(height=40000.0, width=300)), -32768, 32767).astype(np.int16)
    assert check_saturation(channel_of(codes, range=32768.0), ())
    (finding,) = check_saturation(channel_of(-half_sine(), "acceleration", range=900.0), ())
    assert finding.evidence["level"] < -900.0
    assert check_saturation(channel_of(half_sine(height=1000.0), range=1001.5), ()) == []
    assert (
        check_saturation(channel_of(293.0 + np.arange(100) * 0.01, "temperature", range=100.0), ())
        == []
    )


def test_amplifier_rail_with_noise_is_found_and_a_sharp_cut_is_left_to_clipping(
    channel_of, half_sine
):
    """Without a range, and below one: the sensor's range says nothing about the amplifier behind
    it."""
    (finding,) = check_saturation(channel_of(pressed(half_sine, np.random.default_rng(1))), ())
    assert finding.evidence["level"] == pytest.approx(700.0, rel=0.01)
    assert check_saturation(
        channel_of(pressed(half_sine, np.random.default_rng(2)), range=5000.0), ()
    )
    assert check_saturation(channel_of(np.minimum(half_sine(width=120), 700.0)), ()) == []


def test_no_irvine_record_nor_the_reference_of_the_saturated_sensor_is_saturated(
    channel_of, real_data
):
    with np.load(real_data / "endaq-ide" / "windows_300ms.npz") as file:
        records = [
            file[n][:, a] for n in file if n != "water6mps_40g_DC_Acceleration" for a in (1, 2, 3)
        ]
    assert len(records) == 21
    with np.load(real_data / "vibrationdata-irvine" / "records.npz") as file:
        records += [file[n][:, 1] for n in file if file[n].shape[1] == 2]
    assert [check_saturation(channel_of(x, "acceleration", unit="g"), ()) for x in records] == [
        []
    ] * len(records)
