"""Dropouts: samples that are not numbers, samples that are missing, and stretches where the record
stood still."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..channel import Channel
from .base import Contact, Finding, Severity
from .levels import SampleRuns, all_finite, finite_samples, quantisation_step, runs_of

#: Shorter stands are left alone: so many equal neighbours come up in any slow or coarse record.
MIN_HELD = 8
#: Stands this improbable in the whole record, from its own share of equal neighbours, are no
#: chance.
MAX_CHANCE = 1e-6
#: As many samples as the stand has, and at most this many, tell on either side whether the record
#: was live around it, that is moved by two steps or more from sample to sample. A quiet channel of
#: few codes moves by one, and so does the rounded crest of a slow wave next to its top ...
LIVE_SAMPLES = 32
LIVE_STEPS = 2.0
#: ... and was as far from the stand somewhere in the few samples next to it.
BESIDE = 4
#: More equal neighbours than this: the record rests at one number (masked, computed, or coarse),
#: and only a cut through a pulse says anything: so far from the stand, as a share of the range, on
#: both sides of it.
RESTING_SHARE = 0.5
CUT_SHARE = 0.1
#: These move so slowly that one code from begin to end may be right, unless it is zero.
SLOW = ("pressure", "temperature")
#: Only this many stands are looked at closely, the longest: a record with more is not better for
#: it.
MAX_STANDS = 16


def check_dropouts(channel: Channel, contacts: tuple[Contact, ...]) -> list[Finding]:
    """Not-a-number and infinite samples, missing samples (`header["time_gaps"]`), stands. Any
    quantity.

    `time_gaps` is a list of [sample, missing_samples]: so many are missing right before `sample`.
    Severity is `reject` for what touches a contact (its impulse and width are gone) and `warning`
    elsewhere; a channel that never moves is `reject`, a pressure or temperature that does not a
    `note`. Raises `ValueError` for `time_gaps` of another form.
    """
    if channel.recorded.size == 0:
        return []
    findings = _not_finite(channel, contacts) + _missing(channel, contacts)
    if np.all(channel.recorded == channel.recorded[0]):
        return [*findings, _dead(channel)]
    held = _stands(channel)
    return findings + _findings(
        channel, contacts, held, "held", "that stand still in a live signal"
    )


def _not_finite(channel: Channel, contacts: tuple[Contact, ...]) -> list[Finding]:
    x = channel.recorded
    if x.dtype.kind != "f" or all_finite(x):
        return []
    return _findings(
        channel, contacts, runs_of(np.flatnonzero(~np.isfinite(x))), "nan", "not a finite number"
    )


def _missing(channel: Channel, contacts: tuple[Contact, ...]) -> list[Finding]:
    stated_gaps = channel.header.get("time_gaps", [])
    gaps = np.array(stated_gaps if stated_gaps != [] else np.empty((0, 2)), dtype=np.int64)
    if gaps.ndim != 2 or gaps.shape[1] != 2:
        raise ValueError(
            f"{channel.name}: header time_gaps is {stated_gaps!r}; expected a "
            f"list of [sample, missing_samples]"
        )
    findings = []
    # A gap has no samples of its own: for "which contact" it is the one sample that follows it.
    for contact, contact_gaps in SampleRuns(gaps[:, 0], np.zeros(len(gaps), np.int64)).by_contact(
        contacts
    ):
        lost = SampleRuns(contact_gaps.first, gaps[np.isin(gaps[:, 0], contact_gaps.first), 1])
        findings.append(_finding(channel, contact, lost, "gap", "missing from the time axis"))
    return findings


def _stands(channel: Channel) -> SampleRuns:
    """Stretches of equal samples that a live record does not have by chance; not those at its ends
    and extremes."""
    recorded = channel.recorded
    moved = recorded[1:] != recorded[:-1]
    equal = moved.size - int(np.count_nonzero(moved))
    resting = equal > RESTING_SHARE * recorded.size
    runs = _constant_runs(moved, resting)
    least = MIN_HELD if resting else _least_samples(equal, recorded.size)
    inside = (runs.samples >= least) & (runs.first > 0) & (runs.last < recorded.size - 1)
    runs = runs.where(inside & np.isfinite(recorded[runs.first]))
    return _in_live_signal(finite_samples(channel), runs, resting) if runs.first.size else runs


def _constant_runs(moved: NDArray[np.bool_], resting: bool) -> SampleRuns:
    """Runs of equal samples, from whether each differs from the one before (n - 1,): by what is
    rarer, moves or not."""
    if resting:
        changes = np.flatnonzero(moved)
        return SampleRuns(changes[:-1] + 1, np.diff(changes))
    runs = runs_of(np.flatnonzero(~moved))
    return SampleRuns(runs.first, runs.samples + 1)


def _least_samples(equal: int, samples: int) -> int:
    """Length from which on a run is expected less than `MAX_CHANCE` times, were neighbours equal
    independently."""
    share = max(equal, 1) / samples
    return max(MIN_HELD, 1 + math.ceil(math.log(MAX_CHANCE / samples) / math.log(share)))


def _in_live_signal(x: NDArray[np.float64], runs: SampleRuns, resting: bool) -> SampleRuns:
    """Those of `runs` in `x` (n,) with a moving signal on both sides, the longest `MAX_STANDS` of
    them."""
    low, high, step = float(x.min()), float(x.max()), quantisation_step(x)
    least = max(LIVE_STEPS * step, CUT_SHARE * (high - low) if resting else 0.0)
    level = x[runs.first]
    beside = np.arange(1, (1 if resting else BESIDE) + 1)[:, None]
    before = np.abs(x[np.maximum(runs.first - beside, 0)] - level).max(axis=0)
    after = np.abs(x[np.minimum(runs.last + beside, x.size - 1)] - level).max(axis=0)
    # At an extreme it is a rail, which the clipping check knows.
    runs = runs.where((np.minimum(before, after) >= least) & (level > low) & (level < high))
    longest = np.sort(np.argsort(-runs.samples)[:MAX_STANDS])
    live = [
        i
        for i in longest
        if _live_around(x, int(runs.first[i]), int(runs.last[i]), LIVE_STEPS * step)
    ]
    return SampleRuns(runs.first[live], runs.samples[live])


def _live_around(x: NDArray[np.float64], first: int, last: int, least: float) -> bool:
    width = min(last - first + 1, LIVE_SAMPLES)
    before = np.abs(np.diff(x[max(first - width, 0) : first]))
    after = np.abs(np.diff(x[last + 1 : last + 1 + width]))
    return all(side.size > 0 and float(np.median(side)) >= least for side in (before, after))


def _findings(
    channel: Channel, contacts: tuple[Contact, ...], runs: SampleRuns, kind: str, what: str
) -> list[Finding]:
    return [
        _finding(channel, contact, contact_runs, kind, what)
        for contact, contact_runs in runs.by_contact(contacts)
    ]


def _finding(
    channel: Channel, contact: int | None, runs: SampleRuns, kind: str, what: str
) -> Finding:
    evidence = {"kind": kind, **runs.evidence(channel)}
    message = f"{evidence['samples']} samples {what}, the first at {evidence['first_time_s']:.6g} s"
    severity: Severity = "warning" if contact is None else "reject"
    return Finding("dropouts", severity, message, channel.name, evidence, contact)


def _dead(channel: Channel) -> Finding:
    value = float(channel.si[0])
    evidence = {
        "kind": "dead",
        "level": value,
        "unit": channel.si_unit,
        "samples": int(channel.recorded.size),
    }
    message = f"the channel never moves from {value:.6g} {channel.si_unit}"
    severity: Severity = "note" if channel.quantity in SLOW and value != 0.0 else "reject"
    return Finding("dropouts", severity, message, channel.name, evidence)
