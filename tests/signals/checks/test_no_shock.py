from __future__ import annotations

import numpy as np
import pytest
from pyroshock.signals.checks import Contact
from pyroshock.signals.checks.no_shock import check_no_shock

T = np.arange(16384)


def ringing(begin=1000, n=16384, noise=1.0, seed=0):
    """Two modes of 1000 m/s2 from sample `begin` on; a negative one is a record that begins so much
    too late."""
    t = T[:n] - begin
    x = np.random.default_rng(seed).normal(scale=noise, size=n)
    return x + 500.0 * np.exp(-t / 900.0) * (np.sin(0.13 * t) + np.sin(0.31 * t)) * (t >= 0)


def severities(channel, contacts=()):
    return [finding.severity for finding in check_no_shock(channel, contacts)]


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("n", [600, 5000, 200_000])
@pytest.mark.parametrize("offset", [0.0, 300.0])
def test_noise_is_no_shock(channel_of, seed, n, offset):
    x = offset + np.random.default_rng(seed).normal(scale=7.0, size=n)
    assert severities(channel_of(x, "acceleration")) == ["reject"]


def test_hum_and_noise_are_no_shock_and_nine_sigma_are(channel_of):
    """Also where a force tells of a contact; a force itself is not judged."""
    hum = 20.0 * np.sin(2 * np.pi * 50.0 * T / 51200.0) + np.random.default_rng(1).normal(
        size=T.size
    )
    assert severities(channel_of(hum, "acceleration")) == ["reject"]
    noise = np.random.default_rng(2).normal(size=8000)
    assert severities(channel_of(noise, "acceleration"), (Contact(1000, 1010, 1020),)) == ["reject"]
    small = np.random.default_rng(3).normal(size=8000)
    small[3000:3020] += 9.0
    for shock in (small, ringing()):
        assert severities(channel_of(shock, "acceleration")) == []
    assert severities(channel_of(np.random.default_rng(4).normal(size=5000))) == []


@pytest.mark.parametrize("late", [60, 250, 700, 1500])
def test_record_that_begins_in_the_ringing_is_rejected(channel_of, late):
    (finding,) = check_no_shock(channel_of(ringing(begin=-late), "acceleration"), ())
    assert finding.severity == "reject"
    assert "begins inside of the shock" in finding.message
    assert finding.channel == "probe"


def test_whole_record_is_a_shock_and_one_that_begins_at_the_onset_is_doubted(channel_of, real_data):
    x = ringing(begin=0, noise=0.0)
    x[:40] *= np.arange(40) / 40.0
    assert severities(channel_of(x, "acceleration")) == ["warning"]
    # 52 channels of others: Irvine's flights, AFRL's shocks, the drops of endaq, quiet axes
    # included.
    with np.load(real_data / "vibrationdata-irvine" / "records.npz") as file:
        records = [
            file[name][:, 1]
            for name in file.files
            if file[name].shape[1] == 2 and "SRS" not in name
        ]
    with np.load(real_data / "afrl-ds3-electronics-shock" / "shocks.npz") as file:
        records += [
            file[name][:, axis] for name in file.files if file[name].ndim == 2 for axis in (1, 2)
        ]
    with np.load(real_data / "endaq-ide" / "windows_300ms.npz") as file:
        records += [file[name][:, axis].astype(float) for name in file.files for axis in (1, 2, 3)]
    assert len(records) >= 50
    assert [severities(channel_of(x, "acceleration", unit="g")) for x in records] == [[]] * len(
        records
    )
