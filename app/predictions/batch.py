"""Many shots foretold, here or on a cluster: each as `predict` would foretell it alone."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...parallel.executor import Crew
from ...parallel.map_tasks import mapped
from ..table_files import write_batches
from ..twins.building import BuiltTwin, TwinRequest, twin_of
from .given_factors import store_factors
from .predicting import predicted
from .rows import ShotRow, assumed, with_factors
from .warnings import extrapolation_text, extrapolations

if TYPE_CHECKING:
    from ...schema.session import Store
    from ...twin.contact_interface import OutOfDomain
    from ...twin.prediction import Prediction

Row = dict[str, Any]
Step = Callable[[int, int, str], None]
_QUANTITIES = ("velocity_m_s", "contact_time_s", "compression_time_s", "peak_force_n", "impulse_n_s")


@dataclass(frozen=True)
class Foretold:
    """One shot of a table: its figures, and the lines of its spectra, as plain rows."""

    figures: Row
    spectrum: tuple[Row, ...]


@dataclass(frozen=True, eq=False)
class BatchContext:
    """What every worker has: the twin of each plate and chain height, and how bands are drawn."""

    twins: Mapping[tuple[str | None, float], BuiltTwin]
    draws: int
    seed: int


def bench_of_rows(
    store: Store | None,
    db: str,
    request: TwinRequest,
    rows: Sequence[ShotRow],
    draws: int,
    seed: int,
    built: BuiltTwin | None = None,
) -> tuple[BatchContext, list[ShotRow], tuple[str, ...]]:
    """What `foretold` takes for rows of a table: the twin of each plate (`request.plate`, where it is given, is every
    row's), the rows with the factors that the contact model asks for; and what was assumed, for the user.

    `built` is the twin of `request` where it is there already.

    Raises as `twins.building.twin_of` and `rows.with_factors`.
    """
    twins: dict[tuple[str | None, float], BuiltTwin] = {}
    for plate, height in dict.fromkeys(row.twin for row in rows):
        own = replace(request, plate=request.plate or plate, chain_height_m=height)
        twins[plate, height] = built if built is not None and own == request else twin_of(store, db, own)
    mass = next(iter(twins.values())).bench.impactor_mass_kg
    notes = (*assumed(rows, mass), *(note for built in twins.values() for note in built.notes))
    of_store = store_factors(store)
    rows = [with_factors(row, twins[row.twin], of_store) for row in rows]
    return BatchContext(twins, draws, seed), rows, tuple(dict.fromkeys(notes))


def foretold(bench: BatchContext, rows: Sequence[ShotRow], crew: Crew, step: Step) -> list[Foretold]:
    """All rows, in their order; the same seed, the same numbers, whoever reckons them.

    Raises as `predicted`, with the row's own words, and `ValueError` for a worker that was killed.
    """
    predicted_by_row: dict[int, Foretold] = {}
    for number, result in mapped(crew, _one, list(enumerate(rows)), shared=(bench,)):
        predicted_by_row[number[0]] = result
        step(len(predicted_by_row), len(rows), _name(number[1]))
    return [predicted_by_row[number] for number in range(len(rows))]


def write_figures(out: Path, found: Sequence[Foretold]) -> int:
    """One row a shot, CSV or Parquet. Raises `ValueError` for another suffix."""
    return write_batches(out, iter([_columns([shot.figures for shot in found])]))


def write_spectra(out: Path, found: Sequence[Foretold]) -> int:
    """One row for each shot, sensor and line. Raises `ValueError` as `write_figures`, and where no plate answered."""
    rows = [row for shot in found for row in shot.spectrum]
    if not rows:
        raise ValueError(f"no spectrum to write to {out.name!r}: the twin has no plate")
    return write_batches(out, iter([_columns(rows)]))


def _one(item: tuple[int, ShotRow], bench: BatchContext) -> Foretold:
    row = item[1]
    try:
        prediction = predicted(bench.twins[row.twin], row.shot, draws=bench.draws, seed=bench.seed)
    except (LookupError, ValueError) as error:
        raise ValueError(f"{_name(row)}: {error}") from error
    return Foretold({**row.labels, **_figures(prediction)}, tuple(_spectrum(row, prediction)))


def _name(row: ShotRow) -> str:
    return f"run {row.labels['run']}" if "run" in row.labels else str(dict(row.labels))


def _figures(prediction: Prediction) -> Row:
    quantities = {name: getattr(prediction, name) for name in _QUANTITIES}
    for sensor in prediction.sensors:
        quantities[f"peak_{sensor}_m_s2"] = prediction.peak_acceleration_m_s2(sensor)
    row: Row = {}
    for name, quantity in quantities.items():
        row |= {f"predicted_{name}": quantity.mean}
        row |= {f"predicted_{name}_{end}": value for end, value in zip(("low", "high"), quantity.ci90, strict=True)}
    row |= {f"{stage}_by": answered for stage, answered in prediction.models.items()}
    return row | {
        "rests_on_shots": prediction.rests_on.shots,
        "extrapolation": " ".join(map(extrapolation_text, extrapolations(prediction))),
        "outside_domain": "; ".join(map(_outside, prediction.outside)),
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
