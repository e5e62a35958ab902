"""No shock: an accelerometer that saw nothing but noise or hum, or a record that begins inside of
the shock."""

from __future__ import annotations

import math

import numpy as np

from ...array_types import Floats
from ..channel import Channel
from .base import Contact, Finding, Severity
from .levels import baseline, finite_samples, robust_sigma

#: A record is looked at in so many pieces: a shock is louder in some of them than in others.
PIECES = 32
#: Noise swings in its loudest piece by less than this times its swing in a quiet one (pieces of 16
#: normal samples: 2.0, of 500: 1.3). 78 measured shocks of others have 4.2 and more.
MIN_SWING_RATIO = 3.0
QUIET_QUANTILE = 0.1
#: The largest of n normal samples passes sqrt(2 ln 2n) sigma by so many sigmas once in a thousand
#: records.
NOISE_MARGIN_SIGMAS = 1.5
#: Pieces of fewer samples tell nothing of a swing.
MIN_PIECE_SAMPLES = 4
#: The begin of a record: this share of it, and so many samples at least.
BEGIN_SHARE, MIN_BEGIN_SAMPLES = 1 / 128, 8
#: From this share of the peak on, the begin is loud. The shocks above have 0.17 at most, on their
#: quietest axis.
LOUD_SHARE = 0.5
#: A record that begins at the onset rises from rest: its first two samples are below these shares
#: of the peak.
ONSET_SHARES = (0.1, 0.2)


def check_no_shock(channel: Channel, contacts: tuple[Contact, ...]) -> list[Finding]:
    """At most one finding, of an acceleration.

    `reject` where no excursion stands out of the noise, neither by height nor by the swing of any
    piece, and where the record begins inside of the shock, whose peak is lost. `warning` where it
    begins at the onset: nothing is known of noise and level at rest. The begin is not judged where
    a force tells when the contact was.
    """
    x = finite_samples(channel)
    if (
        channel.quantity != "acceleration"
        or x.size < PIECES * MIN_PIECE_SAMPLES
        or np.ptp(x) == 0.0
    ):
        return []
    rest, sigma = baseline(x), robust_sigma(x)
    peak = max(float(x.max()) - rest, rest - float(x.min()))
    ratio = _swing_ratio(x)
    limit = math.sqrt(2.0 * math.log(2.0 * x.size)) + NOISE_MARGIN_SIGMAS
    if peak < limit * sigma and ratio < MIN_SWING_RATIO:
        return [_nothing(channel, peak, sigma, limit, ratio)]
    return [] if contacts else _begin(channel, x)


def _swing_ratio(x: Floats) -> float:
    """Swing (largest less smallest sample) of the loudest piece of x (n,), over that of a quiet
    one."""
    pieces = x[: x.size // PIECES * PIECES].reshape(PIECES, -1)
    swings = pieces.max(axis=1) - pieces.min(axis=1)
    quiet = float(np.quantile(swings, QUIET_QUANTILE))
    return float(swings.max()) / quiet if quiet > 0.0 else math.inf


def _nothing(channel: Channel, peak: float, sigma: float, limit: float, ratio: float) -> Finding:
    evidence = {
        "peak_m_s2": peak,
        "noise_m_s2": sigma,
        "limit_sigmas": limit,
        "swing_ratio": ratio,
        "limit_swing_ratio": MIN_SWING_RATIO,
    }
    message = (
        f"no shock: the largest excursion of {peak:.3g} m/s2 is {peak / sigma:.2g} times the noise "
        f"(a shock has more than {limit:.2g}), and no part of the record swings "
        f"{MIN_SWING_RATIO:g} times as much as a quiet one"
    )
    return Finding("no-shock", "reject", message, channel.name, evidence)


def _begin(channel: Channel, x: Floats) -> list[Finding]:
    away = np.abs(x - baseline(x[x.size // 2 :]))
    peak = float(away.max())
    share = float(away[: max(MIN_BEGIN_SAMPLES, int(BEGIN_SHARE * x.size))].max()) / peak
    if share < LOUD_SHARE:
        return []
    rises = away[0] < ONSET_SHARES[0] * peak and away[1] < ONSET_SHARES[1] * peak
    severity: Severity = "warning" if rises else "reject"
    what = (
        "at the onset of the shock, without any rest"
        if rises
        else "inside of the shock, whose peak may be lost"
    )
    evidence = {
        "peak_m_s2": peak,
        "begin_share": share,
        "limit_share": LOUD_SHARE,
        "first_sample_m_s2": float(x[0]),
    }
    message = (
        f"the record begins {what}: its first samples reach {share:.0%} of the "
        f"peak (limit {LOUD_SHARE:.0%})"
    )
    return [Finding("no-shock", severity, message, channel.name, evidence)]
