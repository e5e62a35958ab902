"""`pyroshock ingest`: a campaign folder into the store, whole recordings at a time.

Everything that can be refused is refused before the first row is written. Each recording is then read, judged and
cut outside of any lock, and stored in one transaction with all its numbers and series: a kill between two
recordings leaves whole ones, and a repeat goes on where it stopped, because what is stored is known by its hash.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from ..schema.levels import MaterialNames
from ..schema.materials import material_names
from ..schema.rehearsal import Rehearsal
from ..schema.session import Store
from .aside import Damaged
from .bench_rules import check_bench
from .column_names import undeclared
from .derived_force import PlateResponse, plate_response
from .errors import IngestError
from .folder import FILE as CAMPAIGN
from .folder import CampaignFile, read_campaign_file
from .impact_speed import IMPACTOR_POSITIONS
from .matching import Hit, expected_hits, match
from .modes import ModalTableFile, read_modal_table
from .parallel import Isolation, default_jobs, map_ahead
from .processing import ProcessedRecording, file_hash, process_recording
from .readers import RecordingError, may_crash, reader_for
from .readers.guard import one_line
from .report import IngestReport
from .runs import FILE, RunRow, read_runs
from .settings import ExtractionSettings
from .store import CampaignStore

#: Called with (done, total, what) after each recording.
Progress = Callable[[int, int, str], None]


#: A recording whose reading takes longer than this, and longer than its size explains, never ends.
_PATIENCE_S, _SLOWEST_BYTES_PER_S = 120.0, 0.5e6

Outcome = tuple[list[Hit], ProcessedRecording] | Damaged


@dataclass(frozen=True)
class Work:
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
) -> IngestReport:
    """Ingest the campaign in `folder`; `jobs` processes read and extract (None: what pays), and this one writes.

    `free_factors` are columns of `runs.csv` that are factors of their own though they resemble a known one, and
    `confirmed` rules of `bench_rules` that rows may break.
    A `Rehearsal` is written to when all recordings are read, so that its transaction is short, and without samples.
    Raises `IngestError`, with nothing stored, for a campaign that is refused or holds nothing usable.
    """
    settings = settings or ExtractionSettings()
    with store.reading() as session:
        names = material_names(session)
    file = _with_known_material(read_campaign_file(folder), names)
    rows = read_runs(folder, file.kind, names, file.factors, free_factors)
    told = check_bench(file, rows, confirmed)
    target = CampaignStore(store, file, _modes(file), rows, settings)
    work = _plan(file, rows, target)
    plate = _plate_response(file, rows)
    damaged: list[Damaged] = []
    held: list[tuple[list[Hit], ProcessedRecording]] = []
    jobs = jobs or default_jobs(sum(item.size_bytes for item in work))
    crashing = any(may_crash(folder / item.path) for item in work)
    results = map_ahead(
        partial(_process, file, rows, settings, plate), work, jobs, Isolation(_lost, _patience_s, always=crashing)
    )
    for done, (item, result) in enumerate(results, 1):
        if isinstance(result, Damaged):
            damaged.append(result)
        else:
            hits, recording = result
            if isinstance(store, Rehearsal):
                held.append((hits, recording.without_samples()))
            else:
                target.add_recording(recording, hits)
        if progress:
            progress(done, len(work), item.path)
    for hits, recording in held:
        target.add_recording(recording, hits)
    target.add_rows_without_recording()
    if damaged and not target.holds_anything():
        raise IngestError(f"{file.folder}: no usable recording; {damaged[0].path}: {damaged[0].reason}")
    target.set_aside(damaged)
    report = target.report()
    report.findings += told
    report.undeclared_factors = undeclared({name: None for row in rows for name in row.levels_by_factor}, file.factors)
    return report


def _with_known_material(file: CampaignFile, names: MaterialNames) -> CampaignFile:
    """The campaign with its plate's material called as the store calls it."""
    if file.plate is None or file.plate.material is None:
        return file
    material = names(file.plate.material)
    if material is None:
        raise IngestError(
            f"{CAMPAIGN}: bench.plate.material is {file.plate.material!r}; expected a material of the store "
            "(pyroshock materials lists and adds them)"
        )
    return replace(file, plate=replace(file.plate, material=material))


def _modes(file: CampaignFile) -> ModalTableFile | None:
    if file.plate is None or file.plate.modes is None:
        return None
    on_plate = (
        sensor.name
        for sensor in file.sensors.values()
        if sensor.quantity == "acceleration" and (sensor.position or "").lower() not in IMPACTOR_POSITIONS
    )
    return read_modal_table(file.folder, file.plate.modes, tuple(on_plate))


def _plan(file: CampaignFile, rows: tuple[RunRow, ...], target: CampaignStore) -> list[Work]:
    """The recordings that the store lacks."""
    by_path: defaultdict[str, list[RunRow]] = defaultdict(list)
    for row in rows:
        if row.recording:
            _refuse_unknown_format(row)
            by_path[row.recording].append(row)
    work = []
    for path, mine in by_path.items():
        digest, size = _hash_and_size(file.folder / path, mine[0])
        if not target.has_recording(path, digest):
            work.append(Work(path, tuple(mine), digest, size))
    return work


def _hash_and_size(path: Path, row: RunRow) -> tuple[str, int]:
    try:
        return file_hash(path), path.stat().st_size
    except (RecordingError, OSError) as error:
        raise IngestError(f"{FILE}: row {row.line}, column 'recording': {error}") from error


def _refuse_unknown_format(row: RunRow) -> None:
    try:
        reader_for(Path(row.recording or ""))
    except RecordingError as error:
        raise IngestError(f"{FILE}: row {row.line}, column 'recording': {error}") from error


def _plate_response(file: CampaignFile, rows: tuple[RunRow, ...]) -> PlateResponse | None:
    """The plate's transfer functions, where `[force]` asks for them. Raises `IngestError` for a row that was struck
    elsewhere than the hammer's hits: its transfer function is another one."""
    if file.force is None:
        return None
    hammer = file.force.impact_position
    for row in rows:
        struck = row.levels_by_factor.get("impact_position")
        place = None if struck is None else struck.label
        if place is not None and place != hammer:
            raise IngestError(
                f"{FILE}: row {row.line}: impact_position is {place!r}, force.impact_position of campaign.toml "
                f"{hammer!r}: a transfer function holds for one place; hit the plate with the hammer where the "
                "projectile strikes it, or put these rows into a campaign of their own"
            )
    return plate_response(file.folder, file.force, dict(file.sensors))


def _process(
    file: CampaignFile,
    rows: tuple[RunRow, ...],
    settings: ExtractionSettings,
    plate: PlateResponse | None,
    work: Work,
) -> Outcome:
    """Read and extract one recording, and tell its hits apart. Runs in any process."""
    mine = list(work.rows)
    try:
        recording = process_recording(
            file.folder,
            work.path,
            file.sensors,
            settings,
            expected=expected_hits(mine, rows),
            rows=_impact_rows(file, mine),
            bullet_length_m=mine[0].bullet_length_m,
            bullet_length_u_m=mine[0].bullet_length_u_m,
            sha256=work.sha256,
            plate=plate,
        )
        return match(work.path, mine, len(recording.pulses), rows), recording
    except RecordingError as error:
        return _damaged(work, str(error))


def _impact_rows(file: CampaignFile, rows: list[RunRow]) -> int:
    """Rows that are impacts without a contact force: a gun's are shots, unless they report an impact's velocity."""
    if file.kind != "gun" or all(row.impact_velocity_m_s is not None for row in rows):
        return len(rows)
    return 0


def _lost(work: Work) -> Outcome:
    reason = f"crashed by it, or did not end within {_patience_s(work):.0f} s; the file is damaged"
    return _damaged(work, f"the library that reads it was {reason}")


def _patience_s(work: Work) -> float:
    """Far above what a recording takes (0.03 s for a megabyte), also from a slow network."""
    return _PATIENCE_S + work.size_bytes / _SLOWEST_BYTES_PER_S


def _damaged(work: Work, reason: str) -> Damaged:
    return Damaged(work.path, work.sha256, work.size_bytes, one_line(reason))
