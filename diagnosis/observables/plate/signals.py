"""A campaign's accelerations as one block, each run on its own clock, cut to one length."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ....twin.plate.modal import ModalPlate
from ...record import CampaignRecord, Floats, Run, Series
from .delay import centres_s, durations_s
from .force import contact, end_of

#: Kept before contact begins; its mean is what a channel shows at rest.
_BEFORE_S, _REST_SAMPLES = 1e-3, 16
#: Longer records are cut: by then a plate is silent, and every diagnosis would wait for it.
_MOST_SAMPLES = 16384
#: A run that is shorter than this share of the usual one is left out.
_SHORT = 0.5
#: Samples between the end of the longest contact and the ringing that modes are read from.
_CLEAR = 4


@dataclass(frozen=True, eq=False)
class PlateSignals:
    """Of R runs and S channels.

    `acceleration` (R, S, n), NaN for what was not measured; sample k of run r is at `first_s[r]` + k `step_s`, contact
    begins at 0 s. `force`: each run's contact as read, None where there is none. `ringing`: the sample from which every
    plate rings freely.
    """

    acceleration: Floats
    force: tuple[Series | None, ...]
    channels: tuple[str, ...]
    first_s: Floats
    step_s: float
    ringing: int
    assumptions: tuple[str, ...]

    @property
    def rate_hz(self) -> float:
        return 1 / self.step_s

    @cached_property
    def centre_s(self) -> Floats:
        """(R,): about when each force acts."""
        return centres_s(self.force)

    @cached_property
    def contact_s(self) -> float:
        """The usual contact time."""
        return float(np.nanmedian(durations_s(self.force)))

    @property
    def good(self) -> NDArray[np.bool_]:
        """(R, S): what was measured."""
        return np.asarray(np.isfinite(self.acceleration[:, :, 0]))

    @classmethod
    def of(cls, record: CampaignRecord, plate: ModalPlate) -> PlateSignals:
        """Raises `ValueError` where no run has both a force and an acceleration at a sensor of the plate."""
        channels = tuple(name for name in plate.sensors if any(name in run.accelerations for run in record.runs))
        usable = [run for run in record.runs if _usable(run, channels)]
        if not usable:
            raise ValueError(
                f"campaign {record.name!r}: no run has a force and an acceleration at one of the plate's sensors "
                f"({', '.join(plate.sensors)}); name the channels as the modal table does"
            )
        rate = _usual([_rate(run, channels) for run in usable])
        usable = [run for run in usable if math.isclose(_rate(run, channels), rate, rel_tol=1e-6)]
        lengths = {id(run): min(_room(run.accelerations[name]) for name in channels if name in run.accelerations)
                   for run in usable}  # fmt: skip
        least = _SHORT * float(np.median(list(lengths.values())))
        kept = [run for run in usable if lengths[id(run)] >= least]
        samples = min(_MOST_SAMPLES, *(lengths[id(run)] for run in kept))
        chosen = {id(run) for run in kept}
        rows = [_row(run, channels, samples) if id(run) in chosen else None for run in record.runs]
        forces = tuple(contact(run.force) if run.force is not None else None for run in record.runs)
        over = max(end_of(f) for f, row in zip(forces, rows, strict=True) if row is not None and f is not None)
        first = np.array([np.nan if row is None else row[1] for row in rows])
        blank = np.full((len(channels), samples), np.nan)
        left_out = sum(run.force is not None and bool(run.accelerations) for run in record.runs) - len(kept)
        return cls(
            acceleration=np.array([blank if row is None else row[0] for row in rows]),
            force=tuple(None if row is None else f for f, row in zip(forces, rows, strict=True)),
            channels=channels,
            first_s=first,
            step_s=1 / rate,
            ringing=math.ceil((over - np.nanmin(first)) * rate) + _CLEAR,
            assumptions=_told(left_out, samples / rate),
        )


def _usable(run: Run, channels: tuple[str, ...]) -> bool:
    measured = [run.accelerations[name] for name in channels if name in run.accelerations]
    return run.force is not None and bool(np.any(run.force.values)) and bool(measured)


def _rate(run: Run, channels: tuple[str, ...]) -> float:
    return next(run.accelerations[name].sampling_rate_hz for name in channels if name in run.accelerations)


def _usual(rates: list[float]) -> float:
    values, counts = np.unique(rates, return_counts=True)
    return float(values[np.argmax(counts)])


def _begin(series: Series) -> int:
    """The first sample that is kept."""
    return max(0, math.ceil((-_BEFORE_S - series.start_s) * series.sampling_rate_hz - 1e-6))


def _room(series: Series) -> int:
    return int(series.values.size - _begin(series))


def _row(run: Run, channels: tuple[str, ...], samples: int) -> tuple[Floats, float]:
    out = np.full((len(channels), samples), np.nan)
    first = 0.0
    for row, name in enumerate(channels):
        if (series := run.accelerations.get(name)) is not None:
            begin = _begin(series)
            first = series.start_s + begin / series.sampling_rate_hz
            out[row] = series.values[begin : begin + samples] - _rest(series, begin)
    return out, first


def _rest(series: Series, begin: int) -> float:
    before = series.values[: max(0, math.floor(-series.start_s * series.sampling_rate_hz))]
    return float(before.mean()) if before.size - begin >= _REST_SAMPLES else 0.0


def _told(left_out: int, seconds: float) -> tuple[str, ...]:
    told = [f"accelerations are compared over {seconds * 1e3:.3g} ms"]
    if left_out:
        told.append(f"{left_out} runs whose accelerations are too short or of another rate have no part in the plate")
    return tuple(told)
