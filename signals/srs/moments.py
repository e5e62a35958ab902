"""Temporal moments: where a transient lies in time, how long it is, and how it is shaped, without a
spectrum.

D. O. Smallwood, "Characterization and Simulation of Transient Vibrations Using Band Limited
Temporal Moments", Shock and Vibration 1 (1994) 507. m_i(a) is the integral of (t - a)^i x(t)^2 dt.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...array_types import Floats


@dataclass(frozen=True)
class Moments:
    """Moments of one record x (m/s2 in the units here). All are NaN, and the energy 0, for a record
    of zeros.

    `skewness` and `kurtosis` are Smallwood's, roots over the rms duration: S = (m3 / E)^(1/3) / D
    and K = (m4 / E)^(1/4) / D about the centroid; the usual figures are their third and fourth
    powers.
    """

    energy_m2_s3: float
    centroid_s: float
    rms_duration_s: float
    root_energy_amplitude_m_s2: float
    skewness: float
    kurtosis: float
    duration_10_90_s: float
    duration_5_95_s: float


def temporal_moments(
    acceleration: Floats, sampling_rate_hz: float, start_s: float = 0.0
) -> Moments:
    """Moments of a record by the trapezoid rule.

    E = m0(0), centroid = m1(0) / E, D = sqrt(m2 / E), root energy amplitude Ae = sqrt(E / D). The
    effective durations hold the middle 80 and 90 % of the energy.

    Parameters:
        acceleration: The record (n,) in m/s2, n >= 2.
        sampling_rate_hz: Its sampling rate.
        start_s: The time of its first sample on the clock of `centroid_s`; by default 0.

    Source:
        Trifunac and Brady, BSSA 65 (1975) 581, for the duration that holds 90 %.
    """
    step = 1 / sampling_rate_hz
    time = step * np.arange(acceleration.size)
    power = np.square(acceleration, dtype=np.float64)
    energy = float(np.trapezoid(power, dx=step))
    if energy == 0.0:
        return Moments(0.0, *[np.nan] * 7)
    share = power / energy
    centroid = float(np.trapezoid(time * share, dx=step))
    m2, m3, m4 = (float(np.trapezoid((time - centroid) ** i * share, dx=step)) for i in (2, 3, 4))
    duration = m2**0.5
    return Moments(
        energy_m2_s3=energy,
        centroid_s=start_s + centroid,
        rms_duration_s=duration,
        root_energy_amplitude_m_s2=(energy / duration) ** 0.5,
        skewness=float(np.cbrt(m3)) / duration,
        kurtosis=m4**0.25 / duration,
        duration_10_90_s=_middle(share, step, 0.1),
        duration_5_95_s=_middle(share, step, 0.05),
    )


def _middle(share: Floats, step: float, tail: float) -> float:
    """How long it takes from `tail` of the energy to all but `tail` of it, s; linear between
    samples."""
    grown = np.concatenate([[0.0], np.cumsum(share[1:] + share[:-1]) * step / 2])
    time = step * np.arange(share.size)
    # a level that several samples share (silence) is first reached at the first of them
    grown, first = np.unique(grown, return_index=True)
    early, late = np.interp([tail, 1 - tail], grown, time[first])
    return float(late - early)
