from __future__ import annotations

import numpy as np
import pytest
from pyroshock.ingest.extraction.recording import hits_of
from pyroshock.ingest.extraction.settings import ExtractionSettings
from pyroshock.signals.checks import Contact
from pyroshock.signals.checks.zero_shift import check_zero_shift

CONTACT = (Contact(1000, 1010, 1020),)


def ringing(n=16384, decay=600.0, shift=0.0, fade=np.inf, seed=0):
    """Three modes of a struck structure from sample 1000 on, 1000 m/s2 at most, noise of 1, and an
    offset."""
    rng = np.random.default_rng(seed)
    t = np.arange(n - 1000)
    modes = sum(np.exp(-t / decay) * np.sin(w * t) for w in (0.05, 0.13, 0.4))
    x = rng.normal(size=n)
    x[1000:] += 1000.0 * modes / np.abs(modes).max() + shift * np.exp(-t / fade)
    return x


@pytest.fixture(scope="module")
def irvine(real_data):
    with np.load(real_data / "vibrationdata-irvine" / "records.npz") as file:
        return {name: file[name] for name in file if file[name].shape[1] == 2}


def irvine_channel(channel_of, record):
    return channel_of(
        record[:, 1], "acceleration", float(1 / np.median(np.diff(record[:, 0]))), unit="g"
    )


def test_raw_separation_record_and_one_other_are_flagged(channel_of, irvine):
    (finding,) = check_zero_shift(irvine_channel(channel_of, irvine["rv_separation_raw_txt"]), ())
    assert finding.severity == "warning"
    assert finding.evidence["velocity_ratio"] > 10.0
    assert not finding.evidence["could_be_tilt"]
    # Integrated with the level before the event removed; the record as it stands gives -75 m/s.
    channel = irvine_channel(channel_of, irvine["rv_separation_raw_txt"])
    (finding,) = check_zero_shift(channel, ())
    velocity_m_s = np.cumsum(channel.si - channel.si[:200].mean()) * channel.period_s
    assert finding.evidence["residual_velocity_m_s"] == pytest.approx(velocity_m_s[-1], rel=0.05)
    # Avionics channel 33 rests at 10.2 g before and 4.0 g after; its neighbours 25 and 30 move by
    # 1.5 g and less.
    flagged = [
        name
        for name, record in irvine.items()
        if check_zero_shift(irvine_channel(channel_of, record), ())
    ]
    assert flagged == ["rv_separation_raw_txt", "avionics_channel_33"]


def test_records_whose_rest_stays_are_clean(channel_of):
    """Decayed; with 2 m/s2 for 0.3 s, 0.6 m/s that a suspension could drive where the shock itself
    reached 0.36 m/s; with a pulse whose impulse a plate on strings keeps as velocity; with 0.1 m/s
    that its strings turn round within the record, half a period at 2 Hz; and without a level before
    the shock."""
    rate_hz, free, swinging = 51200.0, ringing(), ringing()
    free[1000:1020] += 500.0
    t = np.arange(swinging.size - 1000) / rate_hz
    swinging[1000:1020] += 0.1 * rate_hz / 20
    swinging[1000:] -= 0.1 * 2 * np.pi * 2.0 * np.sin(2 * np.pi * 2.0 * t)
    for x in (ringing(), ringing(shift=2.0), free, swinging):
        assert check_zero_shift(channel_of(x, "acceleration", rate_hz), CONTACT) == []
    assert (
        check_zero_shift(
            channel_of(ringing(shift=50.0)[990:], "acceleration"), (Contact(10, 20, 30),)
        )
        == []
    )
    # Noise that remembers for 33 samples: the means before and after differ by more than white
    # noise lets them.
    from scipy.signal import lfilter

    for seed in range(20):
        wander = lfilter(
            [1.0], [1.0, -0.97], np.random.default_rng(100 + seed).normal(scale=4.0, size=16384)
        )
        assert (
            check_zero_shift(channel_of(ringing(seed=seed) + wander, "acceleration"), CONTACT) == []
        )


def test_offset_is_measured_and_graded(channel_of):
    (finding,) = check_zero_shift(channel_of(ringing(shift=-20.0), "acceleration"), CONTACT)
    assert finding.severity == "warning"
    assert finding.evidence["shift_m_s2"] == pytest.approx(-20.0, abs=0.5)
    (finding,) = check_zero_shift(channel_of(ringing(n=60000, shift=4.0), "acceleration"), CONTACT)
    assert finding.severity == "note"
    assert check_zero_shift(channel_of(ringing(shift=40.0, fade=8000.0), "acceleration"), CONTACT)


@pytest.mark.parametrize("contacts", [CONTACT, ()], ids=["contact known", "contact unknown"])
@pytest.mark.parametrize("n", [1800, 16384], ids=["long before", "long after"])
def test_large_offset_is_not_taken_for_ringing(channel_of, contacts, n):
    """From 5 % of the peak an offset is as loud as what counts as ringing."""
    (finding,) = check_zero_shift(
        channel_of(ringing(n=n, decay=40.0, shift=150.0), "acceleration"), contacts
    )
    assert (finding.severity, finding.evidence["truncated"]) == ("warning", False)


def test_offset_of_a_truncated_record_never_warns(channel_of):
    found = [
        f.severity
        for seed in range(20)
        for f in check_zero_shift(
            channel_of(ringing(n=2500, decay=3000.0, seed=seed), "acceleration"), CONTACT
        )
    ]
    assert "warning" not in found
    t = np.arange(7000)
    x = np.random.default_rng(0).normal(size=8000)
    x[1000:] += (
        1000.0 * np.exp(-t / 3000) * np.sin(0.4 * t) + 100.0
    )  # 97 of the 1000 still ring at the end
    (finding,) = check_zero_shift(channel_of(x, "acceleration"), CONTACT)
    assert (finding.severity, finding.evidence["truncated"]) == ("note", True)


def test_force_that_rests_elsewhere_is_graded_and_what_is_moved_on_purpose_is_not_judged(
    channel_of, half_sine
):
    for offset_n, severities in ((2.0, []), (7.0, ["note"]), (30.0, ["warning"])):
        x = half_sine(noise=1.0, rng=np.random.default_rng(2))
        x[460:] += offset_n
        findings = check_zero_shift(channel_of(x), (Contact(400, 430, 459),))
        assert [f.severity for f in findings] == severities
    for position in ("hammer", "Impactor", "bullet"):
        channel = channel_of(ringing(shift=50.0), "acceleration", position=position)
        assert check_zero_shift(channel, CONTACT) == []


def test_measured_hits_and_their_responses_do_not_shift(channel_of, contact_at_peak, vrtac):
    flagged = [
        (name, row)
        for name, hit in vrtac.items()
        for row, quantity in enumerate(("force", "acceleration", "acceleration", "acceleration"))
        if check_zero_shift(channel_of(hit[row], quantity, 2e4), contact_at_peak(hit[0]))
    ]
    assert flagged == []


@pytest.mark.parametrize("width", [60, 150, 400])
@pytest.mark.parametrize("begin", [0.01, 0.02, 0.03])
def test_rising_foot_of_a_pulse_is_no_rest(channel_of, width, begin):
    """A drop table's bell-shaped pulse, triggered late: the record begins at a share of the peak,
    and what lies before 5 % of it is its foot alone."""
    t = np.arange(200 * width) - width * np.sqrt(2.0 * np.log(1.0 / begin))
    x = 1000.0 * np.exp(-((t / width) ** 2) / 2.0) + np.random.default_rng(0).normal(
        scale=0.1, size=t.size
    )
    assert check_zero_shift(channel_of(x, "acceleration"), ()) == []


@pytest.mark.parametrize("seed", range(51))
def test_rising_foot_of_a_slow_contact_is_no_rest(channel_of, seed):
    """A contact that grows and fades exponentially, as of foam, in a record that rests at zero
    before and after."""
    rng = np.random.default_rng(seed)
    width = int(rng.integers(50, 1500))
    t = np.arange(int(width * rng.uniform(8, 80))) - width * rng.uniform(3.2, 5.0)
    x = 1000.0 / np.cosh(np.clip(1.3 * t / width, -50, 50)) + rng.normal(scale=0.2, size=t.size)
    channel = channel_of(x)
    contacts = tuple(
        pulse.contact for pulse in hits_of([channel], ExtractionSettings(), None).pulses
    )
    assert check_zero_shift(channel, contacts) == []
