"""A registered contact model as notebooks use it: a DataFrame of impacts in, pulses with their
spread out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from ....dataset.table import POINTS, Inputs
from ...common.errors import raises_library_errors
from ...common.frames import facts_table, titled_table, with_units
from ...common.model_registry import models_extra, registry_of
from ...figures.figure import BandSeries, LineSeries, Plot, PlotAxis, PlotSeries, category
from ...figures.matplotlib_renderer import plot_on
from .datasets import predictor_column

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from ....array_types import Floats
    from ....dataset.table import Predictor
    from ....training.registry.records import Answer, RegisteredModel, Version

#: Of the bench: physical pulses need them even where they never varied and are no predictor.
_OF_BENCH = ("impactor_mass_kg", "plate_thickness_m")


@dataclass(frozen=True, eq=False)
class ContactPulses:
    """Predicted pulses of n impacts: `force_n` (n, 20) at equidistant points of the contact,
    `contact_time_s` (n,).

    The spreads are standard deviations of a new measurement, None where a law of physics gives
    none. `extrapolation` has a sentence for each impact that lies outside of what the model learned
    from, "" for the others.
    """

    label: str
    force_n: Floats
    contact_time_s: Floats
    force_spread_n: Floats | None
    contact_time_spread_s: Floats | None
    extrapolation: tuple[str, ...]
    index: pd.Index[Any]

    def to_frame(self) -> pd.DataFrame:
        """A row for each impact, with the index of the frame that was given: contact time, force
        points, spreads."""
        import pandas as pd

        columns: dict[str, Any] = {"contact_time_s": self.contact_time_s}
        if self.contact_time_spread_s is not None:
            columns["contact_time_spread_s"] = self.contact_time_spread_s
        columns |= {f"force_{point + 1:02d}_n": self.force_n[:, point] for point in range(POINTS)}
        if self.force_spread_n is not None:
            columns |= {
                f"force_spread_{point + 1:02d}_n": self.force_spread_n[:, point]
                for point in range(POINTS)
            }
        columns["extrapolation"] = self.extrapolation
        return with_units(pd.DataFrame(columns, index=self.index))

    def plot(self, ax: Axes | None = None) -> Axes:
        """The force of each impact over its contact, with 90 % bands where the model gives spreads.

        Parameters:
            ax: The axes to draw on; by default new ones.
        """
        return plot_on(self.figure(), ax)

    def figure(self) -> Plot:
        """The force of each impact over its contact, as a figure."""
        series: list[PlotSeries] = []
        for row, (force, duration) in enumerate(
            zip(self.force_n, self.contact_time_s, strict=True)
        ):
            name, role = str(self.index[row]), category(row)
            time_ms = np.linspace(0.0, 1e3 * duration, POINTS)
            if self.force_spread_n is not None:
                half = 1.645 * self.force_spread_n[row]
                low, high = 1e-3 * (force - half), 1e-3 * (force + half)
                series.append(BandSeries(time_ms, low, high, name=name, role=role))
            series.append(LineSeries(time_ms, 1e-3 * force, name=name, role=role))
        axes = PlotAxis("time since first contact", "ms"), PlotAxis("force", "kN")
        return Plot(f"Pulses predicted by {self.label}", *axes, tuple(series))

    def _repr_html_(self) -> str:
        return titled_table(f"{len(self.index)} pulses predicted by {self.label}", self.to_frame())


class PredictingVersion(Protocol):
    """A version that predicts, wherever the model itself is."""

    @property
    def version(self) -> Version:
        """The version as the registry lists it."""
        ...

    @property
    def predictors(self) -> tuple[Predictor, ...]:
        """What it predicts from."""
        ...

    @property
    def shots(self) -> int:
        """How many pulses it was trained on."""
        ...

    def predict(self, inputs: Inputs) -> Answer:
        """Pulses of impacts.

        Parameters:
            inputs: The impacts, with the predictors that the model learned from.
        """
        ...


class StoredModel:
    """A registered version. `columns` are those that `predict` needs, with the levels or the unit
    of each."""

    def __init__(self, registered: RegisteredModel | PredictingVersion) -> None:
        self._registered = registered

    @property
    def label(self) -> str:
        """ "hybrid@3"."""
        return self._registered.version.label

    @property
    def columns(self) -> dict[str, str]:
        """Column of a predictor -> its levels, or its unit."""
        predictors = self._registered.predictors
        return {
            predictor_column(predictor): ", ".join(predictor.levels) or predictor.unit or "number"
            for predictor in predictors
        }

    @raises_library_errors
    def predict(self, impacts: pd.DataFrame) -> ContactPulses:
        """The pulses of impacts.

        Parameters:
            impacts: An impact in each row, with the columns of `columns` in SI, as a dataset's
                `to_frame()` has them. `impactor_mass_kg` and `plate_thickness_m` are taken where
                they are columns, since some laws of contact need them; other columns are not looked
                at.

        Returns:
            Force (n, 20) in N and contact time (n,) in s, with the index of `impacts`.

        Raises:
            NotFoundError: For a missing column.
            InvalidValueError: For a level that the model does not know, and a value that is no
                number.
        """
        answer = self._registered.predict(_inputs(self._registered.predictors, impacts))
        return _pulses(self.label, answer, impacts.index)

    def __repr__(self) -> str:
        version = self._registered.version
        return (
            f"<model {self.label}: {version.dataset.name}, split {version.split}, "
            f"{self._registered.shots} pulses>"
        )

    def _repr_html_(self) -> str:
        return facts_table(repr(self)[1:-1], self.columns)


def read_model(url: str, name: str, split: str | None = None) -> StoredModel:
    """A registered version.

    Parameters:
        url: The address of the store, beside which the registry lies.
        name: "hybrid@3", "hybrid@champion", or "hybrid" for the newest one.
        split: The split that the newest version was judged on; by default any.

    Raises:
        LookupError: For an unknown model; the message names those there are.
        ValueError: For a damaged model.
    """
    return StoredModel(registered_model(url, name, split))


def registered_model(url: str, name: str, split: str | None = None) -> RegisteredModel:
    """A version as the registry gives it.

    Parameters:
        url: The address of the store, beside which the registry lies.
        name: "hybrid@3", "hybrid@champion", or "hybrid" for the newest one.
        split: The split that the newest version was judged on; by default any.

    Raises:
        LookupError: For an unknown model; the message names those there are.
        ValueError: For a damaged model.
    """
    from ....training.registry.listing import chosen

    with models_extra():
        registry = registry_of(url)
        return registry.load(chosen(registry.versions(), name, split))


def _inputs(predictors: tuple[Predictor, ...], impacts: pd.DataFrame) -> Inputs:
    wanted = [predictor_column(predictor) for predictor in predictors]
    missing = [column for column in wanted if column not in impacts.columns]
    if missing:
        raise LookupError(
            f"no column {', '.join(map(repr, missing))} in the impacts; the "
            f"model needs {', '.join(wanted)}"
        )
    columns = [
        _values(predictor, impacts[name])
        for predictor, name in zip(predictors, wanted, strict=True)
    ]
    bench = (
        _numbers(impacts[name]) if name in impacts.columns else np.full(len(impacts), np.nan)
        for name in _OF_BENCH
    )
    return Inputs(predictors, np.stack(columns, axis=1), *bench)


def _values(predictor: Predictor, column: pd.Series[Any]) -> Floats:
    if not predictor.levels:
        return _numbers(column)
    codes = column.map({level: float(code) for code, level in enumerate(predictor.levels)})
    unknown = column[codes.isna()]
    if len(unknown):
        levels = ", ".join(predictor.levels)
        raise ValueError(
            f"{column.name} is {unknown.iloc[0]!r} in row "
            f"{unknown.index[0]!r}; expected one of {levels}"
        )
    return _numbers(codes)


def _numbers(column: pd.Series[Any]) -> Floats:
    try:
        return column.to_numpy(dtype="float64", na_value=float("nan"))
    except (TypeError, ValueError) as error:
        raise ValueError(
            f"{column.name} has a value that is no number ({error}); expected numbers in SI"
        ) from error


def _pulses(label: str, answer: Answer, index: pd.Index[Any]) -> ContactPulses:
    pulses = answer.prediction
    return ContactPulses(
        label=label,
        force_n=pulses.force_n,
        contact_time_s=pulses.contact_time_s,
        force_spread_n=pulses.force_spread_n,
        contact_time_spread_s=pulses.contact_time_spread_s,
        extrapolation=tuple("; ".join(map(str, outside)) for outside in answer.outside),
        index=index,
    )
