"""One recording, from its files to every number that will be stored of it, step by step, without a
database.

Pure in the files and the settings, so that it can run in any process, before any lock is taken.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from ...schema.recordings import CALIBRATION, MUZZLE_VELOCITY, VALVE_OPENING
from ...schema.series import EncodedSeries, encode_series
from ...signals.channel import Channel, Sensor
from ...signals.checks.base import Finding
from ..errors import IngestError
from ..folder.campaign_file import CampaignFile
from ..folder.campaign_tables import CampaignTables, NamedRecording
from ..folder.runs_table import RunRow
from ..readers import AS_IN_FILE, ReadingOptions, RecordingError
from ..readers.contents import one_line
from ..readers.recording_files import RecordingFiles
from .channel_figures import ImpactFigures, measure_channels
from .channels import read_recording, total_force
from .derived_force import TransferFunctions, derived_force
from .gunshot import ShotMeasurement, laser_channel, measure_shot
from .impact_speed import ImpactSpeed, impact_speeds
from .pulses import ExtractedPulse, Hits, find_hits
from .record_checks import check_recording
from .row_matching import MatchedImpact, expected_hits, match
from .settings import ExtractionSettings


@dataclass(frozen=True)
class EncodedChannel:
    """A channel without its samples, which are heavy to hand from process to process, and their
    compressed frames."""

    channel: Channel  # `recorded` is empty, of the samples' dtype
    encoded: EncodedSeries

    @classmethod
    def of(cls, channel: Channel) -> EncodedChannel:
        """A channel with its samples compressed. The header holds the calibration of the sensor, as
        it is stored.

        Parameters:
            channel: The channel as it was recorded.
        """
        recorded, calibration = channel.recorded, channel.sensor.calibration
        header = channel.header
        if calibration is not None:
            header = {**header, CALIBRATION: calibration.as_json()}
        without_samples = replace(channel, recorded=recorded[:0].copy(), header=header)
        return cls(without_samples, encode_series(recorded))


@dataclass(frozen=True)
class ExtractedRecording:
    """What a recording's files gave. `speeds` has one entry per pulse (None where no impactor
    acceleration was recorded), `figures` one per impact (of its acceleration channels), in the
    order of time. `hits` are its impacts and shots, each with its row; `row_findings` what speaks
    against the rows."""

    path: str
    sha256: str
    size_bytes: int
    format: str
    series: tuple[EncodedChannel, ...]
    pulses: tuple[ExtractedPulse, ...]
    speeds: tuple[ImpactSpeed | None, ...]
    shot: ShotMeasurement | None
    findings: tuple[Finding, ...]
    has_force: bool
    figures: tuple[ImpactFigures, ...] = ()
    hits: tuple[MatchedImpact, ...] = ()
    row_findings: tuple[Finding, ...] = ()

    @property
    def main_channel(self) -> str:
        """The channel that findings on the whole recording are told of: its force, else its
        first."""
        names = [series.channel.name for series in self.series]
        forces = [s.channel.name for s in self.series if s.channel.quantity == "force"]
        return (forces or names)[0]

    def speed_of(self, hit: MatchedImpact) -> ImpactSpeed | None:
        """The velocity of a hit by the impactor's own acceleration; None where it has none.

        Parameters:
            hit: One of the `hits` of the recording.
        """
        return None if hit.pulse is None or not self.speeds else self.speeds[hit.pulse]

    def without_samples(self) -> ExtractedRecording:
        """The same without the frames of its series: all that a dry run writes."""
        series = (
            replace(channel, encoded=replace(channel.encoded, frames=[])) for channel in self.series
        )
        return replace(self, series=tuple(series))


@dataclass(frozen=True)
class UnreadableRecording:
    """A recording that could not be read whole, and why."""

    path: str
    sha256: str
    size_bytes: int
    reason: str

    @classmethod
    def of(cls, named: NamedRecording, reason: str) -> UnreadableRecording:
        """A recording of the folder that could not be read whole.

        Parameters:
            named: The recording as the rows of `runs.csv` name it.
            reason: The message of the error. It is put on one line and shortened.
        """
        return cls(named.path, named.sha256, named.size_bytes, one_line(reason))


def extract_or_exclude(
    tables: CampaignTables,
    settings: ExtractionSettings,
    plate: TransferFunctions | None,
    named: NamedRecording,
) -> ExtractedRecording | UnreadableRecording:
    """Extract one recording, and tell its hits apart. Runs in any process.

    Parameters:
        tables: The tables of the campaign folder.
        settings: How pulses are cut out.
        plate: The transfer functions from which the contact force is derived; None where it is
            recorded or there is none.
        named: The recording, with the rows of `runs.csv` that name it.

    Returns:
        What its files gave, or why they could not be read or processed.

    Raises:
        IngestError: For a fault of the campaign, not of this recording.
        MemoryError: For a fault of the machine.
        OSError: For a fault of the machine.
    """
    file, rows = tables.file, list(named.rows)
    try:
        recording = extract_recording(
            file.folder,
            named.path,
            file.sensors,
            settings,
            expected=expected_hits(rows, tables.rows),
            rows=_impact_rows(file, rows),
            bullet_length_m=rows[0].bullet_length_m,
            bullet_length_u_m=rows[0].bullet_length_u_m,
            sha256=named.sha256,
            reading=file.reading,
            plate=plate,
        )
        hits = match(named.path, rows, len(recording.pulses), tables.rows)
        return replace(recording, hits=tuple(hits))
    except RecordingError as error:
        return UnreadableRecording.of(named, str(error))
    except (
        MemoryError,
        OSError,
        IngestError,
    ):  # of the machine or of the campaign, not of this recording
        raise
    except Exception as error:  # noqa: BLE001
        # whatever a library says of one recording, the others are stored
        reason = (
            f"{named.path}: could not be processed ({type(error).__name__}: "
            f"{error}); look at its samples"
        )
        return UnreadableRecording.of(named, reason)


def _impact_rows(file: CampaignFile, rows: list[RunRow]) -> int:
    """Rows that are impacts without a contact force: a gun's are shots, unless they report an
    impact's velocity."""
    if file.kind != "gun" or all(row.impact_velocity_m_s is not None for row in rows):
        return len(rows)
    return 0


def extract_recording(
    folder: Path,
    path: str,
    sensors: Mapping[str, Sensor],
    settings: ExtractionSettings,
    *,
    expected: int | None = None,
    rows: int = 1,
    bullet_length_m: float | None = None,
    bullet_length_u_m: float | None = None,
    sha256: str | None = None,
    reading: ReadingOptions = AS_IN_FILE,
    plate: TransferFunctions | None = None,
) -> ExtractedRecording:
    """Read the files of a recording, judge them, cut out their pulses and measure their
    accelerations.

    Parameters:
        folder: The campaign folder.
        path: The path of the recording as it is stored, relative to the folder; several files are
            parted by semicolons.
        sensors: The declared sensors by channel.
        settings: How pulses are cut out.
        expected: The number of hits of the force to keep; by default (None) all.
        rows: The number of rows of runs.csv that are impacts in this recording; by default 1.
            Without a force, as many shocks are looked for in the accelerations.
        bullet_length_m: The length of the bullet that the laser saw; by default unknown, which
            gives no muzzle velocity.
        bullet_length_u_m: Its standard uncertainty; by default that of `muzzle_velocity`.
        sha256: The hash of the files where it is known; by default it is calculated.
        reading: What a laboratory says of its files where these do not; by default nothing.
        plate: The transfer functions by which the contact force is derived from the accelerations;
            by default (None) no force is derived.

    Raises:
        RecordingError: When one of the files cannot be read whole.
    """
    files = RecordingFiles(folder, path, reading)
    digest = sha256 or files.sha256()
    channels, unread = read_recording(files, sensors)
    if plate is not None:
        derived, remark = derived_force(channels, plate, settings)
        channels += [derived] if derived is not None else []
        unread.append(remark)
    hits = hits_of(channels, settings, expected)
    pulses = hits.pulses
    force = total_force(channels)
    speeds, conditioning = impact_speeds(channels, pulses, settings, force)
    shot, shot_findings = measure_shot(channels, bullet_length_m, bullet_length_u_m)
    figures = measure_channels(channels, hits, rows, settings)
    findings = (
        check_recording(channels, hits)
        + unread
        + conditioning
        + shot_findings
        + list(figures.findings)
    )
    return ExtractedRecording(
        path=path,
        sha256=digest,
        size_bytes=files.size_bytes,
        format=files.format,
        series=tuple(EncodedChannel.of(c) for c in _with_readings(channels, shot)),
        pulses=pulses,
        speeds=speeds,
        shot=shot,
        findings=tuple(findings),
        has_force=any(c.quantity == "force" for c in channels),
        figures=figures.impacts,
    )


def hits_of(channels: list[Channel], settings: ExtractionSettings, expected: int | None) -> Hits:
    """The pulses of a recording, and the hits of the same record that were left out.

    Parameters:
        channels: The channels of the recording. Without a force channel there are no hits.
        settings: How pulses are cut out.
        expected: The number of hits to keep, the largest ones, where the record has more; None
            keeps all.
    """
    force = total_force(channels)
    if force is None:
        return Hits(())
    values, channel = force
    return find_hits(
        values, channel.sampling_rate_hz, settings, start_s=channel.start_s, expected=expected
    )


def _with_readings(channels: Sequence[Channel], shot: ShotMeasurement | None) -> list[Channel]:
    """The channels as they are stored: the header of the tank's pressure says when the valve
    opened, and the laser's which velocity it shows, which a row of runs.csv may state otherwise."""
    if shot is None:
        return list(channels)
    added: dict[str, dict[str, object]] = {}
    if shot.valve_opening is not None:
        tank = next(channel.name for channel in channels if channel.quantity == "pressure")
        added[tank] = {VALVE_OPENING: asdict(shot.valve_opening)}
    laser = laser_channel(list(channels))
    if laser is not None and shot.velocity_m_s is not None:
        velocity = {"velocity_m_s": shot.velocity_m_s, "velocity_u_m_s": shot.velocity_u_m_s}
        added.setdefault(laser.name, {})[MUZZLE_VELOCITY] = velocity
    return [
        replace(c, header={**c.header, **added[c.name]}) if c.name in added else c for c in channels
    ]
