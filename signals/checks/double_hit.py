"""Double hit: the hammer touches again while the structure still rings from the first touch."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..channel import Channel
from .base import Contact, Finding
from .levels import baseline, finite_samples, robust_sigma

#: A second peak counts from this share of the first. A second hit of share s ripples the force
#: spectrum, and with it every transfer function, by +-s: 5 % is 0.4 dB.
MIN_SHARE = 0.05
#: The force has returned to zero when it falls below this share of the peak: under it, ringing of
#: sensor and filter (2.6 to 3.3 % on measured 20 kHz hits) would hide the return.
RETURN_SHARE = 0.04
#: Rebounds come within tens of milliseconds; a person cannot repeat a deliberate hit within a tenth
#: of a second.
WINDOW_S = 0.1
#: And it stays down: on a slow flank noise crosses the share above to and fro. Between two hits the
#: force is below this share of the second.
MAX_DIP_SHARE = 0.5
#: A contact cannot pull. What swings below zero by more than this share of its height is ringing.
RINGING_SHARE = 0.5
#: A peak of noise over 5,000 samples of the window reaches 4 sigma; twice that is no noise.
NOISE_SIGMAS = 8.0


def check_double_hit(channel: Channel, contacts: tuple[Contact, ...]) -> list[Finding]:
    """A `warning` per contact that is followed by another touch. Force channels only; needs the
    contacts.

    It is looked for between two contacts that segmentation parted, and within one where it did not.
    """
    if channel.quantity != "force" or not contacts:
        return []
    x = finite_samples(channel)
    rest, noise = baseline(x), robust_sigma(x)
    window = max(1, round(WINDOW_S * channel.sampling_rate_hz))
    findings: list[Finding] = []
    for index, contact in enumerate(contacts):
        second = _second_peak(x[contact.peak : contact.last + window] - rest, noise)
        if second is not None:
            findings.append(_finding(channel, x, contact, contact.peak + second, index, rest))
    return findings


def _second_peak(force: NDArray[np.float64], noise: float) -> int | None:
    """Index of the second peak in `force` (n,), which begins at the first one's peak; None if there
    is none."""
    peak = float(force[0])
    returned = np.flatnonzero(force <= RETURN_SHARE * peak)
    if peak <= 0.0 or returned.size == 0:
        return None
    after = force[returned[0] :]
    second = int(after.argmax())
    height = float(after[second])
    if height < max(MIN_SHARE * peak, NOISE_SIGMAS * noise):
        return None
    if float(after[: second + 1].min()) > MAX_DIP_SHARE * height:
        return None
    # Its first crest comes a quarter period after the return, its trough three quarters.
    lowest = float(after[: 4 * second + 2].min())
    return None if -lowest > RINGING_SHARE * height else int(returned[0]) + second


def _finding(
    channel: Channel, x: NDArray[np.float64], contact: Contact, second: int, index: int, rest: float
) -> Finding:
    first_n, second_n = float(x[contact.peak]) - rest, float(x[second]) - rest
    delay_s = (second - contact.peak) * float(channel.period_s)
    evidence = {
        "peak_force_n": first_n,
        "second_peak_force_n": second_n,
        "share": second_n / first_n,
        "limit_share": MIN_SHARE,
        "second_sample": second,
        "delay_s": delay_s,
    }
    message = (
        f"a second hit of {second_n:.4g} N ({second_n / first_n:.0%} of the first, limit "
        f"{MIN_SHARE:.0%}) follows after {delay_s * 1e3:.3g} ms"
    )
    return Finding("double-hit", "warning", message, channel.name, evidence, index)
