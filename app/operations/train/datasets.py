"""Datasets as the command line shows them: plain data, tables, and files for other programs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ....dataset.predictors import correlation, ranges
from ....dataset.snapshot import Built, Snapshot
from ....dataset.table import POINTS, Predictor, PulseTable, Split, expand, split_of
from ....files.atomic_write import atomic_file
from ....files.spreadsheet_guard import guarded_frame
from ....schema.conditions import listing_key
from ...common.number_format import format_number
from ...common.quantities import display_of_predictor, velocity_label

#: The splits that `show` counts; the thesis's first.
SPLITS = ("repetitions", "configurations", "treatments", "materials", "campaigns")
_FIGURES = (
    "contact_time_s",
    "compression_time_s",
    "peak_force_n",
    "impulse_n_s",
    "compression_impulse_n_s",
)
#: Of the bench: models whose physics needs them take them from a table even where they are no
#: predictors.
_BENCH = ("impactor_mass_kg", "plate_thickness_m")
_NAMES = (
    "key",
    "campaign",
    "run",
    "repetition",
    "configuration",
    "treatment",
    "tip_material",
    "target_material",
)


def built_as_json(built: Built, split: Split | None) -> dict[str, Any]:
    """What `dataset build` tells; without a split, all pulses are there to learn from."""
    snapshot = built.snapshot
    test = 0 if split is None else len(split.test)
    return {
        "name": snapshot.name,
        "hash": snapshot.hash,
        "pulses": len(snapshot.table),
        "train": len(snapshot.table) - test,
        "test": test,
        "left_out": snapshot.definition["left_out"],
    }


def snapshot_as_json(snapshot: Snapshot, seed: int = 0) -> dict[str, Any]:
    """What `dataset show` tells: the definition, counts per split, ranges and correlations of the
    predictors."""
    kept = ("campaigns", "kind", "quality", "extractions", "materials", "left_out")
    return {
        "name": snapshot.name,
        "hash": snapshot.hash,
        "pulses": len(snapshot.table),
        "configurations": len(set(snapshot.table.configuration.tolist())),
        "treatments": len(set(snapshot.table.treatment.tolist())),
        "predictor_set": snapshot.predictors.name,
        **{key: snapshot.definition[key] for key in kept},
        "velocity": snapshot.definition.get("velocity"),
        "splits": split_rows(snapshot.table, SPLITS, seed),
        "ranges": ranges(snapshot.table),
        **correlation(snapshot.table).as_json(),
    }


def split_rows(table: PulseTable, texts: Sequence[str], seed: int) -> list[dict[str, Any]]:
    """A row for each split that the table allows: how many pulses on either side, and what is held
    out."""
    rows = []
    for text in (expanded for given in texts for expanded in expand(table, given)):
        try:
            split = split_of(table, text, seed)
        except ValueError:  # too few repetitions, configurations or treatments to part
            continue
        row = {
            "split": text,
            "train": len(split.train),
            "test": len(split.test),
            "held_out": split.what,
        }
        rows.append(row)
    return rows


def range_rows(snapshot: Snapshot) -> list[dict[str, Any]]:
    """`ranges` as a person reads them, numbers in the units of the laboratory."""
    rows = []
    kind = (snapshot.definition.get("velocity") or {}).get("kind")
    for row in ranges(snapshot.table):
        shown = display_of_predictor(row["predictor"], row["unit"])
        if row["levels"] is None:
            ends = (format_number(shown.scale * row[end]) for end in ("min", "max"))
            values = " to ".join(dict.fromkeys(ends))
        else:
            values = _counted(row["levels"])
        label = velocity_label([kind]) if row["predictor"] == "impact_velocity" else shown.label
        rows.append(
            {
                "predictor": label,
                "unit": shown.unit,
                "distinct": row["distinct"],
                "recorded": values,
            }
        )
    return rows


def _counted(levels: dict[str, int]) -> str:
    return ", ".join(f"{level} {count}" for level, count in levels.items())


def correlation_rows(snapshot: Snapshot) -> list[dict[str, Any]]:
    """The correlations as a table: predictors by number, as Fig. 4.8 has them."""
    coefficients = correlation(snapshot.table)
    return [
        {"": number, "predictor": name.replace("_", " ")}
        | {str(other): _signed(value) for other, value in enumerate(row[:number], 1)}
        for number, (name, row) in enumerate(
            zip(coefficients.names, coefficients.matrix, strict=True), 1
        )
    ]


def _signed(value: float) -> str:
    return "-" if np.isnan(value) else f"{round(value, 2) + 0.0:+.2f}"  # no -0.00


def export_snapshot(snapshot: Snapshot, out: Path) -> int:
    """Write one row per pulse: names, predictors (categories as words), figures, force points. CSV
    or Parquet by the suffix; returns the rows. Raises `ValueError` for another suffix."""
    if out.suffix.lower() not in (".csv", ".parquet"):
        raise ValueError(
            f"cannot write {out.name!r}; expected a name that ends in .csv or .parquet"
        )
    import pandas as pd

    frame = pd.DataFrame(dataset_columns(snapshot.table))
    with atomic_file(out) as partial:
        if out.suffix.lower() == ".csv":
            guarded_frame(frame).to_csv(partial, index=False)
        else:
            frame.to_parquet(partial, index=False)
    return len(frame)


def predictor_column(predictor: Predictor) -> str:
    """The column of a predictor in tables: its name, and its unit where it has one
    (`tip_radius_m`)."""
    return listing_key(predictor.name, predictor.unit)


def dataset_columns(table: PulseTable) -> dict[str, Any]:
    """Columns of a table with a row for each pulse: names, predictors (categories as words), bench,
    figures, force points."""
    columns: dict[str, Any] = {name: getattr(table, name) for name in _NAMES}
    for predictor, values in zip(table.predictors, table.x.T, strict=True):
        words = [predictor.levels[int(value)] for value in values] if predictor.levels else None
        columns[predictor_column(predictor)] = values if words is None else words
    # A predictor of the same name has the column already.
    columns |= {name: getattr(table, name) for name in (*_BENCH, *_FIGURES) if name not in columns}
    return columns | {f"force_{i + 1:02d}_n": table.force_n[:, i] for i in range(POINTS)}
