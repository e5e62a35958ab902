"""Shock response spectra of any recording alone: from a file to spectrum, moments, findings and comparison."""

from __future__ import annotations

from dataclasses import dataclass

from ...array_types import Floats
from ...signals.channel import Channel, Sensor
from ...signals.checks import Finding, run_checks, run_spectrum_checks
from ...signals.checks.recording import judge_together
from ...signals.srs.moments import Moments, temporal_moments
from ...signals.srs.spectrum import Spectrum, shock_response_spectrum
from ...twin.srs.target import SpectrumComparison, Target, compare
from .channel import Acceleration

#: Samples per cycle of a line of a resampled record: they hide 0.5 % of a peak at most.
RESAMPLED_TO = 40.0


@dataclass(frozen=True, eq=False)
class MeasuredSpectrum:
    """All that a recording alone tells; `comparison` where there is a target."""

    acceleration: Acceleration
    spectrum: Spectrum
    moments: Moments
    findings: tuple[Finding, ...]
    comparison: SpectrumComparison | None


def measure(
    acceleration: Acceleration,
    frequency_hz: Floats | None,
    damping_ratio: float,
    *,
    target: Target | None = None,
    resample: bool = False,
    range_m_s2: float | None = None,
) -> MeasuredSpectrum:
    """Spectrum, moments, checks, comparison. Lines that are not given are the target's, else the record's own grid."""
    sensor = Sensor(acceleration.channel, "acceleration", "m/s2", range=range_m_s2)
    channel = Channel(sensor, acceleration.values_m_s2, acceleration.sampling_rate_hz, acceleration.start_s)
    if frequency_hz is None and target is not None:
        frequency_hz = target.lines()
    spectrum = shock_response_spectrum(
        channel.si,
        channel.sampling_rate_hz,
        frequency_hz,
        damping_ratio=damping_ratio,
        resample=RESAMPLED_TO if resample else None,
    )
    return MeasuredSpectrum(
        acceleration,
        spectrum,
        temporal_moments(channel.si, channel.sampling_rate_hz, acceleration.start_s),
        tuple(judge_together([channel], run_checks(channel, ()) + run_spectrum_checks(channel, spectrum))),
        None if target is None else compare(spectrum.maximax, spectrum.frequency_hz, target),
    )
