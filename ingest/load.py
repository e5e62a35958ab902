"""`pyroshock ingest`: a campaign folder into the store, whole recordings at a time.

The rooms of this folder are the steps: `folder` reads the tables, `readers` the recordings,
`extraction` makes numbers of them, `storing` writes the rows. Each step knows those before it, and
none after it.

Everything that can be refused is refused before the first row is written. Each recording is then
read, judged and cut outside of any lock, and stored in one transaction with all its numbers and
series: a kill between two recordings leaves whole ones, and a repeat goes on where it stopped,
because what is stored is known by its hash.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from functools import partial
from pathlib import Path

from ..parallel.read_ahead import default_jobs, map_ahead
from ..schema.rehearsal import RolledBackStore
from ..schema.session import Store
from .errors import IngestError
from .extraction.derived_force import campaign_plate_response
from .extraction.impact_speed import TargetMotion
from .extraction.impulse_plausibility import (
    ENOUGH_IMPACTS,
    MomentumRatio,
    refuse_wrong_clock,
    refuse_wrong_unit,
)
from .extraction.recording import ExtractedRecording, UnreadableRecording, extract_or_exclude
from .extraction.row_plausibility import compare_with_rows, momentum_ratios
from .extraction.settings import ExtractionSettings
from .folder.bench_rules import UNIT_FACTOR
from .folder.campaign_tables import CampaignTables, NamedRecording, read_campaign_tables
from .folder.column_names import undeclared
from .readers.contents import reading_apart
from .readers.recording_files import RecordingFiles
from .storing.campaign_writer import CampaignWriter
from .storing.force_sign import warn_of_sign
from .storing.report import IngestReport

#: Called with (done, total, what) after each recording.
Progress = Callable[[int, int, str], None]


#: A recording whose reading takes longer than this, and longer than its size explains, never ends.
_PATIENCE_S, _SLOWEST_BYTES_PER_S = 120.0, 0.5e6

Results = Iterator[tuple[NamedRecording, ExtractedRecording | UnreadableRecording]]


def ingest_folder(
    store: Store,
    folder: Path,
    settings: ExtractionSettings | None = None,
    *,
    jobs: int | None = None,
    progress: Progress | None = None,
    free_factors: Collection[str] = (),
    confirmed: Collection[str] = (),
    again: Collection[str] = (),
    target_motion: TargetMotion | None = None,
) -> IngestReport:
    """Store a campaign folder: recordings that the store lacks are read, checked and extracted.

    Parameters:
        store: The store. A `RolledBackStore` is written to when all recordings are read, without
            samples, so that its transaction is short.
        folder: The campaign folder.
        settings: How pulses are extracted; by default `ExtractionSettings()`.
        jobs: The number of processes that read and extract; by default as many as pay.
        progress: Receives the recordings done, their number and what is being done.
        free_factors: Columns of `runs.csv` that are factors of their own though they resemble a
            known one.
        confirmed: Rules of `folder.bench_rules` that rows may break.
        again: Paths of recordings to store though they were discarded.
        target_motion: What is added to velocities that are integrated from the impactor's
            deceleration.

    Raises:
        IngestError: With nothing stored, for a campaign that is refused or holds nothing usable.
    """
    settings = settings or ExtractionSettings()
    # 1. Tables: campaign.toml, the table of runs and the modal table, held against each other, and
    # then against what the store has of the campaign.
    tables = read_campaign_tables(store, folder, free_factors, confirmed)
    _refuse_unnamed(again, tables)
    writer = CampaignWriter(store, tables, settings, again=again)
    # 2. Recordings that the store lacks.
    pending = [
        recording
        for recording in tables.recordings()
        if not writer.has_recording(recording.path, recording.sha256)
    ]
    # 3. Read, check and extract, in processes beside this one.
    results = _extracted(tables, settings, pending, jobs)
    # 4. Hold them against their rows, and store each in a transaction of its own, as it comes.
    if UNIT_FACTOR not in {*confirmed, *tables.file.confirmed}:
        results = _units_judged(tables, results)
    compare = partial(compare_with_rows, tables, target_motion=target_motion)
    unreadable = _store_recordings(store, writer, results, compare, len(pending), progress)
    writer.add_rows_without_recording()
    if unreadable and not writer.holds_anything():
        raise IngestError(
            f"{folder}: no usable recording; {unreadable[0].path}: {unreadable[0].reason}"
        )
    writer.set_aside(unreadable)
    # 5. What the recordings show together, and the report.
    warn_of_sign(store, tables.file.name)
    report = writer.report()
    report.findings += tables.remarks
    report.undeclared_factors = undeclared(
        {name: None for row in tables.rows for name in row.levels_by_factor}, tables.file.factors
    )
    return report


def _refuse_unnamed(again: Collection[str], tables: CampaignTables) -> None:
    for path in again:
        if not any(row.recording == path for row in tables.rows):
            raise IngestError(
                f"--again {path}: no row names this recording; give it as the table of runs does"
            )


def _extracted(
    tables: CampaignTables,
    settings: ExtractionSettings,
    pending: list[NamedRecording],
    jobs: int | None,
) -> Results:
    """Each pending recording with its numbers, or with the reason for which it cannot be read, in
    their order."""
    extract = partial(extract_or_exclude, tables, settings, campaign_plate_response(tables))
    processes = jobs or default_jobs(sum(recording.size_bytes for recording in pending))
    folder = tables.file.folder
    crashing = any(RecordingFiles(folder, recording.path).may_crash for recording in pending)
    isolation = reading_apart(_never_read, _patience_s, always=crashing)
    return map_ahead(extract, pending, processes, isolation)


def _never_read(named: NamedRecording) -> ExtractedRecording | UnreadableRecording:
    reason = f"crashed by it, or did not end within {_patience_s(named):.0f} s; the file is damaged"
    return UnreadableRecording.of(named, f"the library that reads it was {reason}")


def _patience_s(named: NamedRecording) -> float:
    """Far above what a recording takes (0.03 s for a megabyte), also from a slow network."""
    return _PATIENCE_S + named.size_bytes / _SLOWEST_BYTES_PER_S


def _units_judged(tables: CampaignTables, results: Results) -> Results:
    """`results`, the first of which are held back until enough impacts tell whether a unit is wrong
    throughout.

    Raises `IngestError` where one is, before anything is stored.
    """
    ratios: list[MomentumRatio] = []
    contact_times_s: list[float] = []
    held_back = []
    for named, outcome in results:
        held_back.append((named, outcome))
        if isinstance(outcome, ExtractedRecording):
            ratios += momentum_ratios(tables, outcome)
            contact_times_s += [pulse.contact_time_s for pulse in outcome.pulses]
        if len(ratios) >= ENOUGH_IMPACTS or len(held_back) >= ENOUGH_IMPACTS:
            break
    refuse_wrong_clock(tables.file.name, contact_times_s)
    refuse_wrong_unit(tables.file.name, ratios)
    yield from held_back
    yield from results


def _store_recordings(
    store: Store,
    writer: CampaignWriter,
    results: Results,
    compare: Callable[[ExtractedRecording], ExtractedRecording],
    total: int,
    progress: Progress | None,
) -> list[UnreadableRecording]:
    """Recordings into the store; those that cannot be read are given back. A rehearsal writes after
    all were read."""
    unreadable: list[UnreadableRecording] = []
    postponed: list[ExtractedRecording] = []
    rehearsal = isinstance(store, RolledBackStore)
    if not rehearsal:
        writer.add_facts()
    for done, (named, outcome) in enumerate(results, 1):
        if isinstance(outcome, UnreadableRecording):
            unreadable.append(outcome)
        elif rehearsal:
            postponed.append(compare(outcome).without_samples())
        else:
            writer.add_recording(compare(outcome))
        if progress:
            progress(done, total, named.path)
    if rehearsal:
        writer.add_facts()
    for recording in postponed:
        writer.add_recording(recording)
    return unreadable
