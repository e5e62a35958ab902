"""Many shots foretold, of a plan or of a table of runs, here or on a cluster: each as `predict`
would foretell it alone."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ....files.delimited_text import parse_number
from ....ingest.folder.column_names import MEASURED
from ....ingest.folder.tables import read_table
from ....parallel.executor import ExecutorConfig
from ....parallel.map_tasks import run_all_tasks
from ....schema.known_factors import BY_COLUMN, BY_NAME, KnownFactor
from ....schema.session import Store
from ...common.number_format import finite, format_interval
from ...common.quantities import display_of
from ...common.table_files import write_batches
from ..faults import RequestError, read
from ..fields import TextFile
from ..operation import Result, ResultTable
from ..plan.rehearsal import rows_of
from .factors import check_used, factor_value, is_used, looks_like_factor, store_factors
from .predicting import predict_shot
from .request import ShotRequest
from .tables import QUANTITIES
from .validity import bench_limit_sentences, extrapolation_sentence, extrapolations

if TYPE_CHECKING:
    from ....twin.contact_interface import OutOfDomain
    from ....twin.prediction import Prediction
    from ...twins.building import BuiltTwin, TwinRequest


_PRESSURE, _VELOCITY, _PLATE = "tank_pressure_bar", "impact_velocity_m_s", "plate_material"
_HEIGHT = "chain_height_mm"
#: Columns of a table of runs in other units than the field of `ShotRequest`.
_OTHER_UNITS = {"tank_pressure_pa": _PRESSURE, "tip_radius_m": "tip_radius_mm"}
#: Column: field of `ShotRequest`.
FIELDS = {
    _OTHER_UNITS.get(name, name): name for name in ShotRequest.model_fields if name != "factor"
}


#: Columns with a field of their own, and those that are never factors of a shot that is to be
#: predicted.
_NOT_FACTORS = frozenset({*FIELDS, _PLATE, "run", "repetition", "recording", *MEASURED})
#: Factors of the store that say what the velocity or the pressure of the row says already.
_LABELS = frozenset({"hammer_speed", "velocity_level", *BY_NAME})


@dataclass(frozen=True)
class ShotRow:
    """A shot of a table: the cells that name it, and the material of its plate where the table says
    one."""

    labels: Mapping[str, str | int]
    shot: ShotRequest
    plate: str | None
    chain_height_m: float = 0.0

    @property
    def twin(self) -> tuple[str | None, float]:
        """Which twin predicts it: that of its plate, as high as it hangs."""
        return self.plate, self.chain_height_m


def rows_of_plan(store: Store, plan: str) -> list[ShotRow]:
    """The runs of a plan that are not discarded. Raises as `rows_of`, and `ValueError` as
    `rows_of_table`."""
    return rows_of_table(rows_of(store, plan)[1], f"plan {plan!r}")


def rows_of_text(table: TextFile) -> list[ShotRow]:
    """The same of the file of a request."""
    with table.as_path() as path:
        return rows_of_file(path)


def rows_of_file(path: Path) -> list[ShotRow]:
    """A CSV table with the columns of `runs.csv`. Raises `IngestError`, `OSError`, `ValueError`."""
    return rows_of_table([row for _, row in read_table(path, path.name)[1]], path.name)


def assumed(rows: Sequence[ShotRow], impactor_mass_kg: float) -> list[str]:
    """What a shot has that the table does not say, in words for the user; the mass is that of the
    bench."""
    stated, usual = rows[0].labels, ShotRequest(bullet_mass_kg=impactor_mass_kg)
    absent = {
        column: getattr(usual, field) for column, field in FIELDS.items() if column not in stated
    }
    return [f"no column {column}: {value}" for column, value in absent.items() if value is not None]


def with_factors(row: ShotRow, built: BuiltTwin, of_store: Collection[str]) -> ShotRow:
    """The shot with the further columns of its row that the twin's contact model asks for.

    Raises `ValueError` for a column that is a factor (`looks_like_factor`) and that no stage uses;
    any other column is a label, such as `recording` or a planned figure.
    """
    cells = {
        column: str(cell)
        for column, cell in row.labels.items()
        if cell not in ("", None) and column not in _NOT_FACTORS
    }
    used = {column: factor_value(cell) for column, cell in cells.items() if is_used(built, column)}
    ignored = {
        column: cell
        for column, cell in cells.items()
        if column not in used and column not in _LABELS and looks_like_factor(column, of_store)
    }
    if ignored:
        check_used(built, ignored, None)
    return replace(row, shot=row.shot.model_copy(update={"factor": used}))


def rows_of_table(rows: Sequence[Mapping[str, str]], name: str) -> list[ShotRow]:
    """Rows with the columns of `runs.csv`; an empty cell says nothing. `name` is the table's, for
    errors.

    Raises `ValueError` for a table without rows, for a row with both pressure and velocity or
    neither, and for a cell that is no number.
    """
    if not rows:
        raise ValueError(f"{name} has no row to predict")
    return [
        _shot(row, f"{name}, run {row.get('run', number)}") for number, row in enumerate(rows, 1)
    ]


def _shot(row: Mapping[str, str], name: str) -> ShotRow:
    settings = {column: row[column] for column in FIELDS if row.get(column)}
    if (_PRESSURE in settings) == (_VELOCITY in settings):
        raise ValueError(f"{name}: expected {_PRESSURE} or {_VELOCITY}, and one of them only")
    values = {FIELDS[column]: _value(column, cell, name) for column, cell in settings.items()}
    try:
        shot = read(ShotRequest, values, "stored")
    except RequestError as error:
        raise ValueError(f"{name}: {error}") from error
    numbers = {
        column: int(row[column])
        for column in ("run", "repetition")
        if row.get(column, "").isdecimal()
    }
    height = _value(_HEIGHT, row[_HEIGHT], name) if row.get(_HEIGHT) else 0.0
    return ShotRow({**row, **numbers}, shot, row.get(_PLATE) or None, height)


def _value(column: str, cell: str, name: str) -> Any:
    factor = BY_COLUMN.get(column, KnownFactor(column, column, "m/s"))
    if not factor.is_number:
        return cell
    try:
        return parse_number(cell) * factor.scale
    except ValueError as error:
        raise ValueError(f"{name}: {column} is {cell!r}; expected a number") from error


Row = dict[str, Any]
Step = Callable[[int, int, str], None]


@dataclass(frozen=True)
class PredictedShot:
    """One shot of a table: its figures, and the lines of its spectra, as plain rows."""

    figures: Row
    spectrum: tuple[Row, ...]


#: Of a table on a screen: what names a shot, and what matters of it.
_SHOWN = ("run", "repetition", "tip_material", "bullet_mass_kg", "tank_pressure_bar")
_FIGURES = ("velocity_m_s", "contact_time_s", "peak_force_n")


@dataclass(frozen=True, eq=False)
class PredictedShots(Result):
    """The shots of a table in its order, what was assumed of them, and their plan."""

    shots: Sequence[PredictedShot]
    remarks: tuple[str, ...] = ()
    plan: str | None = None

    def notes(self) -> Sequence[str]:
        """What the table does not say, and what the twins rest on."""
        return self.remarks

    def tables(self) -> Sequence[ResultTable]:
        """A row for each shot."""
        return (ResultTable("", [_short(shot.figures) for shot in self.shots]),)

    def to_json(self) -> list[Any]:
        """All figures of each shot, and the lines of its spectra."""
        return [finite({**shot.figures, "srs": list(shot.spectrum)}) for shot in self.shots]

    def write_figures(self, path: Path) -> None:
        """One row for each shot, CSV or Parquet. Raises `ValueError` for another suffix."""
        write_batches(path, iter([_columns([shot.figures for shot in self.shots])]))

    def write_spectra(self, path: Path) -> None:
        """One row for each shot, sensor and line. Raises `ValueError` as `write_figures`, and where
        no plate answered."""
        rows = [row for shot in self.shots for row in shot.spectrum]
        if not rows:
            raise ValueError(f"no spectrum to write to {path.name!r}: the twin has no plate")
        write_batches(path, iter([_columns(rows)]))

    def next_command(self) -> Sequence[str]:
        """The run sheet of the plan."""
        return ("plan", "sheet", self.plan, "--out", f"{self.plan}.html") if self.plan else ()


def _short(figures: Row) -> Row:
    row: Row = {name: figures[name] for name in _SHOWN if name in figures}
    for name in _FIGURES:
        shown = display_of(name)
        numbers = (shown.scale * figures[f"predicted_{name}{end}"] for end in ("", "_low", "_high"))
        mean, low, high = format_interval(*numbers)
        row |= {name: mean, f"{shown.label} 90 %": f"{low} to {high}"}
    return row | {name: figures[name] for name in ("rests_on_shots", "extrapolation")}


@dataclass(frozen=True, eq=False)
class BatchContext:
    """What every worker has: the twin of each plate and chain height, and how bands are drawn."""

    twins: Mapping[tuple[str | None, float], BuiltTwin]
    draws: int
    seed: int


def bench_of_rows(
    store: Store | None,
    twin_of: Callable[[TwinRequest], BuiltTwin],
    request: TwinRequest,
    rows: Sequence[ShotRow],
    draws: int,
    seed: int,
) -> tuple[BatchContext, list[ShotRow], tuple[str, ...]]:
    """What `predict_batch` takes for rows of a table: the twin of each plate (`request.plate`,
    where it is given, is every row's), the rows with the factors that the contact model asks for;
    and what was assumed, for the user.

    Raises as `twins.building.twin_of` and `with_factors`.
    """
    twins: dict[tuple[str | None, float], BuiltTwin] = {}
    for plate, height in dict.fromkeys(row.twin for row in rows):
        twins[plate, height] = twin_of(
            replace(request, plate=request.plate or plate, chain_height_m=height)
        )
    mass = next(iter(twins.values())).bench.impactor_mass_kg
    notes = (*assumed(rows, mass), *(note for built in twins.values() for note in built.notes))
    of_store = store_factors(store)
    rows = [with_factors(row, twins[row.twin], of_store) for row in rows]
    return BatchContext(twins, draws, seed), rows, tuple(dict.fromkeys(notes))


def predict_batch(
    bench: BatchContext, rows: Sequence[ShotRow], executor: ExecutorConfig, step: Step
) -> list[PredictedShot]:
    """All rows, in their order; the same seed, the same numbers, whoever reckons them.

    Raises as `predict_shot`, with the row's own words, and `ValueError` for a worker that was
    killed.
    """
    predicted_by_row: dict[int, PredictedShot] = {}
    for number, result in run_all_tasks(
        executor, _predict_row, list(enumerate(rows)), shared=(bench,)
    ):
        predicted_by_row[number[0]] = result
        step(len(predicted_by_row), len(rows), _name(number[1]))
    return [predicted_by_row[number] for number in range(len(rows))]


def _predict_row(item: tuple[int, ShotRow], bench: BatchContext) -> PredictedShot:
    row = item[1]
    try:
        prediction = predict_shot(
            bench.twins[row.twin], row.shot, draws=bench.draws, seed=bench.seed
        )
    except (LookupError, ValueError) as error:
        raise ValueError(f"{_name(row)}: {error}") from error
    return PredictedShot({**row.labels, **_figures(prediction)}, tuple(_spectrum(row, prediction)))


def _name(row: ShotRow) -> str:
    return f"run {row.labels['run']}" if "run" in row.labels else str(dict(row.labels))


def _figures(prediction: Prediction) -> Row:
    quantities = {name: getattr(prediction, name) for name in QUANTITIES}
    for sensor in prediction.sensors:
        quantities[f"peak_{sensor}_m_s2"] = prediction.peak_acceleration_m_s2(sensor)
    row: Row = {}
    for name, quantity in quantities.items():
        row |= {f"predicted_{name}": quantity.mean}
        row |= {
            f"predicted_{name}_{end}": value
            for end, value in zip(("low", "high"), quantity.ci90, strict=True)
        }
    if prediction.sensors:
        row |= {"predicted_peak_band_hz": prediction.acceleration_band_hz}
    row |= {f"{stage}_by": answered for stage, answered in prediction.models.items()}
    return row | {
        "rests_on_shots": prediction.rests_on.shots,
        "extrapolation": " ".join(
            str(extrapolation_sentence(item)) for item in extrapolations(prediction)
        ),
        "outside_domain": "; ".join(
            (*map(str, bench_limit_sentences(prediction)), *map(_outside, prediction.outside))
        ),
    }


def _outside(outside: OutOfDomain) -> str:
    """Four digits, for a velocity of the twin has some ten more that mean nothing."""
    value = outside.value if isinstance(outside.value, str) else f"{outside.value:.4g}"
    return f"{outside.predictor} = {value} ({outside.range})"


def _spectrum(row: ShotRow, prediction: Prediction) -> Iterator[Row]:
    labels = {name: row.labels[name] for name in ("run", "repetition") if name in row.labels}
    for sensor, band in prediction.spectra_m_s2.items():
        for line, frequency in enumerate(prediction.frequency_hz):
            yield {
                **labels,
                "sensor": sensor,
                "frequency_hz": float(frequency),
                "mean_m_s2": float(band.mean[line]),
                "low_m_s2": float(band.lower[line]),
                "high_m_s2": float(band.upper[line]),
            }


def _columns(rows: Sequence[Row]) -> dict[str, list[Any]]:
    names = dict.fromkeys(name for row in rows for name in row)
    return {name: [row.get(name) for row in rows] for name in names}
