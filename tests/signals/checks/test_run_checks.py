"""What holds for every check in the list, and for all of them together."""

from __future__ import annotations

import json
import time
from collections import Counter

import numpy as np
import pytest
from pyroshock.signals.checks import CHECKS, Contact, run_checks

ODD_RECORDS = {
    "empty": np.empty(0),
    "one sample": np.array([1.0]),
    "two samples": np.array([1.0, -2.0]),
    "constant": np.full(100, 2.5),
    "all zero integers": np.zeros(100, np.int16),
    "all NaN": np.full(100, np.nan),
    "half infinite": np.where(np.arange(100) % 2, np.inf, 1.0),
    "largest doubles": np.tile([1.7e308, -1.7e308], 20) * 0.4,
    "alternating int8": np.tile(np.array([-128, 127], np.int8), 50),
}


@pytest.mark.parametrize("check", CHECKS, ids=lambda c: c.__name__)
@pytest.mark.parametrize("quantity", ["force", "acceleration"])
@pytest.mark.parametrize("name", ODD_RECORDS)
def test_odd_record_gives_findings_and_no_error(channel_of, check, quantity, name):
    record = ODD_RECORDS[name]
    contacts = (Contact(0, 0, 0),) if record.size else ()
    for known in (contacts, ()):
        assert isinstance(check(channel_of(record, quantity), known), list)


@pytest.mark.parametrize("check", CHECKS, ids=lambda c: c.__name__)
def test_a_check_leaves_the_record_as_it_was(channel_of, half_sine, check):
    x = half_sine(noise=3.0, rng=np.random.default_rng(0))
    x[700:720] = np.nan
    before = x.copy()
    check(channel_of(x), (Contact(400, 430, 459),))
    np.testing.assert_array_equal(x, before)


def spoilt(half_sine):
    """Cut, hit twice, shifted, held and with a bad sample."""
    x = np.minimum(half_sine(noise=3.0, rng=np.random.default_rng(0)), 900.0) + half_sine(
        first=800, height=300.0
    )
    x[900:] += 80.0
    x[1500:1540] = 5.0
    x[1700] = np.nan
    return x.astype(np.float32)


def test_findings_survive_json(channel_of, half_sine):
    channel = channel_of(
        spoilt(half_sine), rate_hz=np.float32(2e4), header={"time_gaps": [[1000, 3]]}
    )
    findings = run_checks(channel, (Contact(400, 430, 459), Contact(827, 830, 833)))
    assert {f.check for f in findings} >= {
        "clipping",
        "dropouts",
        "zero-shift",
        "double-hit",
        "few-samples",
    }
    for finding in findings:
        assert json.loads(json.dumps(finding.evidence, allow_nan=False)) == finding.evidence


def test_measured_hits_give_nothing_but_notes_on_samples(channel_of, contact_at_peak, vrtac):
    found = Counter(
        (f.check, f.severity)
        for hit in vrtac.values()
        for f in run_checks(channel_of(hit[0], rate_hz=2e4), contact_at_peak(hit[0]))
    )
    assert found.keys() == {("few-samples", "note")}


@pytest.mark.parametrize("moved", [0, 30])
def test_modal_hammer_hit_neither_warns_nor_rejects(channel_of, contact_at_peak, real_data, moved):
    """Its 30 pre-samples are at the end of the array: as it is stored (0) and put in order (30)."""
    import lvm_read

    data = lvm_read.read(str(real_data / "ladisk-imac-tutorial" / "acceleration.lvm"))[0]["data"]
    force_n = np.roll(data[:, 1], moved)
    contacts = contact_at_peak(force_n - np.median(force_n))
    findings = run_checks(channel_of(force_n, rate_hz=5e4), contacts)
    assert force_n.max() == pytest.approx(195.6, abs=0.1)
    assert [f for f in findings if f.severity != "note"] == []


@pytest.mark.parametrize(
    ("folders", "count", "checks"),
    [
        ("shared", 120, {"pre-trigger-noise"}),
        ("examples", 52, {"pre-trigger-noise", "truncation", "few-samples"}),
    ],
)
def test_healthy_campaigns_give_nothing_but_notes(
    channel_of, contact_at_peak, request, folders, count, checks
):
    from scipy.io import loadmat

    found, recordings = Counter[tuple[str, str]](), 0
    for path in sorted(request.getfixturevalue(folders).glob("**/recordings/*.[mn]*")):
        if "field-cases" in path.parts:
            continue  # made to be found
        record = np.load(path) if path.suffix == ".npz" else loadmat(path, squeeze_me=True)
        recordings += 1
        contacts = contact_at_peak(record["force"])
        for name in record.keys() & {"force", "acceleration_1", "acceleration_2"}:
            channel = channel_of(record[name], name.split("_")[0], float(record["fs"]))
            found.update((f.check, f.severity) for f in run_checks(channel, contacts))
    assert recordings == count
    assert found.keys() == {(check, "note") for check in checks}


@pytest.mark.bench
@pytest.mark.parametrize("quantity", ["force", "acceleration"])
def test_ten_seconds_of_a_channel_cost_less_than_15_ms(channel_of, half_sine, quantity):
    rng = np.random.default_rng(0)
    first = [20000 + 50000 * i for i in range(10)]
    x = rng.normal(size=512_000) + sum(half_sine(n=512_000, first=f, width=20) for f in first)
    contacts = tuple(Contact(f, f + 10, f + 19) for f in first)
    costs_s = []
    for _ in range(9):
        channel = channel_of(x.astype(np.float32), quantity)
        begin = time.perf_counter()
        run_checks(channel, contacts)
        costs_s.append(time.perf_counter() - begin)
    assert min(costs_s) < 0.015
