"""Pulses and recordings as arrays with time and unit, of which a slice reads only what it needs;
impacts as DataFrames.

The listing of the command line goes page by page and row by row (`schema.listings`). A frame is
made of whole columns with the same names, order and values: one query for the rows, one for the
factors, one for the findings.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from sqlalchemy import select

from ....array_types import Floats
from ....ingest.storing.stored_channels import list_channels, read_channel
from ....schema.campaigns import Campaign, ConfigurationLevel, Factor, FactorLevel
from ....schema.conditions import (
    CHANNEL_COLUMNS,
    IMPACT_COLUMNS,
    IN_USE,
    LARGEST,
    Condition,
    listing_key,
    restricted,
)
from ....schema.impacts import ChannelFigures, Impact, Pulse, velocity_kind
from ....schema.recordings import NOT_JUDGED, SEVERITIES, QualityFinding, RecordedChannel
from ....schema.series import as_floats, resolve
from ....twin.contact.measured_restitution import RecordedPulse, poisson
from ...common.errors import library_errors, raises_library_errors
from ...common.frames import facts_table, frame_of, titled_table, with_units
from ...common.quantities import shown_unit
from ...figures.figure import (
    DIMENSIONLESS,
    ColourRole,
    LineSeries,
    Plot,
    PlotAxis,
    PlotGrid,
    PointSeries,
)
from ...figures.matplotlib_renderer import plot_on, plot_rows
from .impact import PULSE_FIGURES, get_impact

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from sqlalchemy.orm import Session

    from ....schema.session import Store
    from .listing import SelectedRows


@dataclass(frozen=True, eq=False)
class ForcePulse:
    """The contact force of one impact: the smoothing spline of the pulse in use.

    `time_s` (n,) begins with the contact, `force_n` (n,) is above the rest before it;
    `points_time_s` and `points_n` (20,) are the equidistant points that models learn from.
    `figures` are SI, with the unit in the name.
    """

    impact: int
    time_s: Floats
    force_n: Floats
    points_time_s: Floats
    points_n: Floats
    figures: Mapping[str, float]

    def to_frame(self) -> pd.DataFrame:
        """Columns `time_s` and `force_n`; `.attrs` holds the units and the figures."""
        import pandas as pd

        frame = pd.DataFrame({"time_s": self.time_s, "force_n": self.force_n})
        frame.attrs["units"] = {"time_s": "s", "force_n": "N"}
        frame.attrs |= {"impact": self.impact, "figures": dict(self.figures)}
        return frame

    @raises_library_errors
    def restitution(self, mass_kg: float, impact_velocity_m_s: float) -> float:
        """The coefficient of restitution P_r / P_c of the pulse.

        Parameters:
            mass_kg: The mass of the impactor.
            impact_velocity_m_s: The velocity of the impactor before the contact.

        Returns:
            The coefficient, NaN where the impactor does not come to rest within the pulse.

        Raises:
            InvalidValueError: For a mass or velocity that is not positive.

        Source:
            Poisson, eq. 1.10.
        """
        record = RecordedPulse(
            self.force_n[np.newaxis],
            np.diff(self.time_s[:2]),
            np.array([mass_kg], dtype=np.float64),
            np.array([impact_velocity_m_s], dtype=np.float64),
        )
        return float(poisson(record)[0])

    def plot(self, ax: Axes | None = None) -> Axes:
        """The spline and its points over the time since first contact.

        Parameters:
            ax: The axes to draw on; by default new ones.
        """
        return plot_on(self.figure(), ax)

    def figure(self) -> Plot:
        """The spline and its points as a figure."""
        name = f"impact {self.impact}"
        spline = LineSeries(self.time_s * 1e3, self.force_n * 1e-3, name=name)
        points = PointSeries(
            self.points_time_s * 1e3,
            self.points_n * 1e-3,
            size=5,
            filled=False,
            detail=f"points of {name}",
            role=ColourRole.INK,
        )
        axes = PlotAxis("time since first contact", "ms"), PlotAxis("force", "kN")
        return Plot(name, *axes, (spline, points))

    def _repr_html_(self) -> str:
        return facts_table(
            f"pulse of impact {self.impact}", {name: f"{x:.5g}" for name, x in self.figures.items()}
        )


def read_impacts(
    store: Store,
    selection: SelectedRows,
    limit: int | None = None,
    named: Iterable[str] = (),
) -> pd.DataFrame:
    """Impacts in the order of storage, with the columns that `impacts_frame` gives.

    Parameters:
        store: The store.
        selection: Whose impacts, and the conditions that they meet; its `limit` is not looked at.
        limit: The largest number of rows; by default all.
        named: Columns that are there also where no impact has the factor.

    Raises:
        LookupError: For an unknown campaign.
        ValueError: For a condition that cannot be read.
    """
    with store.reading() as session:
        frame = impacts_frame(session, selection.campaign, selection.conditions(), limit)
        return with_absent_factors(session, frame, named)


def read_channel_facts(store: Store, impact: int) -> tuple[str, list[ChannelFacts]]:
    """The path of the recording of an impact, and its channels.

    Parameters:
        store: The store.
        impact: The key of the impact.

    Raises:
        LookupError: For an unknown impact, and for one of which only the figures were ingested.
    """
    with store.reading() as session:
        row = get_impact(session, impact)
        if row.recording_id is None:
            raise LookupError(
                f"impact {impact} has no recording in the store: only its figures were ingested"
            )
        path = row.recording.path if row.recording else ""
        return path, list(map(ChannelFacts.of, list_channels(session, row.recording_id)))


def read_recording(store: Store, impact: int) -> StoredRecording:
    """The recording of an impact; its samples are read when they are used.

    Parameters:
        store: The store.
        impact: The key of the impact.

    Raises:
        LookupError: As `read_channel_facts`.
    """

    def read(key: int, first: int, stop: int) -> Floats:
        with store.reading() as session:
            row = session.get_one(RecordedChannel, key)
            return np.asarray(read_channel(session, row, first, stop).si)

    path, channels = read_channel_facts(store, impact)
    return StoredRecording(impact, path, [StoredChannel(facts, read) for facts in channels])


def read_pulse(session: Session, impact: int) -> ForcePulse:
    """The pulse in use of an impact.

    Parameters:
        session: A session of the store.
        impact: The key of the impact.

    Raises:
        LookupError: For an unknown impact, and for one without a pulse.
    """
    get_impact(session, impact)
    row = session.scalars(
        select(Pulse).where(Pulse.impact_id == impact, Pulse.current)
    ).one_or_none()
    if row is None:
        raise LookupError(f"impact {impact} has no pulse; pyroshock show {impact} says why")
    force = as_floats(row.fine_force_n, f"the force of pulse {row.id}")
    points = np.asarray(row.force_points_n, dtype=np.float64)
    return ForcePulse(
        impact=impact,
        time_s=np.arange(force.size, dtype=np.float64) * row.fine_period_s,
        force_n=force,
        points_time_s=np.linspace(0.0, row.contact_time_s, points.size),
        points_n=points,
        figures={name: float(getattr(row, name)) for name in PULSE_FIGURES},
    )


@dataclass(frozen=True)
class ChannelFacts:
    """What is known of a channel without its samples; `key` is its row of the store."""

    key: int
    name: str
    quantity: str
    unit: str
    sampling_rate_hz: float
    start_s: float
    samples: int

    @classmethod
    def of(cls, row: RecordedChannel) -> ChannelFacts:
        """The facts of a row of the store.

        Parameters:
            row: The channel.
        """
        rate, start = row.sampling_rate_hz, row.start_s
        return cls(row.id, row.name, row.quantity, row.si_unit, rate, start, row.samples)


class StoredChannel:
    """A recorded channel of the store. `channel[a:b]` reads the samples a to b (exclusive) in SI,
    and no others.

    `unit` is the SI unit, `sampling_rate_hz` the rate, `start_s` the time of the first sample on
    the recording's clock.
    """

    def __init__(self, facts: ChannelFacts, read: Callable[[int, int, int], Floats]) -> None:
        """`read` gives the samples of the channel with this key from the first to before the
        last."""
        self.facts, self._read = facts, read
        self.name, self.quantity, self.unit = facts.name, facts.quantity, facts.unit
        self.sampling_rate_hz, self.start_s = facts.sampling_rate_hz, facts.start_s
        self._samples = facts.samples

    def __len__(self) -> int:
        return self._samples

    @raises_library_errors
    def __getitem__(self, samples: slice) -> Floats:
        if not isinstance(samples, slice) or samples.step not in (None, 1):
            raise ValueError(
                f"{self.name}[{samples!r}]; expected a slice of samples "
                f"without a step, such as [100:200]"
            )
        return self._read(self.facts.key, *resolve(samples.start, samples.stop, self._samples))

    @property
    def time_s(self) -> Floats:
        """Times of all samples (n,), on the recording's clock; nothing is read."""
        return self.start_s + np.arange(self._samples) / self.sampling_rate_hz

    @property
    def values(self) -> Floats:
        """All samples (n,) in SI."""
        return self[:]

    def between(self, start_s: float, stop_s: float) -> pd.Series[float]:
        """The samples between two times, both included, over their time. Reads only those.

        Parameters:
            start_s: The first time, on the recording's clock.
            stop_s: The last time.

        Raises:
            InvalidValueError: For times that do not rise.
        """
        first, stop = self._span(start_s, stop_s)
        return self._series(first, stop)

    def to_series(self) -> pd.Series[float]:
        """All samples in SI over their time (index `time_s`)."""
        return self._series(0, self._samples)

    def to_frame(self) -> pd.DataFrame:
        """Columns `time_s` and the channel's name with its unit in `.attrs["units"]`."""
        frame = self.to_series().reset_index()
        frame.attrs["units"] = {"time_s": "s", self.name: self.unit}
        return frame

    def plot(
        self, ax: Axes | None = None, *, start_s: float | None = None, stop_s: float | None = None
    ) -> Axes:
        """The channel, or the part between two times, over the time of the recording.

        Parameters:
            ax: The axes to draw on; by default new ones.
            start_s: The first time, on the recording's clock; by default that of the first sample.
            stop_s: The last time; by default that of the last sample.
        """
        return plot_on(self.figure(start_s=start_s, stop_s=stop_s), ax)

    def figure(self, *, start_s: float | None = None, stop_s: float | None = None) -> Plot:
        """The channel, or the part between two times, as a figure.

        Parameters:
            start_s: The first time, on the recording's clock; by default that of the first sample.
            stop_s: The last time; by default that of the last sample.
        """
        first, stop = self._span(
            self.start_s if start_s is None else start_s, float("inf") if stop_s is None else stop_s
        )
        series = self._series(first, stop)
        (time_unit, time_scale), (unit, scale) = shown_unit("s"), shown_unit(self.unit)
        line = LineSeries(
            time_scale * series.index.to_numpy(),
            np.asarray(scale * series.to_numpy(), dtype=np.float64),
            width=1,
            detail=self.name,
        )
        axes = PlotAxis("time", time_unit), PlotAxis(self.quantity, unit or DIMENSIONLESS)
        return Plot(self.name, *axes, (line,), height=200)

    def srs(
        self,
        *,
        q: float = 10.0,
        frequencies: Any = None,
        rest: str | None = None,
        hit: int | str | None = None,
    ) -> pd.Series[float]:
        """The maximax shock response spectrum of an acceleration, as `pyroshock.srs` gives it.

        Parameters:
            q: Q of the oscillators; by default 10.
            frequencies: The lines in Hz, or "100:10000:6" for six lines an octave; by default six
                an octave over what the record's length and rate allow.
            rest: The zero of the record: "none" for zero as recorded, or "0ms:5ms" for the mean
                between two times; by default the rest before the shock, where there is one.
            hit: Of a record with several hits the number from 1, or "whole" for all of it; by
                default the whole record, which may hold one hit only.

        Raises:
            InvalidValueError: For a channel that is no acceleration, and for what `pyroshock.srs`
                refuses.
        """
        from .spectra_service import srs

        if self.quantity != "acceleration":
            with library_errors():
                raise ValueError(
                    f"{self.name} is a channel of {self.quantity}; a spectrum needs an acceleration"
                )
        return srs(
            self.to_series(),
            self.sampling_rate_hz,
            q=q,
            frequencies=frequencies,
            rest=rest,
            hit=hit,
        )

    def __repr__(self) -> str:
        return (
            f"<{self.name}: {self.quantity} in {self.unit}, {self._samples} "
            f"samples at {self.sampling_rate_hz:g} Hz>"
        )

    def _span(self, start_s: float, stop_s: float) -> tuple[int, int]:
        if not start_s <= stop_s:
            with library_errors():
                raise ValueError(
                    f"a window from {start_s!r} to {stop_s!r} s; expected two times in rising order"
                )
        # Times that a user copies from an index must find their own samples again.
        slack = 1e-6
        first = np.ceil((start_s - self.start_s) * self.sampling_rate_hz - slack)
        last = np.floor((stop_s - self.start_s) * self.sampling_rate_hz + slack)
        first, last = (float(np.clip(sample, -1, self._samples)) for sample in (first, last))
        return max(int(first), 0), max(min(int(last) + 1, self._samples), 0)

    def _series(self, first: int, stop: int) -> pd.Series[float]:
        import pandas as pd

        stop = max(first, stop)
        times = self.start_s + np.arange(first, stop) / self.sampling_rate_hz
        series = pd.Series(self[first:stop], index=pd.Index(times, name="time_s"), name=self.name)
        series.attrs["unit"] = self.unit
        return series


class StoredRecording(Mapping[str, StoredChannel]):
    """The channels of the recording of one impact, by name: `store.recording(12)["force"]`. Nothing
    is read yet."""

    def __init__(self, impact: int, path: str, channels: Iterable[StoredChannel]) -> None:
        self.impact, self.path = impact, path
        self._channels = {channel.name: channel for channel in channels}

    def __getitem__(self, channel: str) -> StoredChannel:
        if channel not in self._channels:
            with library_errors():
                raise LookupError(
                    f"no channel {channel!r} in {self.path}; there are: {', '.join(self._channels)}"
                )
        return self._channels[channel]

    def __iter__(self) -> Iterator[str]:
        return iter(self._channels)

    def __len__(self) -> int:
        return len(self._channels)

    def to_frame(self) -> pd.DataFrame:
        """The channels with quantity, unit, rate, samples and start; no sample is read."""
        return frame_of(
            {
                "channel": channel.name,
                "quantity": channel.quantity,
                "unit": channel.unit,
                "sampling_rate_hz": channel.sampling_rate_hz,
                "samples": len(channel),
                "start_s": channel.start_s,
            }
            for channel in self._channels.values()
        )

    def plot(self, *, start_s: float | None = None, stop_s: float | None = None) -> list[Axes]:
        """Every channel in axes of its own, one below the other, with a common time.

        Parameters:
            start_s: The first time, on the recording's clock; by default that of the first sample.
            stop_s: The last time; by default that of the last sample.
        """
        return plot_rows(self.figure(start_s=start_s, stop_s=stop_s))

    def figure(self, *, start_s: float | None = None, stop_s: float | None = None) -> PlotGrid:
        """Every channel, one below the other, as a figure.

        Parameters:
            start_s: The first time, on the recording's clock; by default that of the first sample.
            stop_s: The last time; by default that of the last sample.

        Raises:
            ValueError: For a recording without channels.
        """
        plots = [
            channel.figure(start_s=start_s, stop_s=stop_s) for channel in self._channels.values()
        ]
        rows = tuple((plot,) for plot in plots)
        return PlotGrid(self.path, rows, share_x=True)

    def __repr__(self) -> str:
        return f"<recording {self.path} of impact {self.impact}: {', '.join(self._channels)}>"

    def _repr_html_(self) -> str:
        return titled_table(f"{self.path}, impact {self.impact}", self.to_frame())


#: Before the factors, and behind them, in the order of the listing.
_FIRST = ("id", "campaign", "run", "repetition")
_FIGURES = ("contact_time_s", "peak_force_n", "impulse_n_s", "compression_time_s")


def impacts_frame(
    session: Session,
    campaign: str | None = None,
    conditions: tuple[Condition, ...] = (),
    limit: int | None = None,
) -> pd.DataFrame:
    """The rows of `pyroshock impacts`, in order of their key; a factor that an impact does not have
    is missing there.

    Parameters:
        session: A session of the store.
        campaign: The name of the campaign; by default the impacts of all campaigns.
        conditions: What every row must fulfil; by default nothing.
        limit: The largest number of rows; by default all.

    Raises:
        UnknownFieldError: For a condition on nothing known.
        LookupError: For an unknown campaign.
        ValueError: For a column that is compared with a word.
    """
    import pandas as pd

    columns = {
        "campaign": Campaign.name,
        "configuration": Impact.configuration_id,
        "recording": Impact.recording_id,
        "source": Impact.velocity_source,
        **IMPACT_COLUMNS,
    }
    query = select(*(column.label(name) for name, column in columns.items())).select_from(Impact)
    query = query.join(Campaign, Impact.campaign_id == Campaign.id)
    query = query.outerjoin(Pulse, IN_USE).outerjoin(ChannelFigures, LARGEST)
    query, _ = restricted(session, query, Impact, IMPACT_COLUMNS, campaign, conditions)
    rows = _read(session, query.order_by(Impact.id).limit(limit))
    # Where no impact has a figure, pandas would make a column of objects.
    figures = ("impact_velocity_m_s", *_FIGURES, *CHANNEL_COLUMNS)
    rows = rows.astype(dict.fromkeys(figures, "float64"))
    factors = _factors(session, np.unique(rows["configuration"].to_numpy()))
    kinds = {source: velocity_kind(source) for source in rows["source"].dropna().unique()}
    quality = _quality(session, rows)
    parts: list[pd.DataFrame] = [
        rows[list(_FIRST)],
        factors.take(factors.index.get_indexer(pd.Index(rows["configuration"]))).set_axis(
            rows.index
        ),
        rows[["impact_velocity_m_s"]].assign(velocity_kind=rows["source"].map(kinds)),
        rows[list(_FIGURES)].assign(quality=quality),
        rows[list(CHANNEL_COLUMNS)],
    ]
    return with_units(pd.concat(parts, axis=1))


def with_absent_factors(
    session: Session, frame: pd.DataFrame, names: Iterable[str]
) -> pd.DataFrame:
    """The frame with an empty column for each factor that is one of the store but of none of its
    impacts.

    Parameters:
        session: A session of the store.
        frame: The impacts, as `impacts_frame` gives them.
        names: Names of columns that are asked for; those that the frame has, and those that are no
            factor of the store, change nothing.
    """
    missing = set(names) - set(frame.columns)
    if not missing:
        return frame
    factor_keys = {
        listing_key(name, si_unit)
        for name, si_unit in session.execute(select(Factor.name, Factor.si_unit))
    }
    return frame.assign(**dict.fromkeys(sorted(missing & factor_keys), float("nan")))


def _read(session: Session, query: Any) -> pd.DataFrame:
    import pandas as pd

    return pd.read_sql(query, session.connection())


def _factors(session: Session, configurations: Any) -> pd.DataFrame:
    """Levels by configuration (rows) and factor (columns, in the order of their keys)."""
    import pandas as pd

    query = (
        select(
            ConfigurationLevel.configuration_id, Factor.id, Factor.name, Factor.si_unit,
            FactorLevel.label,
            FactorLevel.number,
        )
        .join(FactorLevel, ConfigurationLevel.level_id == FactorLevel.id)
        .join(Factor, FactorLevel.factor_id == Factor.id)
    )  # fmt: skip
    # A long list of keys costs more than the few configurations of other campaigns.
    keys = {int(key) for key in configurations}
    if len(keys) <= 500:
        query = query.where(ConfigurationLevel.configuration_id.in_(keys))
    columns: dict[tuple[int, str], dict[int, Any]] = {}
    for configuration, factor, name, si_unit, label, number in session.execute(query):
        if configuration in keys:
            level = label if number is None else number
            columns.setdefault((factor, listing_key(name, si_unit)), {})[configuration] = level
    index = pd.Index(configurations)
    return pd.DataFrame(
        {key: pd.Series(levels).reindex(index) for (_, key), levels in sorted(columns.items())},
        index=index,
    )


def _quality(session: Session, rows: pd.DataFrame) -> pd.Series[str]:
    """The worst severity of each impact's own findings and its recording's, where it is more than a
    note."""
    import pandas as pd

    doubts = SEVERITIES[1:]
    query = select(QualityFinding.recording_id, QualityFinding.impact_id, QualityFinding.severity)
    findings = _read(session, query.where(QualityFinding.severity.in_(doubts)).distinct())
    rank = findings["severity"].map(
        {severity: number for number, severity in enumerate(doubts, start=1)}
    )
    whole = findings["impact_id"].isna()
    of_recording = rank[whole].groupby(findings["recording_id"][whole]).max()
    of_impact = rank[~whole].groupby(findings["impact_id"][~whole]).max()
    worst = pd.concat([rows["recording"].map(of_recording), rows["id"].map(of_impact)], axis=1).max(
        axis=1
    )
    quality = worst.fillna(0).map(dict(enumerate(("ok", *doubts)))).astype(object)
    return quality.where(rows["recording"].notna(), NOT_JUDGED)
