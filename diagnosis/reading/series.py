"""Force and accelerations of the chosen hits, cut from their recordings on each hit's own clock: 0
s is when contact begins.

What the ingest's quality checks said of a campaign: records that are not to be used, and hits that
were double.

A campaign's impacts and shots as the store has them, in the order in which they were run.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from sqlalchemy import and_, case, func, or_, select
from sqlalchemy.orm import Session, outerjoin

from ...array_types import Floats
from ...ingest.storing.stored_channels import list_channels, read_channel
from ...schema.campaigns import Campaign
from ...schema.impacts import Impact, Pulse, Shot
from ...schema.recordings import QualityFinding, RecordedChannel, Recording
from ...signals.channel import on_impactor
from ..record import Series


@dataclass(frozen=True)
class StoredImpact:
    """One impact or shot. Keys are the store's; what it does not know is None.

    `velocity_source` is "reported", "laser", "integrated", or "impact" where a shot's muzzle
    velocity is missing and that at the plate stands in. `start_s` is the pulse's, on the
    recording's clock.
    """

    run: int
    repetition: int
    configuration_id: int
    recording_id: int | None
    impact_id: int | None
    velocity_m_s: float | None
    velocity_u_m_s: float | None
    velocity_source: str | None
    start_s: float | None
    contact_time_s: float | None
    set_pressure_pa: float | None = None
    recorded_pressure_pa: float | None = None
    bullet_mass_kg: float | None = None

    @property
    def has_pulse(self) -> bool:
        return self.recording_id is not None and self.start_s is not None


def read_hits(session: Session, campaign: Campaign) -> tuple[StoredImpact, ...]:
    """All of a campaign by run, then repetition."""
    table: Any = Impact
    source: Any = Impact
    velocity: list[Any] = [
        Impact.impact_velocity_m_s,
        Impact.impact_velocity_u_m_s,
        Impact.velocity_source,
    ]
    settings: list[Any] = []
    if campaign.kind == "gun":
        table, source = Shot, outerjoin(Shot, Impact, Shot.impact_id == Impact.id)
        stand_in = case(
            (Impact.velocity_source == "reported", "impact"), else_=Impact.velocity_source
        )
        at_muzzle = (Shot.measured_velocity_m_s, Shot.measured_velocity_u_m_s, Shot.velocity_source)
        velocity = [
            case((Shot.velocity_source.is_not(None), muzzle), else_=plate)
            for muzzle, plate in zip(at_muzzle, (*velocity[:2], stand_in), strict=True)
        ]
        settings = [Shot.tank_pressure_pa, Shot.recorded_pressure_pa, Shot.bullet_mass_kg]
    keys = (table.run, table.repetition, table.configuration_id, table.recording_id, Impact.id)
    query = (
        select(*keys, *velocity, Pulse.start_s, Pulse.contact_time_s, *settings)
        .select_from(source)
        .outerjoin(Pulse, and_(Pulse.impact_id == Impact.id, Pulse.current))
        .where(table.campaign_id == campaign.id)
        .order_by(table.run, table.repetition)
    )
    return tuple(StoredImpact(*row) for row in session.execute(query))


_CUT_TOPS = ("clipping", "saturation")
#: A sample from this share of a rail's level on is at the rail.
_AT_RAIL = 0.999
#: Quantities that a diagnosis reads: pressure and displacement for the gun, the others for contact
#: and plate.
_READ = ("force", "acceleration", "pressure", "displacement")


@dataclass(frozen=True)
class QualityExclusions:
    """`rejected`: by recording, impact and channel the checks that found something; an impact or
    channel of None stands for all of them.

    `double_hits`: impacts. `rails`: by recording and channel, levels (SI) at which tops are cut
    somewhere outside of contacts.
    """

    rejected: Mapping[tuple[int, int | None, str | None], frozenset[str]]
    double_hits: frozenset[int]
    rails: Mapping[tuple[int, str], tuple[float, ...]]

    def rejects(self, hit: StoredImpact, channel: str) -> bool:
        """Whether a check said not to use this channel of this hit."""
        return bool(self.checks(hit, channel))

    def checks(self, hit: StoredImpact, channel: str) -> frozenset[str]:
        """The checks that said not to use this channel of this hit."""
        if hit.recording_id is None:
            return frozenset()
        keys = [(hit.recording_id, i, c) for i in (hit.impact_id, None) for c in (channel, None)]
        return frozenset().union(*(self.rejected.get(key, frozenset()) for key in keys))

    def cut_top(self, hit: StoredImpact, channel: str, values: Floats) -> bool:
        """Whether samples of this hit (n,) stand at a rail."""
        rails = self.rails.get((hit.recording_id or 0, channel), ())
        return any(
            (values * np.sign(rail)).max(initial=0.0) >= _AT_RAIL * abs(rail) for rail in rails
        )


def read_exclusions(session: Session, campaign_id: int) -> QualityExclusions:
    """Of all recordings of a campaign. Raises `ValueError` for a channel without a finite number in
    any of them."""
    finding, channel = QualityFinding, RecordedChannel
    # Outside of contacts a cut top leaves the pulse whole, but not a record that rings there.
    outside = and_(finding.check.in_(_CUT_TOPS), finding.severity == "warning")
    columns = (
        finding.recording_id,
        finding.impact_id,
        channel.name,
        finding.check,
        finding.severity,
        finding.evidence,
    )
    query = (
        select(*columns)
        .join(Recording, finding.recording_id == Recording.id)
        .outerjoin(channel, finding.channel_id == channel.id)
        .where(Recording.campaign_id == campaign_id)
        .where(
            or_(
                finding.severity == "reject", finding.check.in_(("double-hit", "dropouts")), outside
            )
        )
    )
    rejected: dict[tuple[int, int | None, str | None], frozenset[str]] = {}
    double: set[int] = set()
    rails: dict[tuple[int, str], tuple[float, ...]] = {}
    empty: set[tuple[int, str]] = set()
    for recording, impact, name, check, severity, evidence in session.execute(query):
        if check == "dropouts" and evidence.get("kind") == "nan" and evidence.get("share") == 1.0:
            empty.add((recording, name))
        if severity == "reject":
            key = recording, impact, name
            rejected[key] = rejected.get(key, frozenset()) | {check}
        elif check == "double-hit":
            double.add(impact)
        elif check in _CUT_TOPS:
            rails[recording, name] = (*rails.get((recording, name), ()), float(evidence["level"]))
    _refuse_empty(session, campaign_id, Counter(name for _, name in empty))
    return QualityExclusions(rejected, frozenset(double), rails)


def _refuse_empty(session: Session, campaign_id: int, empty: Mapping[str, int]) -> None:
    """`empty`: recordings by channel in which it has no finite number."""
    channels = (
        select(RecordedChannel.name, func.count())
        .join(Recording, RecordedChannel.recording_id == Recording.id)
        .where(Recording.campaign_id == campaign_id, RecordedChannel.quantity.in_(_READ))
        .group_by(RecordedChannel.name)
        .order_by(RecordedChannel.name)
    )
    for name, count in session.execute(channels):
        if empty.get(name) == count:
            raise ValueError(
                f"channel {name} holds no number in any of its {count} recordings: mend these, or "
                f"take [channels.{name}] out of campaign.toml, and ingest anew"
            )


#: Of the force, in contact times from the start of contact; at least so many samples before tell
#: the noise.
_FORCE_BEFORE, _FORCE_AFTER, _REST_SAMPLES = 0.5, 2.0, 64
#: Of an acceleration: rest before the contact, and ringing after it unless the next hit comes
#: first.
_REST_S, _RINGING_S = 1e-3, 0.1
#: The next hit's window begins so long before its contact: a start found at a share of the peak is
#: a little late.
_CLEAR_S = 1e-3
#: Ringing begins where a record first exceeds this share of its top, at most so long before it.
_RISE, _RISE_S = 0.1, 10e-3
#: In samples: nearer than this is the same instant.
_SAME_SAMPLE = 1e-4


@dataclass(eq=False)
class HitSeries:
    """Series by a hit's place in the order of runs, and what happened on the way.

    `with_pulse` are the chosen hits with a pulse; of them `turned` show compression as negative and
    `double_hits` are followed by a second touch. `rejected` counts hits by channel that a quality
    check said not to use, and `checks` are these checks; `force_cells` are channels whose sum is
    the force; `of_impactor` names accelerometers that ride on it; `without_force` are hits whose
    accelerations were recorded and their force was not.
    """

    force: dict[int, Series] = field(default_factory=dict)
    accelerations: dict[int, dict[str, Series]] = field(default_factory=dict)
    rejected: Counter[str] = field(default_factory=Counter)
    checks: dict[str, frozenset[str]] = field(default_factory=dict)
    of_impactor: set[str] = field(default_factory=set)
    with_pulse: int = 0
    double_hits: int = 0
    turned: int = 0
    force_cells: int = 0
    without_force: int = 0


def read_series(
    session: Session,
    hits: Sequence[StoredImpact],
    chosen: Sequence[int],
    exclusions: QualityExclusions,
) -> HitSeries:
    """Force and accelerations of the hits at the places `chosen`. Of a hit without a pulse
    accelerations alone, and none where a force was recorded that could have shown one."""
    result, clear_s = HitSeries(), clear_times(hits)
    for i in chosen:
        hit = hits[i]
        rows = list_channels(session, hit.recording_id or 0)
        cells = [row for row in rows if row.quantity == "force"]
        if cells and not hit.has_pulse:
            continue
        on_plate = _on_plate(rows, result)
        if hit.has_pulse:
            after_s = min(_RINGING_S, clear_s[i])
            cuts = {
                row.name: _cut(session, row, hit.start_s or 0.0, _rest_s(row), after_s)
                for row in on_plate
            }
        else:
            cuts = _cut_ringing(
                session, [row for row in on_plate if not exclusions.rejects(hit, row.name)]
            )
        recorded = {name: cut for name, cut in cuts.items() if cut.values.size}
        rejected = [
            n
            for n, x in recorded.items()
            if exclusions.rejects(hit, n) or exclusions.cut_top(hit, n, x.values)
        ]
        if len(rejected) < len(recorded):
            result.accelerations[i] = {
                name: cut for name, cut in recorded.items() if name not in rejected
            }
        if hit.has_pulse:
            result.with_pulse += 1
            result.double_hits += hit.impact_id in exclusions.double_hits
            rejected_cells = [row.name for row in cells if exclusions.rejects(hit, row.name)]
            result.rejected.update([*rejected, *rejected_cells])
            for name in (*rejected, *rejected_cells):
                check_names = exclusions.checks(hit, name) or frozenset(_CUT_TOPS)
                result.checks[name] = result.checks.get(name, frozenset()) | check_names
            result.force_cells = max(result.force_cells, len(cells))
            if cells and not rejected_cells:  # a sum lacks what one cell of its array lacks
                _add_force(result, i, _contact_force(session, cells, hit, clear_s[i]))
        else:
            result.without_force += i in result.accelerations
    return result


def _on_plate(rows: Sequence[RecordedChannel], result: HitSeries) -> list[RecordedChannel]:
    """Accelerometers that do not ride on the impactor; those that do are noted in `result`."""
    accelerations = [row for row in rows if row.quantity == "acceleration"]
    riding = {row.name for row in accelerations if on_impactor(row.position)}
    result.of_impactor |= riding
    return [row for row in accelerations if row.name not in riding]


def _add_force(result: HitSeries, place: int, force: Series) -> None:
    """Turned where it shows compression as negative."""
    rise, fall = force.excursions
    result.turned += fall > rise
    result.force[place] = replace(force, values=-force.values) if fall > rise else force


def clear_times(hits: Sequence[StoredImpact]) -> dict[int, float]:
    """For each hit with a pulse, by its place in `hits`, for how long after its contact begins
    nothing else hits, s.

    One recording may hold several hits; infinite after the last one.
    """
    clear_s: dict[int, float] = {}
    following_s: dict[int | None, float] = {}
    starts = [(hit.start_s or 0.0, i) for i, hit in enumerate(hits) if hit.has_pulse]
    for start, i in sorted(starts, reverse=True):
        clear_s[i] = following_s.get(hits[i].recording_id, math.inf) - start - _CLEAR_S
        following_s[hits[i].recording_id] = start
    return clear_s


def _rest_s(row: RecordedChannel) -> float:
    """Rest that an acceleration is given before the contact."""
    return max(_REST_S, _REST_SAMPLES / row.sampling_rate_hz)


def _contact_force(
    session: Session, cells: Sequence[RecordedChannel], hit: StoredImpact, clear_s: float
) -> Series:
    """As recorded; the cells of an array are summed."""
    duration, rest = hit.contact_time_s or 0.0, _REST_SAMPLES / cells[0].sampling_rate_hz
    before, after = max(_FORCE_BEFORE * duration, rest), min(_FORCE_AFTER * duration, clear_s)
    cuts = [_cut(session, row, hit.start_s or 0.0, before, after) for row in cells]
    return replace(cuts[0], values=np.sum([cut.values for cut in cuts], axis=0))


def _cut_ringing(session: Session, rows: Iterable[RecordedChannel]) -> dict[str, Series]:
    """By channel the loudest ringing of a recording without a force; 0 s is where the first channel
    rises to it.

    Channels without a finite sample, and silent ones, are left out.
    """
    records = [
        (row, np.asarray(read_channel(session, row).readings, dtype=np.float64)) for row in rows
    ]
    audible = [
        (row, x) for row, x in records if np.isfinite(x).any() and np.nanmax(x) > np.nanmin(x)
    ]
    begins = [
        row.start_s + _begin_of_loudest(x, row.sampling_rate_hz) / row.sampling_rate_hz
        for row, x in audible
    ]
    return {
        row.name: _cut(session, row, min(begins), _rest_s(row), _RINGING_S) for row, _ in audible
    }


def _begin_of_loudest(values: Floats, rate_hz: float) -> int:
    """The sample from which a record (n,) stays within `_RISE_S` above a share of its largest
    deviation from rest."""
    deviation = np.abs(np.nan_to_num(values - np.nanmedian(values)))
    top = int(np.argmax(deviation))
    first = max(0, top - round(_RISE_S * rate_hz))
    return first + int(np.argmax(deviation[first : top + 1] > _RISE * deviation[top]))


def _cut(
    session: Session, row: RecordedChannel, start_s: float, before_s: float, after_s: float
) -> Series:
    """Samples from `before_s` before to `after_s` after `start_s`, which is on the recording's
    clock."""
    rate = row.sampling_rate_hz
    contact = (start_s - row.start_s) * rate
    first = max(0, math.ceil(contact - before_s * rate - _SAME_SAMPLE))
    stop = min(row.samples, max(first, math.floor(contact + after_s * rate + _SAME_SAMPLE) + 1))
    values = np.asarray(read_channel(session, row, first, stop).readings, dtype=np.float64)
    # Where both clocks share their samples, rounding alone must not shift the series.
    exact = round(contact) if abs(contact - round(contact)) < _SAME_SAMPLE else contact
    return Series(values, rate, (first - exact) / rate)
