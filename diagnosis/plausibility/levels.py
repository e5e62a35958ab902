"""Gaps between measured and nominal as logarithms of ratios, by configuration: what a wrong unit shifts."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..observables.base import Observable, Stage
from ..record import CampaignRecord, Floats

Kind = Literal["amplitude", "time", "impulse"]
_NATS_PER_DB = math.log(10) / 20
#: A robust standard deviation is this times the median absolute deviation (normal noise).
_MAD_TO_SIGMA = 1.4826


@dataclass(frozen=True)
class Column:
    """An observable that is a logarithm, its place in the stage, and what nats there are in its unit."""

    place: int
    channel: str
    kind: Kind
    nats: float

    @property
    def scales(self) -> bool:
        """Whether a wrong unit of its channel shifts it."""
        return self.kind != "time"

    def clock_shift(self, log_ratio: float) -> float:
        """By how much a clock that is wrong by `log_ratio` shifts it."""
        return 0.0 if self.kind == "amplitude" else log_ratio


def columns_of(stage: Stage) -> tuple[Column, ...]:
    """Those of a stage's observables that are levels in dB, or logarithms of velocity, force, impulse and width."""
    found = ((place, item, _kind(item)) for place, item in enumerate(stage.observables))
    return tuple(
        Column(place, item.channel, kind, _NATS_PER_DB if item.unit == "dB" else 1.0)
        for place, item, kind in found
        if kind is not None
    )


def _kind(item: Observable) -> Kind | None:
    if item.unit == "dB":
        return "amplitude"
    if item.unit != "1":
        return None
    kinds: tuple[tuple[str, Kind], ...] = (
        ("ln_velocity", "amplitude"),
        ("ln_peak", "amplitude"),
        ("ln_impulse", "impulse"),
        ("ln_width", "time"),
        ("ln_contact_time", "time"),
    )
    return next((kind for beginning, kind in kinds if item.name.startswith(beginning)), None)


def by_configuration(record: CampaignRecord, values: Floats) -> Floats:
    """(C, d): medians of (R, d) over the runs of each configuration; NaN where there is none."""
    of = record.configuration_of
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a column of NaN has no median, which is the answer
        rows = [np.nanmedian(values[of == c], axis=0) for c in range(len(record.configurations))]
    return np.array(rows, dtype=np.float64).reshape(len(record.configurations), values.shape[1])


@dataclass(frozen=True)
class Gap:
    """What is left of a gap, in nats: its centre over configurations, its scatter about that, its root mean square."""

    centre: float
    scatter: float
    rms: float

    @classmethod
    def of(cls, nats: Floats, decisive: Floats) -> Gap | None:
        """Of all logarithms (C, k); centre and scatter of the `decisive` ones (C, j). None where nothing is finite."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            each = np.nanmean(decisive, axis=1)
        each = each[np.isfinite(each)]
        if each.size == 0:
            return None
        centre = float(np.median(each))
        scatter = _MAD_TO_SIGMA * float(np.median(np.abs(each - centre)))
        return cls(centre, scatter, float(np.sqrt(np.nanmean(nats**2))))
