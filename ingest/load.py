"""`pyroshock ingest`: a campaign folder into the store, whole recordings at a time.

Everything that can be refused is refused before the first row is written. Each recording is then
read, judged and cut outside of any lock, and stored in one transaction with all its numbers and
series: a kill between two recordings leaves whole ones, and a repeat goes on where it stopped,
because what is stored is known by its hash.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from ..parallel.read_ahead import default_jobs, map_ahead
from ..schema.benches import material_names
from ..schema.known_factors import MaterialNames
from ..schema.rehearsal import RolledBackStore
from ..schema.session import Store
from ..signals.channel import on_impactor
from .channel_mistakes import warn_of_sign
from .column_names import undeclared
from .derived_force import TransferFunctions, plate_response
from .errors import Faults, IngestError
from .excluded_recordings import UnreadableRecording
from .folder import FILE as CAMPAIGN
from .folder import CampaignFile, read_campaign_file, stated_kind_and_factors
from .impact_speed import TargetMotion
from .modes import ModalTableFile, read_modal_table
from .plausibility import Told, check_bench
from .processing import ProcessedRecording, process_recording
from .readers import RecordingError
from .readers.contents import one_line, reading_apart
from .recording_files import RecordingFiles
from .report import IngestReport
from .runs import MatchedImpact, RunRow, expected_hits, match, read_runs
from .settings import ExtractionSettings
from .store import CampaignStore
from .unit_plausibility import ENOUGH_IMPACTS, MomentumRatio, refuse_wrong_clock, refuse_wrong_unit
from .unit_plausibility import RULE as UNIT_FACTOR

#: Called with (done, total, what) after each recording.
Progress = Callable[[int, int, str], None]


#: A recording whose reading takes longer than this, and longer than its size explains, never ends.
_PATIENCE_S, _SLOWEST_BYTES_PER_S = 120.0, 0.5e6

Outcome = tuple[list[MatchedImpact], ProcessedRecording] | UnreadableRecording


@dataclass(frozen=True)
class PendingRecording:
    """One recording to do, with the rows of `runs.csv` that name it."""

    path: str
    rows: tuple[RunRow, ...]
    sha256: str
    size_bytes: int


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
    """Ingest the campaign in `folder`; `jobs` processes read and extract (None: what pays), and
    this one writes.

    `target_motion` is added to velocities that are integrated from the impactor's deceleration.
    `free_factors` are columns of `runs.csv` that are factors of their own though they resemble a
    known one, and `confirmed` rules of `bench_rules` that rows may break; `again` are recordings to
    store though they were discarded. A `RolledBackStore` is written to when all recordings are
    read, without samples: its transaction is short. Raises `IngestError`, with nothing stored, for
    a campaign that is refused or holds nothing usable.
    """
    settings = settings or ExtractionSettings()
    # 1. Tables: campaign.toml, the table of runs and the modal table, held against each other.
    file, rows, modes, remarks = read_campaign_tables(store, folder, free_factors, confirmed)
    _refuse_unnamed(again, rows)
    target = CampaignStore(
        store, file, modes, rows, settings, again=again, target_motion=target_motion
    )
    # 2. Recordings that the store lacks.
    pending = _pending_recordings(file, rows, target)
    # 3. Read, check and extract, in processes beside this one.
    results = _processed(folder, file, rows, settings, pending, jobs)
    # 4. Store each recording in a transaction of its own, as it comes.
    if UNIT_FACTOR not in {*confirmed, *file.confirmed}:
        results = _units_judged(file.name, target, results)
    damaged = _store_recordings(store, target, results, len(pending), progress)
    target.add_rows_without_recording()
    if damaged and not target.holds_anything():
        raise IngestError(
            f"{file.folder}: no usable recording; {damaged[0].path}: {damaged[0].reason}"
        )
    target.set_aside(damaged)
    # 5. What the recordings show together, and the report.
    warn_of_sign(store, file.name)
    report = target.report()
    report.findings += remarks
    report.undeclared_factors = undeclared(
        {name: None for row in rows for name in row.levels_by_factor}, file.factors
    )
    return report


def _processed(
    folder: Path,
    file: CampaignFile,
    rows: tuple[RunRow, ...],
    settings: ExtractionSettings,
    pending: list[PendingRecording],
    jobs: int | None,
) -> Iterator[tuple[PendingRecording, Outcome]]:
    """Each pending recording with its hits, or with the reason for which it cannot be read, in
    their order."""
    plate = campaign_plate_response(file, rows)
    processes = jobs or default_jobs(sum(recording.size_bytes for recording in pending))
    crashing = any(RecordingFiles(folder, recording.path).may_crash for recording in pending)
    isolation = reading_apart(_unreadable_recording, _patience_s, always=crashing)
    return map_ahead(partial(process, file, rows, settings, plate), pending, processes, isolation)


def _units_judged(
    campaign: str, target: CampaignStore, results: Iterator[tuple[PendingRecording, Outcome]]
) -> Iterator[tuple[PendingRecording, Outcome]]:
    """`results`, the first of which are held back until enough impacts tell whether a unit is wrong
    throughout.

    Raises `IngestError` where one is, before anything is stored.
    """
    ratios: list[MomentumRatio] = []
    contact_times_s: list[float] = []
    held_back = []
    for pending, outcome in results:
        held_back.append((pending, outcome))
        if not isinstance(outcome, UnreadableRecording):
            ratios += target.momentum_ratios(outcome[1], outcome[0])
            contact_times_s += [pulse.contact_time_s for pulse in outcome[1].pulses]
        if len(ratios) >= ENOUGH_IMPACTS or len(held_back) >= ENOUGH_IMPACTS:
            break
    refuse_wrong_clock(campaign, contact_times_s)
    refuse_wrong_unit(campaign, ratios)
    yield from held_back
    yield from results


def _store_recordings(
    store: Store,
    target: CampaignStore,
    results: Iterator[tuple[PendingRecording, Outcome]],
    total: int,
    progress: Progress | None,
) -> list[UnreadableRecording]:
    """Recordings into the store; those that cannot be read are given back. A rehearsal writes after
    all were read."""
    damaged: list[UnreadableRecording] = []
    postponed: list[tuple[list[MatchedImpact], ProcessedRecording]] = []
    rehearsal = isinstance(store, RolledBackStore)
    if not rehearsal:
        target.add_facts()
    for done, (pending, outcome) in enumerate(results, 1):
        if isinstance(outcome, UnreadableRecording):
            damaged.append(outcome)
        else:
            hits, recording = outcome
            if rehearsal:
                postponed.append((hits, recording.without_samples()))
            else:
                target.add_recording(recording, hits)
        if progress:
            progress(done, total, pending.path)
    if rehearsal:
        target.add_facts()
    for hits, recording in postponed:
        target.add_recording(recording, hits)
    return damaged


def read_campaign_tables(
    store: Store, folder: Path, free_factors: Collection[str] = (), confirmed: Collection[str] = ()
) -> tuple[CampaignFile, tuple[RunRow, ...], ModalTableFile | None, list[Told]]:
    """A campaign folder's card, its table of runs, its modal table, and what the rules of a bench
    say of the rows.

    Raises `IngestError` with the faults of all of them.
    """
    with store.reading() as session:
        names = material_names(session)
    faults = Faults()
    file = faults.attempt(_campaign, folder, names)
    if file is None and not (folder / CAMPAIGN).is_file():
        faults.refuse()
    kind, factors = (file.kind, file.factors) if file else stated_kind_and_factors(folder)
    rows = read_runs(folder, kind, names, factors, free_factors, faults)
    for row in rows:
        if row.recording:
            faults.of(_refuse_unknown_format, folder, row)
    remarks = faults.of(check_bench, file, rows, confirmed) if file else []
    modes = faults.of(_modes, file) if file else None
    faults.refuse()
    assert file is not None
    return file, rows, modes, remarks


def _refuse_unnamed(again: Collection[str], rows: tuple[RunRow, ...]) -> None:
    for path in again:
        if not any(row.recording == path for row in rows):
            raise IngestError(
                f"--again {path}: no row names this recording; give it as the table of runs does"
            )


def _campaign(folder: Path, names: MaterialNames) -> CampaignFile:
    """The campaign with its plate's material called as the store calls it."""
    file = read_campaign_file(folder)
    if file.plate is None or file.plate.material is None:
        return file
    material = names(file.plate.material)
    if material is None:
        raise IngestError(
            f"{CAMPAIGN}: bench.plate.material is {file.plate.material!r}; expected a material of "
            "the store (pyroshock materials lists and adds them)"
        )
    return replace(file, plate=replace(file.plate, material=material))


def _modes(file: CampaignFile) -> ModalTableFile | None:
    """That of the campaign's plate, where the card names one."""
    if file.plate is None or file.plate.modes is None:
        return None
    on_plate = (
        sensor.name
        for sensor in file.sensors.values()
        if sensor.quantity == "acceleration" and not on_impactor(sensor.position)
    )
    return read_modal_table(file.folder, file.plate.modes, tuple(on_plate))


def _pending_recordings(
    file: CampaignFile, rows: tuple[RunRow, ...], target: CampaignStore
) -> list[PendingRecording]:
    """The recordings that the store lacks."""
    by_path: defaultdict[str, list[RunRow]] = defaultdict(list)
    for row in rows:
        if row.recording:
            by_path[row.recording].append(row)
    every = (work_of(file, path, tuple(rows_of_path)) for path, rows_of_path in by_path.items())
    return [work for work in every if not target.has_recording(work.path, work.sha256)]


def work_of(file: CampaignFile, path: str, rows: tuple[RunRow, ...]) -> PendingRecording:
    """One recording of a folder with its rows. Raises `IngestError` where its files cannot be
    read."""
    files = RecordingFiles(file.folder, path)
    with _refused_in(rows[0]):
        return PendingRecording(path, rows, files.sha256(), files.size_bytes)


def _refuse_unknown_format(folder: Path, row: RunRow) -> None:
    with _refused_in(row):
        _ = RecordingFiles(folder, row.recording or "").format


@contextmanager
def _refused_in(row: RunRow) -> Iterator[None]:
    """Files that cannot be read are a fault of the row that names them."""
    try:
        yield
    except (RecordingError, OSError) as error:
        raise IngestError(f"{row.place}, column 'recording': {error}") from error


def campaign_plate_response(
    file: CampaignFile, rows: tuple[RunRow, ...]
) -> TransferFunctions | None:
    """The plate's transfer functions, where `[force]` asks for them. Raises `IngestError` for a row
    that was struck elsewhere than the hammer's hits: its transfer function is another one."""
    if file.force is None:
        return None
    hammer = file.force.impact_position
    for row in rows:
        struck = row.levels_by_factor.get("impact_position")
        place = None if struck is None else struck.label
        if place is not None and place != hammer:
            raise IngestError(
                f"{row.place}: impact_position is {place!r}, force.impact_position of "
                f"campaign.toml {hammer!r}: a transfer function holds for one place; hit the plate "
                "with the hammer where the projectile strikes it, or put these rows into a "
                "campaign of their own"
            )
    return plate_response(file.folder, file.force, dict(file.sensors), file.reading)


def process(
    file: CampaignFile,
    rows: tuple[RunRow, ...],
    settings: ExtractionSettings,
    plate: TransferFunctions | None,
    work: PendingRecording,
) -> Outcome:
    """Read and extract one recording, and tell its hits apart. Runs in any process."""
    own_rows = list(work.rows)
    try:
        recording = process_recording(
            file.folder,
            work.path,
            file.sensors,
            settings,
            expected=expected_hits(own_rows, rows),
            rows=_impact_rows(file, own_rows),
            bullet_length_m=own_rows[0].bullet_length_m,
            bullet_length_u_m=own_rows[0].bullet_length_u_m,
            sha256=work.sha256,
            reading=file.reading,
            plate=plate,
        )
        return match(work.path, own_rows, len(recording.pulses), rows), recording
    except RecordingError as error:
        return _damaged(work, str(error))
    except (
        MemoryError,
        OSError,
        IngestError,
    ):  # of the machine or of the campaign, not of this recording
        raise
    except Exception as error:  # noqa: BLE001
        # whatever a library says of one recording, the others are stored
        reason = (
            f"{work.path}: could not be processed ({type(error).__name__}: "
            f"{error}); look at its samples"
        )
        return _damaged(work, reason)


def _impact_rows(file: CampaignFile, rows: list[RunRow]) -> int:
    """Rows that are impacts without a contact force: a gun's are shots, unless they report an
    impact's velocity."""
    if file.kind != "gun" or all(row.impact_velocity_m_s is not None for row in rows):
        return len(rows)
    return 0


def _unreadable_recording(work: PendingRecording) -> Outcome:
    reason = f"crashed by it, or did not end within {_patience_s(work):.0f} s; the file is damaged"
    return _damaged(work, f"the library that reads it was {reason}")


def _patience_s(work: PendingRecording) -> float:
    """Far above what a recording takes (0.03 s for a megabyte), also from a slow network."""
    return _PATIENCE_S + work.size_bytes / _SLOWEST_BYTES_PER_S


def _damaged(work: PendingRecording, reason: str) -> UnreadableRecording:
    return UnreadableRecording(work.path, work.sha256, work.size_bytes, one_line(reason))
