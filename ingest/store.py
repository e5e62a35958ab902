"""One campaign's rows in the store: what is there, and one transaction for each recording that is
added."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any

from sqlalchemy import select
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from ..schema.campaigns import Campaign
from ..schema.configurations import configuration_ids
from ..schema.impacts import ChannelFigures, Impact, Pulse, Shot
from ..schema.known_factors import NONE
from ..schema.recordings import SET_ASIDE, STORED, QualityFinding, RecordedChannel, Recording
from ..schema.removal.part import Part
from ..schema.row_keys import reserve_ahead
from ..schema.series import write_series
from ..schema.session import Store
from ..schema.tables import metadata
from ..signals.channel import on_impactor
from ..signals.checks.base import Finding
from .additions import Additions, add_facts, refuse_changed_channels, row_additions
from .channel_figures import figure_rows
from .errors import IngestError
from .excluded_recordings import (
    DiscardedRecordings,
    UnreadableRecording,
    delete_rejected,
    store_rejected,
)
from .folder import CampaignFile
from .gunshot import laser_channel
from .impact_speed import TargetMotion
from .modes import ModalTableFile
from .plausibility import check_impulse, check_other_campaigns, check_same_samples, check_tip
from .processing import ProcessedRecording
from .report import IngestReport
from .rows import (
    bench_additions,
    campaign_row,
    channel_values,
    finding_values,
    hit_velocity,
    impact_values,
    plate_mass,
    pulse_values,
    settings_id,
    shot_values,
    struck_plate,
)
from .runs import FILE, MatchedImpact, RunRow
from .settings import ExtractionSettings
from .shot_differences import check_shot
from .stored_rows import (
    KnownRecording,
    KnownRow,
    RowDifferences,
    known_recordings,
    known_rows,
    recordings_alike,
    refuse_changed_rows,
    refuse_other_modes,
    stored_elsewhere,
    way_out,
)
from .unit_plausibility import MomentumRatio


@dataclass(frozen=True)
class Added:
    """Rows that one transaction adds."""

    recordings: int = 0
    impacts: int = 0
    shots: int = 0


class CampaignStore:
    """The rows of one campaign. Raises `IngestError` when the store holds other values under the
    same numbers.

    `again` are recordings to store though they were discarded; `replaced` is one that goes before
    anything is written; `target_motion` is added to integrated velocities.
    """

    def __init__(
        self,
        store: Store,
        file: CampaignFile,
        modes: ModalTableFile | None,
        rows: tuple[RunRow, ...],
        settings: ExtractionSettings,
        *,
        again: Collection[str] = (),
        replaced: str | None = None,
        target_motion: TargetMotion | None = None,
    ) -> None:
        self._store = store
        self._target_motion = target_motion
        self._file = file
        self._modes = modes
        self._rows = rows
        self._settings = settings
        self._replaced = replaced
        self._report = IngestReport(file.name)
        self._bench_additions: list[str] = []
        self._recordings, self._known = store.read(self._stored)
        self._plate_mass_kg = (
            None if file.plate is None else store.read(partial(plate_mass, part=file.plate))
        )
        self._discarded = store.read(lambda session: DiscardedRecordings(session, file.name, again))
        self._additions = store.read(self._row_additions)

    def has_recording(self, path: str, sha256: str) -> bool:
        """Whether this recording is stored, or was discarded. One that was set aside is not stored:
        what mends it may be a row or a channel.

        Raises `IngestError` for a stored recording whose file has changed since: raw data are not
        replaced silently.
        """
        stored = self._recordings.get(path)
        if stored is None:
            return self._discarded.withhold(path, sha256)
        if stored.status == SET_ASIDE:
            return False
        if stored.sha256 != sha256:
            raise IngestError(
                f"{path}: the file has changed since it was ingested (SHA-256 "
                f"{stored.sha256[:12]}… is stored, {sha256[:12]}… found); give the new recording a "
                f"name of its own, {way_out(self._file.name, path)}"
            )
        return True

    def add_facts(self) -> None:
        """Store the facts that the stored campaign lacks and its folder has, before anything else
        is added."""
        if not self._additions:
            return

        def add(session: Session) -> None:
            add_facts(self._store, session, self._file, self._modes, self._additions)

        self._store.write(add, idempotent=True)
        self._report.added_facts = self._additions.words(self._file.kind)

    def add_recording(self, done: ProcessedRecording, hits: list[MatchedImpact]) -> None:
        """Store one recording with its series, impacts, shots, pulses and findings, or nothing of
        it."""

        def add(session: Session) -> Added:
            if self._stored_meanwhile(session, done):
                return Added()
            return self.write(session, done, hits)

        self._added(self._write_rows(done.path, add))

    def add_rows_without_recording(self) -> None:
        """Rows that carry their values themselves: one transaction for all."""
        rows = [
            row
            for row in self._rows
            if not row.recording and (row.run, row.repetition) not in self._known
        ]
        if not rows:
            return

        def add(session: Session) -> Added:
            campaign = campaign_row(session, self._file, self._modes)
            stored = known_rows(
                session, campaign
            )  # of another process too, that has been here since we looked
            hits = [
                MatchedImpact(row, row.repetition, None)
                for row in rows
                if (row.run, row.repetition) not in stored
            ]
            return self._add_hits(session, campaign, hits, None, None, {})[0]

        self._added(self._write_rows(FILE, add))

    def set_aside(self, damaged: list[UnreadableRecording]) -> None:
        """Remember the recordings that could not be read: their rows say why, and nothing else of
        them is stored."""
        new = [
            d
            for d in damaged
            if self._recordings.get(d.path) != KnownRecording(d.sha256, SET_ASIDE, d.reason)
        ]
        if new:
            self._store.write(lambda session: self._write_set_aside(session, new), idempotent=True)
        self._report.set_aside = [{"recording": d.path, "reason": d.reason} for d in damaged]

    def holds_anything(self) -> bool:
        """Whether the store has any impact or shot of this campaign."""
        return self._store.read(self._any_hit)

    def report(self) -> IngestReport:
        """Totals and findings of the campaign as it stands now."""
        self._store.read(self._report.sum_up)
        self._report.findings += [recording.finding() for recording in self._discarded.withheld]
        return self._report

    def _stored(
        self, session: Session
    ) -> tuple[dict[str, KnownRecording], dict[tuple[int, int], KnownRow]]:
        """Recordings and rows of this campaign that are there. Raises `IngestError` for one with
        another bench."""
        campaign = session.scalars(
            select(Campaign).where(Campaign.name == self._file.name)
        ).one_or_none()
        if campaign is not None:
            self._bench_additions = bench_additions(session, campaign, self._file)
            refuse_changed_channels(session, campaign, self._file)
            refuse_other_modes(session, campaign, self._modes)
        recordings, rows = known_recordings(session, campaign), known_rows(session, campaign)
        if self._replaced is not None:
            recordings.pop(self._replaced, None)
            rows = {number: row for number, row in rows.items() if row.recording != self._replaced}
        return recordings, rows

    def _any_hit(self, session: Session) -> bool:
        campaign = session.scalar(select(Campaign.id).where(Campaign.name == self._file.name))
        return campaign is not None and any(
            session.scalar(select(table.id).where(table.campaign_id == campaign).limit(1))
            is not None
            for table in (Impact, Shot)
        )

    def _write_rows(self, what: str, add: Callable[[Session], Added]) -> Added:
        """Rows have numbers of their own, by which they are found when they are written again."""
        try:
            return self._store.write(add, idempotent=True)
        except IntegrityError as error:
            raise IngestError(f"{what}: refused by the store: {error.orig}") from error

    def _added(self, added: Added) -> None:
        for name, count in asdict(added).items():
            self._report.added[name] += count

    def _write_set_aside(self, session: Session, damaged: Sequence[UnreadableRecording]) -> None:
        campaign = campaign_row(session, self._file, self._modes)
        for item in sorted(damaged, key=lambda item: item.path):
            delete_rejected(session, campaign, item.path)
            store_rejected(session, campaign, self._file, item)

    def _row_additions(self, session: Session) -> Additions:
        """Facts that the store lacks. Raises `IngestError` where a row says otherwise than the
        stored one."""
        differences = RowDifferences(self._file.kind)
        refuse_changed_rows(
            session, self._file, self._rows, self._known, self._recordings, differences
        )
        return Additions(
            tuple(self._bench_additions),
            row_additions(session, self._rows, self._known, differences),
        )

    def write(self, session: Session, done: ProcessedRecording, hits: list[MatchedImpact]) -> Added:
        """The rows of one recording within a transaction of the caller's, who knows that it is not
        stored."""
        campaign = campaign_row(session, self._file, self._modes)
        if self._target_motion is not None:
            done = self._with_target_motion(session, done, hits, self._target_motion)
        delete_rejected(session, campaign, done.path)
        self._reserve_keys(session, done, hits)
        recording = Recording(
            campaign_id=campaign.id,
            path=done.path,
            sha256=done.sha256,
            size_bytes=done.size_bytes,
            format=done.format,
            status=STORED,
        )
        session.add(recording)
        session.flush()
        channels = self._add_channels(session, recording.id, done)
        added, impacts = self._add_hits(session, campaign, hits, recording.id, done, channels)
        doubted = self._implausible(session, recording, channels, hits, done)
        findings = [
            finding_values(finding, recording.id, channels, impacts)
            for finding in (*done.findings, *doubted)
        ]
        self._store.add_rows(session, QualityFinding, findings)
        part = Part(campaign.id, campaign.name, recording.id, done.path)
        self._discarded.settle(session, part, done.sha256, self._store.written_by(session))
        return replace(added, recordings=1)

    def _reserve_keys(
        self, session: Session, done: ProcessedRecording, hits: Sequence[MatchedImpact]
    ) -> None:
        """Of all rows of a recording, in one statement."""
        impacts = [hit for hit in hits if self._has_impact(hit, done)]
        counts = {
            Recording: 1,
            RecordedChannel: len(done.series),
            Impact: len(impacts),
            Pulse: sum(hit.pulse is not None for hit in impacts),
            ChannelFigures: sum(map(len, done.figures)) if len(done.figures) == len(impacts) else 0,
            Shot: len(hits) if self._file.kind == "gun" else 0,
        }
        tables = {metadata.tables[model.__tablename__]: count for model, count in counts.items()}
        reserve_ahead(session.connection(), tables)

    def _with_target_motion(
        self,
        session: Session,
        done: ProcessedRecording,
        hits: Sequence[MatchedImpact],
        add: TargetMotion,
    ) -> ProcessedRecording:
        """The recording with the target's motion in its integrated velocities, where their plates
        are known."""
        speeds = list(done.speeds)
        for hit in hits:
            speed = speeds[hit.pulse] if hit.pulse is not None and speeds else None
            plate = struck_plate(session, self._file.plate, hit.row) if speed is not None else None
            if speed is not None and plate is not None and hit.pulse is not None:
                speeds[hit.pulse] = add(speed, done.pulses[hit.pulse].force_points_n, plate)
        return replace(done, speeds=tuple(speeds))

    def _implausible(
        self,
        session: Session,
        recording: Recording,
        channels: dict[str, int],
        hits: list[MatchedImpact],
        done: ProcessedRecording,
    ) -> list[Finding]:
        """What mass, velocity and tip of the rows say against the pulses, and recordings of the
        same samples."""
        name = next(
            (s.channel.name for s in done.series if s.channel.quantity == "force"),
            next(iter(channels)),
        )
        findings = [
            check_same_samples(recordings_alike(session, recording), name),
            check_other_campaigns(stored_elsewhere(session, recording), name),
        ]
        for hit in hits:
            if hit.pulse is not None:
                findings.append(check_tip(hit.row.number("tip_radius"), hit.pulse, name))
                mass_kg, velocity = self._mass_kg(hit.row), hit_velocity(hit.row, hit, done)
                if mass_kg is not None and velocity is not None:
                    findings.append(
                        check_impulse(
                            done.pulses[hit.pulse],
                            mass_kg,
                            velocity,
                            hit.pulse,
                            name,
                            held=self._file.hammer is not None,
                            integrated=_is_integrated(hit, done),
                            behind_anvil=self._is_behind_anvil(hit.row, done),
                            plate_mass_kg=self._plate_mass_kg,
                        )
                    )
        if self._file.kind == "gun" and len(hits) == 1:  # of several shots the measurement is one's
            channels_of = [series.channel for series in done.series]
            laser = laser_channel(channels_of)
            tank = next(
                (channel.name for channel in channels_of if channel.quantity == "pressure"), None
            )
            findings += check_shot(hits[0].row, done.shot, laser.name if laser else None, tank)
        return [finding for finding in findings if finding is not None]

    def momentum_ratios(
        self, done: ProcessedRecording, hits: Sequence[MatchedImpact]
    ) -> list[MomentumRatio]:
        """Impulse over mass times velocity of the hits whose mass and velocity are known."""
        ratios = []
        for hit in hits:
            mass_kg = self._mass_kg(hit.row)
            velocity = None if hit.pulse is None else hit_velocity(hit.row, hit, done)
            if (
                hit.pulse is not None
                and mass_kg is not None
                and velocity is not None
                and mass_kg * velocity > 0.0
            ):
                plate = self._plate_mass_kg
                share = 1.0 if plate is None else plate / (plate + mass_kg)
                pulse = done.pulses[hit.pulse]
                ratios.append(
                    MomentumRatio(
                        pulse.impulse_n_s / (mass_kg * velocity),
                        _is_integrated(hit, done),
                        share,
                        self._is_behind_anvil(hit.row, done),
                        _is_by_laser(hit, done),
                    )
                )
        return ratios

    def _is_behind_anvil(self, row: RunRow, done: ProcessedRecording) -> bool:
        """Whether the force of a row is measured on the target's side of an anvil: no sensor of it
        rides on the impactor."""
        anvil = row.levels_by_factor.get("anvil_material")
        if self._file.hammer is not None or anvil is None or anvil.label == NONE:
            return False
        forces = [series.channel for series in done.series if series.channel.quantity == "force"]
        return not any(on_impactor(channel.sensor.position) for channel in forces)

    def _mass_kg(self, row: RunRow) -> float | None:
        return self._file.hammer.mass_kg if self._file.hammer else row.number("bullet_mass")

    def _add_channels(
        self, session: Session, recording: int, done: ProcessedRecording
    ) -> dict[str, int]:
        """Channels with their series; their keys by name."""
        rows = [{"recording_id": recording, **channel_values(series)} for series in done.series]
        names = [series.channel.name for series in done.series]
        keys = dict(zip(names, self._store.add_rows(session, RecordedChannel, rows), strict=True))
        for series in done.series:
            name, frames = series.channel.name, series.encoded.frames
            if frames:  # a dry run has none
                write_series(session, keys[name], frames, self._store.written_by(session))
        return keys

    def _add_hits(
        self,
        session: Session,
        campaign: Campaign,
        hits: Sequence[MatchedImpact],
        recording: int | None,
        done: ProcessedRecording | None,
        channels: dict[str, int],
    ) -> tuple[Added, dict[int, int]]:
        """Impacts and shots of hits, a table at a time; also the impact's key by the number of its
        pulse.

        `channels` of the recording: their keys by name.
        """
        configurations = configuration_ids(session, [hit.row.levels for hit in hits])
        common = [
            {
                "campaign_id": campaign.id,
                "run": hit.row.run,
                "repetition": hit.repetition,
                "configuration_id": configuration,
                "recording_id": recording,
            }
            for hit, configuration in zip(hits, configurations, strict=True)
        ]
        met = [
            (hit, own) for hit, own in zip(hits, common, strict=True) if self._has_impact(hit, done)
        ]
        keys = self._add_impacts(
            session, [{**own, **impact_values(hit.row, hit, done)} for hit, own in met]
        )
        impacts = {
            hit.pulse: keys[hit.row.run, hit.repetition] for hit, _ in met if hit.pulse is not None
        }
        if done and impacts:
            settings = settings_id(session, self._settings)
            pulses = [
                pulse_values(done.pulses[pulse], impact, settings)
                for pulse, impact in impacts.items()
            ]
            self._store.add_rows(session, Pulse, pulses)
        if done and len(done.figures) == len(hits) == len(met):
            order = [keys[hit.row.run, hit.repetition] for hit in hits]
            self._store.add_rows(
                session, ChannelFigures, figure_rows(done.figures, order, channels)
            )
        if self._file.kind != "gun":
            return Added(impacts=len(met)), impacts
        shots = [
            {
                **own,
                "impact_id": keys.get((hit.row.run, hit.repetition)),
                **shot_values(hit.row, done),
            }
            for hit, own in zip(hits, common, strict=True)
        ]
        self._store.add_rows(session, Shot, shots)
        return Added(impacts=len(met), shots=len(shots)), impacts

    def _add_impacts(
        self, session: Session, rows: Sequence[dict[str, Any]]
    ) -> dict[tuple[int, int], int]:
        """Impacts of one recording, or of none; their keys by run and repetition."""
        keys = self._store.add_rows(session, Impact, rows)
        return {(row["run"], row["repetition"]): key for row, key in zip(rows, keys, strict=True)}

    def _has_impact(self, hit: MatchedImpact, done: ProcessedRecording | None) -> bool:
        """Whether a hit is an impact; a shot that met no force channel is none."""
        if self._file.kind != "gun":
            return True
        return bool(done and done.has_force) or hit.row.impact_velocity_m_s is not None

    def _stored_meanwhile(self, session: Session, done: ProcessedRecording) -> bool:
        """Whether another process has stored this very recording since we looked."""
        query = (
            select(Recording.id)
            .join(Campaign)
            .where(
                Campaign.name == self._file.name,
                Recording.path == done.path,
                Recording.sha256 == done.sha256,
                Recording.status == STORED,
            )
        )
        return session.scalar(query) is not None


def _is_integrated(hit: MatchedImpact, done: ProcessedRecording) -> bool:
    """Whether a hit's velocity is that of the impactor's own acceleration."""
    return (
        hit.row.impact_velocity_m_s is None
        and hit.pulse is not None
        and any(done.speeds[hit.pulse : hit.pulse + 1])
    )


def _is_by_laser(hit: MatchedImpact, done: ProcessedRecording) -> bool:
    """Whether a hit's velocity is the muzzle velocity by the laser."""
    reported = hit.row.impact_velocity_m_s is not None or hit.row.measured_velocity_m_s is not None
    return not reported and not _is_integrated(hit, done) and done.shot is not None
