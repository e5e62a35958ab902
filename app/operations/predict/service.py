"""A predicted shot (numbers and series with 90 % bands, units, tables and plots), and shots as a
DataFrame whose columns are arguments of `predict`, or those of a table of runs, in its units or in
SI."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from ....array_types import Floats
from ....schema.known_factors import KNOWN_FACTORS, level_label
from ....twin.prediction import Band, Quantity
from ...common.errors import argument_names, library_errors
from ...common.frames import frame_of, titled_table
from ...common.number_format import format_interval
from ...common.quantities import shown_unit
from ...figures.figure import (
    DIMENSIONLESS,
    BandSeries,
    LineSeries,
    Plot,
    PlotAxis,
    PlotGrid,
    PointSeries,
    Scale,
    as_floats,
    category,
)
from ...figures.matplotlib_renderer import axes_or_new, draw_plot, plot_on, plot_rows
from ..faults import argument_of, read_arguments
from ..operation import Result, ResultTable
from ..sentence import Sentence
from .batch import FIELDS, ShotRow, rows_of_table
from .figures import prediction_figure
from .predicting import prediction_json
from .request import ShotRequest
from .same_setting import MeasuredRange, setting_sentences
from .tables import quantity_rows, spectrum_rows
from .validity import beyond_rows, domain_sentences, warning_sentences

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from ....twin.prediction import Prediction
    from ...figures.figure import Figure
    from ...twins.building import BuiltTwin


@dataclass(frozen=True)
class PredictedNumber:
    """A number with its 90 % band: `mean`, `lower` and `upper` in `unit`. `float(...)` is the
    mean."""

    name: str
    mean: float
    lower: float
    upper: float
    unit: str

    @classmethod
    def of(cls, name: str, quantity: Quantity, unit: str) -> PredictedNumber:
        """A number from the twin's quantity.

        Parameters:
            name: What the number is, in words, such as "peak force".
            quantity: Mean and 90 % band, as the twin predicts them.
            unit: The unit of mean and band, such as "N".
        """
        return cls(name, quantity.mean, *quantity.ci90, unit)

    @property
    def ci90(self) -> tuple[float, float]:
        """Lower and upper end of the 90 % band."""
        return self.lower, self.upper

    def to_frame(self) -> pd.DataFrame:
        """One row: quantity, mean, lower, upper, unit."""
        return frame_of([self._row()])

    def plot(self, ax: Axes | None = None) -> Axes:
        """The mean and its band.

        Parameters:
            ax: The axes to draw on; by default new ones.
        """
        return plot_on(self.figure(), ax)

    def figure(self) -> Plot:
        """The mean and its band as a figure."""
        unit, scale = shown_unit(self.unit)
        mean, low, high = (as_floats([scale * end]) for end in (self.mean, *self.ci90))
        point = PointSeries(mean, np.zeros(1), x_low=low, x_high=high, detail=self.name)
        row = PlotAxis("", DIMENSIONLESS, hidden=True)
        return Plot(
            self.name, PlotAxis(self.name, unit or DIMENSIONLESS), row, (point,), height=160
        )

    def __float__(self) -> float:
        return self.mean

    def __repr__(self) -> str:
        mean, low, high = format_interval(self.mean, *self.ci90)
        return f"{mean} {self.unit} ({low} to {high})"

    def _row(self) -> dict[str, Any]:
        columns = asdict(self)
        return {"quantity": columns.pop("name"), **columns}


@dataclass(frozen=True, eq=False)
class PredictedSeries:
    """A series with its 90 % band: `mean`, `lower` and `upper` (n,) in `unit`, over `x` (n,) in
    `x_unit`."""

    name: str
    x: Floats
    mean: Floats
    lower: Floats
    upper: Floats
    unit: str
    x_name: str
    x_unit: str
    logarithmic: bool = False

    def __len__(self) -> int:
        return len(self.x)

    def to_frame(self) -> pd.DataFrame:
        """Columns mean, lower and upper over the index `x_name`; `.attrs["units"]` has the
        units."""
        import pandas as pd

        columns = {"mean": self.mean, "lower": self.lower, "upper": self.upper}
        frame = pd.DataFrame(columns, index=pd.Index(self.x, name=self.x_name))
        frame.attrs["units"] = {self.x_name: self.x_unit, **dict.fromkeys(columns, self.unit)}
        return frame

    def plot(self, ax: Axes | None = None, **line: Any) -> Axes:
        """The mean as a line, the band filled; a spectrum on logarithmic axes.

        Parameters:
            ax: The axes to draw on; by default new ones.
            line: Properties of the line of the mean, as `Axes.plot` takes them.
        """
        axes = axes_or_new(ax)
        _, (mean, *_) = draw_plot(self.figure(), axes)
        mean.set(**{"label": self.name, **line})
        return axes

    def figure(self) -> Plot:
        """The mean and its band as a figure."""
        return Plot(self.name, *self._axes(), tuple(self._drawn("")))

    def _axes(self) -> tuple[PlotAxis, PlotAxis]:
        (x_unit, _), (unit, _) = shown_unit(self.x_unit), shown_unit(self.unit)
        x_name = self.x_name.rpartition("_")[0].replace("_", " ")
        scale: Scale = "log" if self.logarithmic else "linear"
        return PlotAxis(x_name, x_unit, scale), PlotAxis(self.name, unit or DIMENSIONLESS, scale)

    def _drawn(self, name: str, i: int = 0) -> tuple[BandSeries, LineSeries]:
        (_, x_scale), (_, scale) = shown_unit(self.x_unit), shown_unit(self.unit)
        x, low, high = x_scale * self.x, scale * self.lower, scale * self.upper
        band = BandSeries(x, low, high, name=name, detail="90 % band", role=category(i))
        mean = LineSeries(x, scale * self.mean, name=name, detail=self.name, role=category(i))
        return band, mean

    def __repr__(self) -> str:
        return (
            f"<{self.name} in {self.unit}: {len(self)} points, largest mean "
            f"{np.max(np.abs(self.mean)):.4g}>"
        )


class SensorSeries(Mapping[str, PredictedSeries]):
    """A predicted series for each sensor, by its name: `p.srs["acceleration_1"]`.

    `x`, `mean`, `lower` and `upper` are those of the first sensor; they raise `NotFoundError` for a
    twin without a plate.
    """

    def __init__(self, series: Mapping[str, PredictedSeries]) -> None:
        self._series = dict(series)

    def __getitem__(self, sensor: str) -> PredictedSeries:
        if sensor not in self._series:
            with library_errors():
                raise LookupError(
                    f"no sensor {sensor!r}; there are: {', '.join(self._series) or 'none'}"
                )
        return self._series[sensor]

    def __iter__(self) -> Iterator[str]:
        return iter(self._series)

    def __len__(self) -> int:
        return len(self._series)

    @property
    def x(self) -> Floats:
        """Time (s) or frequency (Hz), common to all sensors: (n,)."""
        return self._first().x

    @property
    def mean(self) -> Floats:
        """Of the first sensor, (n,)."""
        return self._first().mean

    @property
    def lower(self) -> Floats:
        """Lower end of the first sensor's band, (n,)."""
        return self._first().lower

    @property
    def upper(self) -> Floats:
        """Upper end of the first sensor's band, (n,)."""
        return self._first().upper

    @property
    def unit(self) -> str:
        """Of mean, lower and upper."""
        return self._first().unit

    def to_frame(self) -> pd.DataFrame:
        """Columns (sensor, mean | lower | upper) over the common index."""
        import pandas as pd

        frames = {sensor: series.to_frame() for sensor, series in self._series.items()}
        if not frames:
            return pd.DataFrame()
        frame = pd.concat(frames, axis=1, names=["sensor", "value"])
        frame.attrs["units"] = self._first().to_frame().attrs["units"]
        return frame

    def plot(self, ax: Axes | None = None) -> Axes:
        """All sensors in one pair of axes.

        Parameters:
            ax: The axes to draw on; by default new ones.

        Raises:
            NotFoundError: For a twin without a plate.
        """
        return plot_on(self.figure(), ax)

    def figure(self) -> Plot:
        """All sensors in one pair of axes, as a figure. Raises `LookupError` without a plate."""
        first = self._first()
        drawn = [
            own
            for i, (sensor, series) in enumerate(self._series.items())
            for own in series._drawn(sensor, i)
        ]
        return Plot(first.name, *first._axes(), tuple(drawn))

    def __repr__(self) -> str:
        return f"<{', '.join(self._series) or 'no sensors: the twin has no plate'}>"

    def _first(self) -> PredictedSeries:
        if not self._series:
            with library_errors():
                raise LookupError("the twin has no plate, and so no sensors")
        return next(iter(self._series.values()))


@dataclass(frozen=True, eq=False)
class ShotPrediction(Result):
    """What the twin predicts of one shot, each number and series with its 90 % band.

    `built` is the twin, and `prediction` its record; `measured` is what shots of the bench measured
    at this setting, by quantity.
    """

    built: BuiltTwin
    prediction: Prediction
    measured: Mapping[str, MeasuredRange] = field(default_factory=dict)

    def notes(self) -> Sequence[str]:
        """What was assumed, and where the contact is asked beyond its domain."""
        return (*self.built.notes, *map(str, domain_sentences(self.prediction)))

    def sentences(self) -> Sequence[Sentence]:
        """What the bands rest on, and what was measured at this setting."""
        rests_on = (Sentence(self.rests_on),) if self.rests_on else ()
        return (*rests_on, *setting_sentences(self.measured, self.prediction))

    def tables(self) -> Sequence[ResultTable]:
        """The numbers, the spectra, what lies beyond the learned shots, and what answered."""
        beyond = beyond_rows(self.prediction)
        models = self.prediction.models.items()
        return (
            ResultTable(
                "This shot, with 90 % bands", list(quantity_rows(self.prediction, self.measured))
            ),
            ResultTable(
                "Shock response spectrum",
                list(spectrum_rows(self.prediction)),
                "no plate: no spectrum",
            ),
            *([ResultTable("Beyond what is known", beyond)] if beyond else ()),
            ResultTable(
                "What answered",
                [{"stage": stage, "answered": answer} for stage, answer in models],
            ),
        )

    def figures(self) -> Sequence[Figure]:
        """Force, accelerations and spectra."""
        return (prediction_figure(self.prediction),)

    def next_command(self) -> Sequence[str]:
        """How far it can be trusted."""
        return ("validate", self.built.bench.campaign or "CAMPAIGN")

    @property
    def velocity(self) -> PredictedNumber:
        """Of impact, m/s."""
        return PredictedNumber.of("velocity", self.prediction.velocity_m_s, "m/s")

    @property
    def peak_force(self) -> PredictedNumber:
        """The largest force of the contact, N."""
        return PredictedNumber.of("peak force", self.prediction.peak_force_n, "N")

    @property
    def contact_time(self) -> PredictedNumber:
        """Duration of the contact, s."""
        return PredictedNumber.of("contact time", self.prediction.contact_time_s, "s")

    @property
    def compression_time(self) -> PredictedNumber:
        """From first contact to the deepest indentation, s."""
        return PredictedNumber.of("compression time", self.prediction.compression_time_s, "s")

    @property
    def impulse(self) -> PredictedNumber:
        """The integral of the force, N s."""
        return PredictedNumber.of("impulse", self.prediction.impulse_n_s, "N s")

    @property
    def peak_acceleration(self) -> dict[str, PredictedNumber]:
        """The largest acceleration either way, m/s2, by sensor; its name says the band, that of the
        plate's modes."""
        from .tables import band_words

        band, predicted = band_words(self.prediction), self.prediction.peak_acceleration_m_s2
        return {
            sensor: PredictedNumber.of(
                f"peak acceleration, {sensor}, {band}", predicted(sensor), "m/s2"
            )
            for sensor in self.prediction.sensors
        }

    @property
    def force(self) -> PredictedSeries:
        """The force over the time since first contact, N."""
        return _series("force", self.prediction.time_s, self.prediction.force_n, "N", "time_s", "s")

    @cached_property
    def acceleration(self) -> SensorSeries:
        """The accelerations of the first 10 ms by sensor, m/s2."""
        series = {}
        for sensor in self.prediction.sensors:
            time, band = self.prediction.acceleration(sensor)
            series[sensor] = _series("acceleration", time, band, "m/s2", "time_s", "s")
        return SensorSeries(series)

    @cached_property
    def srs(self) -> SensorSeries:
        """The maximax shock response spectra by sensor, m/s2."""
        frequency = self.prediction.frequency_hz
        return SensorSeries(
            {
                sensor: _series(
                    "maximax SRS", frequency, band, "m/s2", "frequency_hz", "Hz", logarithmic=True
                )
                for sensor, band in self.prediction.spectra_m_s2.items()
            }
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """Where the twin was asked beyond what it knows, in sentences."""
        return tuple(argument_names(claim.text) for claim in warning_sentences(self.prediction))

    @property
    def rests_on(self) -> str:
        """What stands behind the bands, in one sentence."""
        return self.prediction.rests_on.sentence

    @property
    def extrapolation(self) -> pd.DataFrame:
        """Quantities that lie beyond what was recorded, a row each: the value asked and the range
        recorded, SI."""
        rows = [asdict(row) for row in self.prediction.extrapolation]
        return frame_of(rows, ("quantity", "asked", "low", "high"))

    def to_frame(self) -> pd.DataFrame:
        """The numbers, a row each: mean, lower, upper, unit."""
        contact = (self.contact_time, self.compression_time, self.peak_force, self.impulse)
        numbers = (self.velocity, *contact, *self.peak_acceleration.values())
        return frame_of(number._row() for number in numbers).set_index("quantity")

    def to_json(self) -> dict[str, Any]:
        """As `pyroshock predict --json` prints it."""
        return prediction_json(self.built, self.prediction)

    def plot(self) -> list[Axes]:
        """Force, accelerations and spectra, one below the other."""
        return plot_rows(self.figure())

    def figure(self) -> PlotGrid:
        """Force, accelerations and spectra, one below the other, as a figure."""
        return prediction_figure(self.prediction)

    def __repr__(self) -> str:
        return f"<predicted shot: {self.velocity!r}, {self.peak_force!r}, {self.contact_time!r}>"

    def _repr_html_(self) -> str:
        paragraphs = "".join(
            f"<p>{escape(line)}</p>" for line in (self.rests_on, *self.warnings) if line
        )
        return titled_table("predicted shot, with 90 % bands", self.to_frame()) + paragraphs


def _series(
    name: str,
    x: Floats,
    band: Band,
    unit: str,
    x_name: str,
    x_unit: str,
    *,
    logarithmic: bool = False,
) -> PredictedSeries:
    return PredictedSeries(
        name, x, band.mean, band.lower, band.upper, unit, x_name, x_unit, logarithmic
    )


_LABELS = ("run", "repetition")
#: Argument -> the column of a table of runs that says the same.
_OF_RUNS = {
    argument_of(name, ShotRequest.model_fields[name]): column for column, name in FIELDS.items()
}
#: Columns that only one of the two forms has.
_ARGUMENTS = tuple(argument for argument, column in _OF_RUNS.items() if argument != column)
#: Columns of the library's frames in SI -> that of a table of runs, and its unit in SI.
_IN_SI = {
    f"{factor.name}_{factor.si_unit.lower()}": (factor.column, factor.scale)
    for factor in KNOWN_FACTORS
    if factor.si_unit is not None and factor.scale != 1.0
}
_RUN_COLUMNS = {*FIELDS, *_IN_SI, "plate_material"}


def shot_rows(shots: pd.DataFrame) -> list[ShotRow]:
    """A shot for each row of a frame.

    Parameters:
        shots: A DataFrame with a shot in each row. Its columns are arguments of `predict`, or those
            of a table of runs, in its units or in SI. An empty cell is not given.

    Raises:
        ValueError: For what `predict` refuses, with the row; for a column that is no argument, and
            for no row.
    """
    if not len(shots):
        raise ValueError("shots has no row to predict")
    rows = [
        {str(name): value for name, value in row.items() if value is not None and value == value}
        for row in shots.to_dict("records")
    ]
    if not set(_ARGUMENTS) & set(map(str, shots.columns)):
        return rows_of_table(
            [dict(_cell(name, value) for name, value in row.items()) for row in rows], "shots"
        )
    columns = (*_OF_RUNS, *_LABELS)
    unknown = [str(name) for name in shots.columns if name not in columns]
    if unknown:
        given = next(name for name in _ARGUMENTS if name in shots.columns)
        beside = (
            f"; a table of runs has it, with {_OF_RUNS[given]!r} for "
            f"{given!r}: use the names of one form"
            if unknown[0] in _RUN_COLUMNS
            else f"; there are: {', '.join(columns)}"
        )
        raise ValueError(f"column {unknown[0]!r} of shots is no argument of predict{beside}")
    return [_shot_row(row, number) for number, row in enumerate(rows, 1)]


def _cell(name: str, value: Any) -> tuple[str, str]:
    """Column and text as a table of runs has them."""
    column, scale = _IN_SI.get(name, (name, None))
    return column, str(value) if scale is None else level_label(float(value) / scale)


def _shot_row(row: dict[str, Any], number: int) -> ShotRow:
    arguments = {name: value for name, value in row.items() if name not in _LABELS}
    labels = {name: str(value) for name, value in row.items()}
    try:
        return ShotRow(labels, read_arguments(ShotRequest, arguments), None)
    except ValueError as error:
        raise ValueError(f"shots, row {number}: {error}") from error
