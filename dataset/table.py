"""Pulses as arrays: what snapshots give and models take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..array_types import Floats

Integers = NDArray[np.int64]
Texts = NDArray[np.str_]

_T = TypeVar("_T", bound="Inputs")

#: Equidistant points of a contact's force, both ends included (thesis, section 4.2.2).
POINTS = 20


@dataclass(frozen=True)
class Predictor:
    """One input of the models: `unit` in SI ("" for a number without one); `levels` name the values of a category.

    A category's value is the position of its level: 0 for the first, 1 for the next.
    """

    name: str
    unit: str = ""
    levels: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Inputs:
    """What a model is asked with: n impacts, `x` (n x d) in the order of `predictors`, SI.

    `impactor_mass_kg` and `plate_thickness_m` (n,) are the bench's: physical pulses need them even where they never
    varied and are no predictor. NaN where they are not known.
    """

    predictors: tuple[Predictor, ...]
    x: Floats
    impactor_mass_kg: Floats
    plate_thickness_m: Floats

    def __len__(self) -> int:
        return len(self.x)

    def column(self, name: str) -> Floats:
        """The values (n,) of a predictor. Raises `LookupError` that names those there are."""
        names = [predictor.name for predictor in self.predictors]
        if name not in names:
            raise LookupError(f"no predictor {name!r}; there are: {', '.join(names)}")
        return self.x[:, names.index(name)]

    def take(self, rows: NDArray[np.intp] | NDArray[np.bool_] | slice) -> Self:
        """The same of some rows."""
        return _take(self, rows)


@dataclass(frozen=True, eq=False)
class PulseTable(Inputs):
    """Measured pulses beside their inputs; every array has n rows.

    `force_n` (n x 20) is equidistant over the contact, ends included; the four figures after `contact_time_s` are those
    of the finely smoothed pulse (`peak_force_n` its peak). `configuration` tells factor combinations apart (repetitions
    share it), `treatment` only those that the predictors other than the impact velocity see. `target_material` is the
    first layer hit. `key` identifies the pulse by content, in any store; `pulse_id` is its row in this one.
    """

    force_n: Floats
    contact_time_s: Floats
    compression_time_s: Floats
    peak_force_n: Floats
    impulse_n_s: Floats
    compression_impulse_n_s: Floats
    configuration: Texts
    treatment: Texts
    tip_material: Texts
    target_material: Texts
    campaign: Texts
    run: Integers
    repetition: Integers
    key: Texts
    pulse_id: Integers

    @property
    def inputs(self) -> Inputs:
        """The inputs alone: what a model may see when it predicts."""
        return Inputs(self.predictors, self.x, self.impactor_mass_kg, self.plate_thickness_m)


def _take(table: _T, rows: NDArray[np.intp] | NDArray[np.bool_] | slice) -> _T:
    arrays = {f.name: getattr(table, f.name)[rows] for f in fields(table) if f.name != "predictors"}
    return replace(table, **arrays)


def concatenate(tables: Sequence[PulseTable]) -> PulseTable:
    """One table after the other. Raises `ValueError` where their predictors differ."""
    first = tables[0]
    if any(table.predictors != first.predictors for table in tables):
        raise ValueError("tables of different predictors cannot be joined")
    names = [f.name for f in fields(first) if f.name != "predictors"]
    arrays: dict[str, Any] = {name: np.concatenate([getattr(table, name) for table in tables]) for name in names}
    return replace(first, **arrays)
