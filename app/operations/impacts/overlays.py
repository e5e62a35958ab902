"""Pulses of a filter laid over each other, by the levels of a factor, with their mean and spread;
and shock response spectra of chosen impacts, within a band about their mean or a specification."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from sqlalchemy import Row
from sqlalchemy.orm import Session

from ....array_types import Floats
from ....schema.campaigns import Factor
from ....schema.conditions import Condition, get_factor_id, listing_key
from ....schema.configurations import iter_levels
from ....schema.impacts import Impact, Pulse
from ....schema.listings import list_pulses
from ....schema.series import SeriesError, as_floats
from ....signals.srs.spectrum import Spectrum, shock_response_spectrum
from ....twin.chain import default_lines
from ....twin.srs.standards import within_db
from ....twin.srs.target import SpectrumComparison, Target, compare
from .impact_records import ImpactRecord, impact_records

#: Impact, configuration, contact time, period and fine force of a pulse.
PulseRow = Row[tuple[int, int, float, float, bytes]]
_COLUMNS = (
    Pulse.impact_id,
    Impact.configuration_id,
    Pulse.contact_time_s,
    Pulse.fine_period_s,
    Pulse.fine_force_n,
)

#: More curves than this on one grid cost seconds and show no more.
MOST_PULSES = 2000
POINTS = 200


@dataclass(frozen=True, eq=False)
class LevelPulses:
    """The pulses at one level of the factor (a number in SI, a word, None where it was not
    recorded).

    `impacts` (k,) are their keys, `force_n` (k, points) their curves; `mean_n` and `deviation_n`
    (points,) are their mean and standard deviation, NaN for the deviation of a single one.
    """

    level: float | str | None
    impacts: tuple[int, ...]
    contact_time_s: Floats
    force_n: Floats
    mean_n: Floats
    deviation_n: Floats

    @property
    def count(self) -> int:
        return len(self.impacts)


@dataclass(frozen=True, eq=False)
class PulseOverlay:
    """Pulses on one axis: `time_s` (points,) since contact began, or its share of the contact from
    0 to 1.

    `drawn` of the `matching` pulses are in it, taken evenly where it is not all of them: `thinned`.
    `damaged` are the impacts that were left out because their stored force is damaged.
    """

    factor: str
    normalised: bool
    axis: Floats
    groups: tuple[LevelPulses, ...]
    drawn: int
    matching: int
    damaged: tuple[int, ...] = ()

    @property
    def thinned(self) -> bool:
        return self.drawn + len(self.damaged) < self.matching


def pulse_overlay(
    session: Session,
    campaign: str | None,
    where: tuple[Condition, ...],
    factor: str,
    *,
    normalised: bool = False,
    most: int = MOST_PULSES,
    points: int = POINTS,
) -> PulseOverlay:
    """The fine forces of the pulses in use that match, by level of `factor` (its name or its key in
    a listing).

    On the axis of time a pulse is zero after its contact. Raises `UnknownFieldError` and
    `LookupError` as a listing does, and `ValueError` for less than two points or one pulse.
    """
    if points < 2:
        raise ValueError(f"points is {points!r}; expected 2 or more")
    key = get_factor_id(session, factor)
    row = session.get_one(Factor, key)
    every, matching = list_pulses(session, campaign, where, most, _COLUMNS)
    level_of = _levels(session, {pulse.configuration_id for pulse in every}, row.name)
    forces, damaged = _forces(every)
    rows = [pulse for pulse in every if pulse.impact_id in forces]
    longest = max((pulse.contact_time_s for pulse in rows), default=0.0)
    axis = np.linspace(0.0, 1.0 if normalised else longest, points)
    by_level: dict[float | str | None, list[PulseRow]] = {}
    for pulse in rows:
        by_level.setdefault(level_of.get(pulse.configuration_id), []).append(pulse)
    groups = []
    for level in sorted(by_level, key=_order):
        members = by_level[level]
        contact = np.array([pulse.contact_time_s for pulse in members])
        at = [axis * time if normalised else axis for time in contact]
        curves = np.stack(
            [
                _resampled(forces[p.impact_id], p.fine_period_s, t)
                for p, t in zip(members, at, strict=True)
            ]
        )
        spread = curves.std(axis=0, ddof=1) if len(members) > 1 else np.full(points, np.nan)
        impacts = tuple(pulse.impact_id for pulse in members)
        groups.append(LevelPulses(level, impacts, contact, curves, curves.mean(axis=0), spread))
    return PulseOverlay(
        listing_key(row.name, row.si_unit),
        normalised,
        axis,
        tuple(groups),
        len(rows),
        matching,
        damaged,
    )


def _forces(rows: Iterable[PulseRow]) -> tuple[dict[int, Floats], tuple[int, ...]]:
    """Fine forces (m,) by impact, and the impacts whose stored one is damaged."""
    forces: dict[int, Floats] = {}
    damaged = []
    for row in rows:
        try:
            forces[row.impact_id] = as_floats(
                row.fine_force_n, f"the force of impact {row.impact_id}"
            )
        except SeriesError:
            damaged.append(row.impact_id)
    return forces, tuple(damaged)


def _levels(session: Session, keys: set[int], factor: str) -> dict[int, float | str]:
    """The level of a factor by configuration; none for one that does not set it."""
    rows = iter_levels(session, sorted(keys))
    return {row.configuration: row.level for row in rows if row.factor == factor}


def _resampled(force: Floats, period_s: float, time_s: Floats) -> Floats:
    """A fine force (m,) at instants (points,) since contact began, zero after its last one."""
    own = np.arange(force.size) * period_s
    # The contact time and the last point differ by rounding, which must not cut a pulse's end off.
    inside = time_s <= own[-1] * (1 + 1e-9)
    return np.where(inside, np.interp(time_s, own, force), 0.0)


def _order(level: float | str | None) -> tuple[int, float, str]:
    """Numbers rise, words follow the alphabet, what was not recorded comes last."""
    if level is None:
        return 2, 0.0, ""
    return (1, 0.0, level) if isinstance(level, str) else (0, level, "")


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
    """From `lower_m_s2` to `upper_m_s2` (f,), `db` either way of the reference; None: a
    specification's own."""

    db: float | None
    lower_m_s2: Floats
    upper_m_s2: Floats


@dataclass(frozen=True, eq=False)
class SpectrumOverlay:
    """Spectra at `frequency_hz` (f,), and what they are held against.

    `reference` is the specification, or the mean in decibels of the maximax spectra (of all, or of
    one impact), which has no tolerance narrower than its widest band. `comparison` is of all
    spectra against it, at the lines that both have. `bands` are at `comparison.frequency_hz`.
    `left_out` says which channels have no spectrum, and why.
    """

    frequency_hz: Floats
    spectra: tuple[ImpactSpectrum, ...]
    reference: Target
    bands: tuple[ReferenceBand, ...]
    comparison: SpectrumComparison
    left_out: tuple[str, ...]

    def rows(self) -> list[dict[str, Any]]:
        """Of each spectrum how it keeps to the reference, in the order of `spectra`."""
        return [
            {
                "impact": overlaid.impact,
                "channel": overlaid.channel,
                "met": bool(self.comparison.met[i]),
                "share_within": float(self.comparison.share_within[i]),
                "share_above": float(self.comparison.share_above[i]),
                "sentence": self.comparison.sentence((i,)),
                "worst_margin_db": float(self.comparison.worst_margin_db[i]),
                "worst_frequency_hz": float(self.comparison.worst_frequency_hz[i]),
            }
            for i, overlaid in enumerate(self.spectra)
        ]


def spectrum_overlay(
    session: Session,
    impacts: Sequence[int],
    channel: str | None = None,
    *,
    q: float = 10.0,
    frequency_hz: Floats | None = None,
    specification: Target | None = None,
    reference: int | None = None,
    bands_db: Sequence[float] = BANDS_DB,
) -> SpectrumOverlay:
    """Spectra of the acceleration channels (or the one named `channel`) of impacts, by default at
    `default_lines`.

    A recording of one impact is taken whole, else from the rest before this contact up to the next
    one; its first tenth, or the rest, is its zero. Lines from half the lowest sampling rate on are
    left away. They are held against `specification`, else against the mean of the impact
    `reference`, else against the mean of all. Raises `LookupError` for an unknown impact,
    `ValueError` where nothing is left, for too many, for a specification of other lines, and for a
    reference without a spectrum.
    """
    if not 0 < len(impacts) <= MOST_SPECTRA:
        raise ValueError(f"{len(impacts)} impacts; expected 1 to {MOST_SPECTRA}")
    left_out: list[str] = []
    cuts = [
        cut
        for key in dict.fromkeys(impacts)
        for cut in impact_records(session, key, channel, left_out)
    ]
    if len(cuts) > MOST_SPECTRA:
        raise ValueError(
            f"{len(cuts)} channels of these impacts; expected at most "
            f"{MOST_SPECTRA}: choose one channel"
        )
    lines = default_lines() if frequency_hz is None else frequency_hz
    if cuts:
        lines = lines[lines < min(cut.rate_hz for cut in cuts) / 2]
    if cuts and not lines.size:
        raise ValueError("every line lies at half the sampling rate or above; expected lower lines")
    spectra = tuple(
        spectrum for cut in cuts if (spectrum := _spectrum(cut, lines, q, left_out)) is not None
    )
    if not spectra:
        why = f": {'; '.join(left_out[:3])}" if left_out else ""
        raise ValueError(f"no acceleration of these impacts has a spectrum{why}")
    maximax = np.stack([overlaid.spectrum.maximax for overlaid in spectra])
    target = specification
    if target is None:
        of_reference = [reference in (None, part.impact) for part in spectra]
        if not any(of_reference):
            raise ValueError(f"impact {reference} has no spectrum to compare with")
        target = _mean(lines, maximax[of_reference], max(bands_db))
    comparison = compare(maximax, lines, target)
    bands = _bands(comparison.target, bands_db, specification is not None)
    return SpectrumOverlay(lines, spectra, target, bands, comparison, tuple(left_out))


def _spectrum(
    cut: ImpactRecord, lines: Floats, q: float, left_out: list[str]
) -> ImpactSpectrum | None:
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
    """The mean in decibels, as a test's scatter is told: a mean of m/s2 would lean to the
    loudest."""
    level = 10 ** (np.log10(maximax).mean(axis=0))
    rising = np.argsort(lines)
    free = np.full(lines.size, widest_db)
    made = Target(lines[rising], level[rising], free, free)
    return made.with_tolerance(within_db(widest_db))


def _bands(target: Target, bands_db: Sequence[float], specified: bool) -> tuple[ReferenceBand, ...]:
    level = target.level_m_s2
    bands = [
        ReferenceBand(db, level * 10 ** (-db / 20), level * 10 ** (db / 20)) for db in bands_db
    ]
    if specified:
        bands.append(
            ReferenceBand(
                None, level * 10 ** (-target.lower_db / 20), level * 10 ** (target.upper_db / 20)
            )
        )
    return tuple(bands)
