"""The tables of a campaign folder, held against each other: campaign.toml, the table of runs, the
modal table; and the recordings that the rows name."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from ...schema.benches import Material, material_names
from ...schema.known_factors import MaterialNames
from ...schema.session import Store
from ...signals.channel import on_impactor
from ..errors import Faults, IngestError
from ..readers import RecordingError
from ..readers.recording_files import RecordingFiles
from .bench_rules import Told, check_bench
from .campaign_file import FILE, CampaignFile, read_campaign_file, stated_kind_and_factors
from .modal_table import ModalTableFile, read_modal_table
from .runs_table import RunRow, read_runs


@dataclass(frozen=True)
class StoredMaterial:
    """What the store knows of a material, SI."""

    youngs_modulus_pa: float
    poisson_ratio: float
    density_kg_m3: float


@dataclass(frozen=True)
class NamedRecording:
    """One recording of the folder, with the rows of `runs.csv` that name it."""

    path: str
    rows: tuple[RunRow, ...]
    sha256: str
    size_bytes: int


@dataclass(frozen=True)
class CampaignTables:
    """`remarks`: what the rules of a bench say of the rows. `materials` of the store, by name."""

    file: CampaignFile
    rows: tuple[RunRow, ...]
    modes: ModalTableFile | None
    remarks: list[Told]
    materials: Mapping[str, StoredMaterial]

    def recordings(self) -> Iterator[NamedRecording]:
        """In the order of the rows. Raises `IngestError` as `recording`."""
        rows_by_path: defaultdict[str, list[RunRow]] = defaultdict(list)
        for row in self.rows:
            if row.recording:
                rows_by_path[row.recording].append(row)
        for path, rows in rows_by_path.items():
            yield self.recording(path, tuple(rows))

    def recording(self, path: str, rows: tuple[RunRow, ...]) -> NamedRecording:
        """One recording with its `rows`. Raises `IngestError` where its files cannot be read."""
        files = RecordingFiles(self.file.folder, path)
        with _refused_in(rows[0]):
            return NamedRecording(path, rows, files.sha256(), files.size_bytes)

    @property
    def plate_mass_kg(self) -> float | None:
        """Of a plate of known material, thickness and outline (by the shoelace formula); None
        otherwise."""
        part = self.file.plate
        if (
            part is None
            or part.material is None
            or part.thickness_m is None
            or part.outline_m is None
        ):
            return None
        x, y = np.array(part.outline_m).T
        area_m2 = abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2.0
        return area_m2 * part.thickness_m * self.materials[part.material].density_kg_m3


def read_campaign_tables(
    store: Store, folder: Path, free_factors: Collection[str] = (), confirmed: Collection[str] = ()
) -> CampaignTables:
    """Raises `IngestError` with the faults of all tables."""
    with store.reading() as session:
        names, materials = material_names(session), _materials(session)
    faults = Faults()
    file = faults.attempt(_campaign, folder, names)
    if file is None and not (folder / FILE).is_file():
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
    return CampaignTables(file, rows, modes, remarks, materials)


def _materials(session: Session) -> dict[str, StoredMaterial]:
    columns = (Material.youngs_modulus_pa, Material.poisson_ratio, Material.density_kg_m3)
    query = select(Material.name, *columns)
    return {name: StoredMaterial(*figures) for name, *figures in session.execute(query)}


def _campaign(folder: Path, names: MaterialNames) -> CampaignFile:
    """The campaign with its plate's material called as the store calls it."""
    file = read_campaign_file(folder)
    if file.plate is None or file.plate.material is None:
        return file
    material = names(file.plate.material)
    if material is None:
        raise IngestError(
            f"{FILE}: bench.plate.material is {file.plate.material!r}; expected a material of "
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
