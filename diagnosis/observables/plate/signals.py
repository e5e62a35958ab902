"""A campaign's accelerations as one block of one rate and length, each run on its own clock.

What drives a plate: true forces from readings, brought to the clock of an acceleration.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ....array_types import Floats
from ....twin.effects import Effect
from ....twin.plate.modal import ModalPlate
from ...record import CampaignRecord, Factor, Run, Series
from ..base import sensor_chain

#: A contact is over when its force stays below this share of its peak.
_OVER = 0.02
#: How far the impulse of samples may be off before they are too few to stand for a contact.
_NEAR = 0.2
#: Samples on either side of a contact that are kept, and in how many more the force fades: a cut
#: would be a jump, which the inverse of a low pass makes much of.
_AROUND, _FADE = 8, 16


def contact(force: Series) -> Series:
    """The force with its noise before and after the contact faded out."""
    acting = _acting(force)
    if not acting.size:
        return replace(force, values=np.zeros_like(force.values))
    # from the peak outwards, with gaps of `_AROUND` at most, so that a spike of noise far from it
    # is no contact
    parts = np.split(acting, np.flatnonzero(np.diff(acting) > _AROUND) + 1)
    peak = int(np.argmax(np.abs(force.values)))
    part = next(part for part in parts if part[-1] >= peak)
    place = np.arange(force.values.size)
    away = np.maximum(np.maximum(part[0] - place, place - part[-1]) - _AROUND, 0)
    fade = 0.5 * (1 + np.cos(np.pi * np.minimum(away / _FADE, 1.0)))
    return replace(force, values=force.values * fade)


def end_of(force: Series) -> float:
    """When the contact is over, s on the clock of the record."""
    acting = _acting(force)
    return float(force.time_s[acting[-1]]) if acting.size else force.start_s


def _acting(force: Series) -> NDArray[np.intp]:
    """The samples at which a force acts."""
    values = np.abs(force.values)
    return np.flatnonzero(values > _OVER * values.max(initial=0.0))


def true_force(reading: Series, effects: Sequence[Effect]) -> Series:
    """The force on the plate under a reading: what the force channel does to it undone."""
    chain = sensor_chain(effects, "measured_force_n")
    if not chain.effects:
        return reading
    return replace(reading, values=chain.true_force_n(reading.values, 1 / reading.sampling_rate_hz))


def on_clock(force: Series, first_s: float, step_s: float, samples: int) -> Floats:
    """(samples,) from `first_s` in steps of `step_s`, of the same impulse; 0 outside of the
    series."""
    at = first_s + step_s * np.arange(samples)
    sampled = np.interp(at, force.time_s, force.values, left=0.0, right=0.0)
    if step_s * force.sampling_rate_hz <= 1 + 1e-9:
        return np.asarray(sampled)
    impulse = float(force.values.sum()) / force.sampling_rate_hz
    sampled_impulse = float(sampled.sum()) * step_s
    if impulse > 0 and abs(sampled_impulse / impulse - 1) < _NEAR:
        return np.asarray(sampled * (impulse / sampled_impulse))
    # a contact of hardly a sample: each of its values is shared out between the two samples around
    # it
    place = (force.time_s - first_s) / step_s
    before = np.floor(place).astype(np.intp)
    out = np.zeros(samples)
    for index, weight in ((before, 1 - (place - before)), (before + 1, place - before)):
        good = (index >= 0) & (index < samples)
        np.add.at(
            out, index[good], (weight * force.values)[good] / (step_s * force.sampling_rate_hz)
        )
    return out


#: Kept before contact begins; its mean is what a channel shows at rest.
_BEFORE_S, _REST_SAMPLES = 1e-3, 16
#: Where no force says when a contact ends: soft tips stay on a plate for some milliseconds (thesis,
#: Fig. 4.6).
_CONTACT_S = 5e-3
#: Longer records are cut: by then a plate is silent, and every diagnosis would wait for it. A run
#: below this share of the usual length is left out.
_MOST_SAMPLES, _SHORT = 16384, 0.5
#: Samples between the end of a contact and the ringing that modes are read from.
_CLEAR = 4
#: The factor that says where a run hits the plate.
_POINT = "impact_position"


@dataclass(frozen=True, eq=False)
class AccelerationBlock:
    """Of R runs and S channels: `acceleration` (R, S, n), NaN for what was not measured.

    Sample k of run r is at `first_s[r]` + k `step_s`; contact begins at 0 s. `first_s` is NaN for a
    run without any.
    """

    acceleration: Floats
    channels: tuple[str, ...]
    first_s: Floats
    rate_hz: float

    @property
    def step_s(self) -> float:
        return 1 / self.rate_hz

    @property
    def samples(self) -> int:
        return int(self.acceleration.shape[2])

    @property
    def good(self) -> NDArray[np.bool_]:
        """(R, S): what was measured."""
        return np.asarray(np.isfinite(self.acceleration[:, :, 0]))

    def window_s(self, begin: int, end: int) -> tuple[float, float]:
        """Samples on the usual clock of the contact."""
        first = float(np.nanmedian(self.first_s))
        return first + begin * self.step_s, first + end * self.step_s

    @classmethod
    def of(
        cls, channels: tuple[str, ...], series: Sequence[Mapping[str, Series]]
    ) -> AccelerationBlock:
        """Of the series of each run by channel, at their most frequent rate.

        Series of other rates are left out, and runs that are much shorter than usual.
        """
        rates, counts = np.unique(
            [s.sampling_rate_hz for run in series for s in run.values()], return_counts=True
        )
        rate = float(rates[np.argmax(counts)])
        runs = [
            {
                name: s
                for name, s in run.items()
                if math.isclose(s.sampling_rate_hz, rate, rel_tol=1e-6)
            }
            for run in series
        ]
        lengths = np.array([min((s.values.size for s in run.values()), default=0) for run in runs])
        used = lengths >= max(_SHORT * float(np.median(lengths[lengths > 0])), 1)
        samples = min(_MOST_SAMPLES, int(lengths[used].min()))
        block = np.full((len(runs), len(channels), samples), np.nan)
        first_s = np.full(len(runs), np.nan)
        for row in np.flatnonzero(used):
            for name, s in runs[row].items():
                block[row, channels.index(name)] = s.values[:samples]
                first_s[row] = s.start_s
        return cls(block, channels, first_s, rate)


def ringdown_block(record: CampaignRecord, used: NDArray[np.bool_]) -> AccelerationBlock:
    """From the end of each contact on, of the runs that are `used` (R,), where it is numbers and
    not silent.

    Raises `ValueError` where none of them has an acceleration.
    """
    channels = tuple(dict.fromkeys(name for run in record.runs for name in run.accelerations))
    series = [
        _after_contact(run) if use else {} for run, use in zip(record.runs, used, strict=True)
    ]
    if not any(series):
        raise ValueError("no run has an acceleration of the plate that goes on after the contact")
    return AccelerationBlock.of(channels, series)


def _after_contact(run: Run) -> dict[str, Series]:
    over = (
        _CONTACT_S
        if run.force is None or not np.any(run.force.values)
        else end_of(contact(run.force))
    )
    series = {}
    for name, record in run.accelerations.items():
        begin = max(0, math.ceil((over - record.start_s) * record.sampling_rate_hz)) + _CLEAR
        rest = record.values[begin:]
        if rest.size and np.isfinite(rest).all() and np.ptp(rest) > 0:
            series[name] = Series(
                rest, record.sampling_rate_hz, record.start_s + begin / record.sampling_rate_hz
            )
    return series


@dataclass(frozen=True, eq=False)
class PlateSignals(AccelerationBlock):
    """Accelerations from just before contact on, and forces, of R runs and S channels.

    `force`: each run's contact as read, None where there is none. `ringing`: the sample from which
    every plate rings freely. `points`: where each run hits the plate. `assumptions` are sentences
    for the report.
    """

    force: tuple[Series | None, ...]
    ringing: int
    points: tuple[str, ...]
    assumptions: tuple[str, ...]

    @property
    def peak_n(self) -> Floats:
        """(R,): the largest magnitude of each force; NaN without a force."""
        return np.array(
            [np.nan if force is None else float(np.abs(force.values).max()) for force in self.force]
        )

    @cached_property
    def centre_s(self) -> Floats:
        """(R,): about when each force acts, with half of its weight before and half after; NaN
        without a force."""
        centres = np.full(len(self.force), np.nan)
        for run, force in enumerate(self.force):
            if force is not None:
                centres[run] = force.time_s @ np.abs(force.values) / np.abs(force.values).sum()
        return centres

    @cached_property
    def contact_s(self) -> float:
        """The usual contact time: how long half sines of the same impulses and peaks last."""
        forces = [
            (np.abs(force.values), force.sampling_rate_hz)
            for force in self.force
            if force is not None
        ]
        return float(
            np.median(
                [0.5 * np.pi * size.sum() / (size.max() * rate_hz) for size, rate_hz in forces]
            )
        )

    @classmethod
    def of_record(cls, record: CampaignRecord, plate: ModalPlate) -> PlateSignals:
        """Raises `ValueError` where no run has both a force and an acceleration at a sensor of the
        plate.

        And for an impact position that a plate with several has not.
        """
        channels = tuple(
            name for name in plate.sensors if any(name in run.accelerations for run in record.runs)
        )
        series = [_before_contact(run, channels) for run in record.runs]
        if not any(series):
            raise ValueError(
                f"campaign {record.name!r}: no run has a force and an "
                f"acceleration at one of the plate's sensors "
                f"({', '.join(plate.sensors)}); name the channels as the modal table does"
            )
        block = AccelerationBlock.of(channels, series)
        used = np.isfinite(block.first_s)
        forces = [
            contact(run.force) if use and run.force else None
            for run, use in zip(record.runs, used, strict=True)
        ]
        over = max(end_of(force) for force in forces if force is not None)
        points, assumptions = _impact_points(record, plate)
        assumptions.append(
            f"accelerations are compared over {block.samples / block.rate_hz * 1e3:.3g} ms"
        )
        left_out = sum(
            run.force is not None and bool(run.accelerations) for run in record.runs
        ) - int(used.sum())
        if left_out:
            assumptions.append(
                f"{left_out} runs whose accelerations are too short or of "
                f"another rate have no part in the plate"
            )
        other_rate = sum(len(run) for run, use in zip(series, used, strict=True) if use) - int(
            block.good.sum()
        )
        if other_rate:
            assumptions.append(
                f"{other_rate} accelerations of another sampling rate than "
                f"{block.rate_hz:g} Hz are left out"
            )
        return cls(
            **vars(block),
            force=tuple(forces),
            ringing=math.ceil((over - np.nanmin(block.first_s)) * block.rate_hz) + _CLEAR,
            points=points,
            assumptions=tuple(assumptions),
        )


def _before_contact(run: Run, channels: Sequence[str]) -> dict[str, Series]:
    """By channel from just before contact on, less the level at rest; none without a force."""
    if run.force is None or not np.any(run.force.values):
        return {}
    series = {}
    for name in channels:
        if (record := run.accelerations.get(name)) is not None:
            rate = record.sampling_rate_hz
            begin = max(0, math.ceil((-_BEFORE_S - record.start_s) * rate - 1e-6))
            before = record.values[: max(0, math.floor(-record.start_s * rate))]
            rest = float(before.mean()) if before.size - begin >= _REST_SAMPLES else 0.0
            series[name] = Series(record.values[begin:] - rest, rate, record.start_s + begin / rate)
    return series


def _impact_points(record: CampaignRecord, plate: ModalPlate) -> tuple[tuple[str, ...], list[str]]:
    """The impact point of every run by its name on the plate, and what is taken for granted of
    them.

    A plate with one point is hit there. Raises `ValueError` for a position that a plate with
    several has not.
    """
    names = [
        _point_name(configuration.factors.get(_POINT)) for configuration in record.configurations
    ]
    first = plate.impact_points[0]
    if len(plate.impact_points) == 1:
        others = sorted({name for name in names if name is not None} - {first})
        note = (
            f"impact positions {', '.join(others)} are taken for {first}: the "
            f"plate has shapes at no other"
        )
        return (first,) * len(record.runs), [note] if others else []
    for configuration, name in zip(record.configurations, names, strict=True):
        if name is not None and name not in plate.impact_points:
            raise ValueError(
                f"{configuration.label}: {_POINT} {name!r} is not on the "
                f"plate; it has {', '.join(plate.impact_points)}"
            )
    missing = f"where no {_POINT} is stated the plate is taken to be hit at {first}"
    return tuple(names[run.configuration] or first for run in record.runs), [
        missing
    ] if None in names else []


def _point_name(factor: Factor | None) -> str | None:
    if factor is None or factor == "":
        return None
    return factor if isinstance(factor, str) else f"#{factor:g}"
