"""Shock response spectra of chosen impacts over each other, within a band about their mean or a specification."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from sqlalchemy.orm import Session

from ...array_types import Floats
from ...signals.srs.spectrum import Spectrum, shock_response_spectrum
from ...twin.chain import default_lines
from ...twin.srs.target import SpectrumComparison, Target, compare, within_db
from ..pulses.accelerations import ImpactRecord, impact_records

MOST_SPECTRA = 200
#: Half-widths in dB of the bands about the mean.
BANDS_DB = (3.0, 6.0)


@dataclass(frozen=True, eq=False)
class ImpactSpectrum:
    """Of one acceleration channel of one impact, over `start_s` to `stop_s` of its recording."""

    impact: int
    channel: str
    start_s: float
    stop_s: float
    spectrum: Spectrum


@dataclass(frozen=True)
class ReferenceBand:
    """From `lower_m_s2` to `upper_m_s2` (f,), `db` either way of the reference; None: a specification's own."""

    db: float | None
    lower_m_s2: Floats
    upper_m_s2: Floats


@dataclass(frozen=True, eq=False)
class SpectrumOverlay:
    """Spectra at `frequency_hz` (f,), and what they are held against.

    `reference` is the specification, or the mean of the maximax spectra in decibels, which has no tolerance narrower
    than its widest band. `comparison` is of all spectra against it, at the lines that both have. `bands` are at
    `comparison.frequency_hz`. `left_out` says which channels have no spectrum, and why.
    """

    frequency_hz: Floats
    spectra: tuple[ImpactSpectrum, ...]
    reference: Target
    bands: tuple[ReferenceBand, ...]
    comparison: SpectrumComparison
    left_out: tuple[str, ...]


def spectrum_overlay(
    session: Session,
    impacts: Sequence[int],
    channel: str | None = None,
    *,
    q: float = 10.0,
    frequency_hz: Floats | None = None,
    specification: Target | None = None,
    bands_db: Sequence[float] = BANDS_DB,
) -> SpectrumOverlay:
    """Spectra of the acceleration channels (or the one named `channel`) of impacts, by default at `default_lines`.

    A recording of one impact is taken whole, else from the rest before this contact up to the next one; its first
    tenth, or the rest, is its zero. Lines from half the lowest sampling rate on are left away. Raises `LookupError` for
    an unknown impact, `ValueError` where nothing is left, for too many, and for a specification of other lines.
    """
    if not 0 < len(impacts) <= MOST_SPECTRA:
        raise ValueError(f"{len(impacts)} impacts; expected 1 to {MOST_SPECTRA}")
    left_out: list[str] = []
    cuts = [cut for key in dict.fromkeys(impacts) for cut in impact_records(session, key, channel, left_out)]
    if len(cuts) > MOST_SPECTRA:
        raise ValueError(f"{len(cuts)} channels of these impacts; expected at most {MOST_SPECTRA}: choose one channel")
    lines = default_lines() if frequency_hz is None else frequency_hz
    if cuts:
        lines = lines[lines < min(cut.rate_hz for cut in cuts) / 2]
    if cuts and not lines.size:
        raise ValueError("every line lies at half the sampling rate or above; expected lower lines")
    spectra = tuple(spectrum for cut in cuts if (spectrum := _spectrum(cut, lines, q, left_out)) is not None)
    if not spectra:
        why = f": {'; '.join(left_out[:3])}" if left_out else ""
        raise ValueError(f"no acceleration of these impacts has a spectrum{why}")
    maximax = np.stack([overlaid.spectrum.maximax for overlaid in spectra])
    reference = specification if specification is not None else _mean(lines, maximax, max(bands_db))
    comparison = compare(maximax, lines, reference)
    bands = _bands(comparison.target, bands_db, specification is not None)
    return SpectrumOverlay(lines, spectra, reference, bands, comparison, tuple(left_out))


def _spectrum(cut: ImpactRecord, lines: Floats, q: float, left_out: list[str]) -> ImpactSpectrum | None:
    try:
        # All lines of a record at once, over as many threads as there are processors.
        spectrum = shock_response_spectrum(cut.values_m_s2, cut.rate_hz, lines, q=q)
    except ValueError as error:
        left_out.append(f"impact {cut.impact}: {cut.channel}: {error}")
        return None
    if not np.all(spectrum.maximax > 0):
        left_out.append(f"impact {cut.impact}: {cut.channel} is silent")
        return None
    stop_s = cut.start_s + (cut.values_m_s2.size - 1) / cut.rate_hz
    return ImpactSpectrum(cut.impact, cut.channel, cut.start_s, stop_s, spectrum)


def _mean(lines: Floats, maximax: Floats, widest_db: float) -> Target:
    """The mean in decibels, as a test's scatter is told: a mean of m/s2 would lean to the loudest."""
    level = 10 ** (np.log10(maximax).mean(axis=0))
    rising = np.argsort(lines)
    free = np.full(lines.size, widest_db)
    made = Target(lines[rising], level[rising], free, free)
    return made.with_tolerance(within_db(widest_db))


def _bands(target: Target, bands_db: Sequence[float], specified: bool) -> tuple[ReferenceBand, ...]:
    level = target.level_m_s2
    bands = [ReferenceBand(db, level * 10 ** (-db / 20), level * 10 ** (db / 20)) for db in bands_db]
    if specified:
        bands.append(ReferenceBand(None, level * 10 ** (-target.lower_db / 20), level * 10 ** (target.upper_db / 20)))
    return tuple(bands)
