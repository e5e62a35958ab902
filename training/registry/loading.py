"""What MLflow calls to make a model of ours from its folder, and its tables: installed code, plain
numbers, no pickle.

A table has a row for each impact. Names of columns end in their unit ("impact_velocity_m_s"), as in
our other tables.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...array_types import Floats
from ...dataset.table import POINTS, Inputs, Predictor
from ..models.base import ContactModel, ContactPrediction
from ..models.serialization import read_model

if TYPE_CHECKING:
    import pandas

#: Columns of the bench, which a table may lack where they are no predictors.
BENCH_COLUMNS = ("impactor_mass_kg", "plate_thickness_m")


def input_column(predictor: Predictor) -> str:
    """The column of a predictor: its name and its unit; a category's and a bare number's is the
    name alone."""
    unit = re.sub(r"[^a-z0-9]+", "_", predictor.unit.lower()).strip("_")
    return f"{predictor.name}_{unit}" if unit else predictor.name


def output_columns() -> list[str]:
    """Those of an answer, in their order: force at each point of the contact, its time, and the
    spreads of both."""
    points = range(1, POINTS + 1)
    force, spread = (
        [f"{name}_{point:02}" for point in points] for name in ("force_n", "force_spread_n")
    )
    return [*force, "contact_time_s", *spread, "contact_time_spread_s"]


def inputs_from(frame: pandas.DataFrame, predictors: Sequence[Predictor]) -> Inputs:
    """The impacts of a table. Raises `ValueError` that names the column, its value and what it may
    be."""
    columns = [input_column(predictor) for predictor in predictors]
    if missing := [column for column in columns if column not in frame]:
        raise ValueError(
            f"the table lacks the columns {', '.join(missing)}; the model "
            f"needs {', '.join(columns)}"
        )
    x = [
        _values(frame, column, predictor)
        for column, predictor in zip(columns, predictors, strict=True)
    ]
    unknown = np.full(len(frame), np.nan)
    bench = (_numbers(frame, column) if column in frame else unknown for column in BENCH_COLUMNS)
    return Inputs(tuple(predictors), np.stack(x, axis=1), *bench)


def frame_from(
    prediction: ContactPrediction, index: pandas.Index[Any] | None = None
) -> pandas.DataFrame:
    """`output_columns` of pulses; spreads are NaN where the model has none."""
    import pandas

    parts = [
        prediction.force_n,
        prediction.contact_time_s[:, np.newaxis],
        _or_nan(prediction.force_spread_n, prediction.force_n),
        _or_nan(prediction.contact_time_spread_s, prediction.contact_time_s)[:, np.newaxis],
    ]
    return pandas.DataFrame(np.hstack(parts), columns=output_columns(), index=index)


class ServedModel:
    """A contact model with tables in and out, as its MLflow signature says."""

    def __init__(self, model: ContactModel, predictors: tuple[Predictor, ...]) -> None:
        self.model = model
        self.predictors = predictors

    # MLflow passes it
    def predict(self, model_input: pandas.DataFrame, params: Any = None) -> pandas.DataFrame:  # noqa: ARG002
        """Pulses of impacts, a row each, with the index of the table given."""
        import pandas

        if not isinstance(model_input, pandas.DataFrame):
            raise ValueError(
                f"a table (pandas.DataFrame) is expected, not {type(model_input).__name__}; "
                "a version of older software takes arrays: train it again"
            )
        return frame_from(
            self.model.predict(inputs_from(model_input, self.predictors)), model_input.index
        )


def _values(frame: pandas.DataFrame, column: str, predictor: Predictor) -> Floats:
    """A category is given by the name of its level, or by the level's position."""
    if not predictor.levels:
        return _numbers(frame, column)
    codes = {level: code for code, level in enumerate(predictor.levels)}
    codes_of_values = [
        codes.get(value, float(value) if isinstance(value, int | float | np.number) else -1.0)
        for value in frame[column]
    ]
    positions = np.array(codes_of_values, dtype=np.float64)
    allowed = np.isin(positions, np.arange(len(codes)))
    if not allowed.all():
        value = frame[column].tolist()[int(np.argmin(allowed))]
        raise ValueError(
            f"{column} is {value!r}; it may be {', '.join(codes)}, or 0 to "
            f"{len(codes) - 1} in this order"
        )
    return positions


def _numbers(frame: pandas.DataFrame, column: str) -> Floats:
    try:
        return frame[column].to_numpy(dtype=np.float64)
    except (ValueError, TypeError) as error:
        raise ValueError(f"column {column} holds something that is no number: {error}") from error


def _or_nan(spread: Floats | None, like: Floats) -> Floats:
    return np.full_like(like, np.nan) if spread is None else spread


def _load_pyfunc(path: str) -> ServedModel:
    model, about = read_model(Path(path))
    predictors = tuple(
        Predictor(entry["name"], entry["unit"], tuple(entry["levels"]))
        for entry in about["predictors"]
    )
    return ServedModel(model, predictors)
