"""Pulses as arrays: what snapshots give and models take.

Which pulses a model learns from and which it is judged on.

The draw depends on the content of the pulses and the seed, never on the order of rows: who is drawn
is who has the smallest hash of seed and name. So a configuration keeps its held-out repetitions
when another campaign joins it, and an impact keeps its side when its pulse is extracted anew.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ..array_types import Floats, Mask
from .near_duplicates import duplicate_groups

Integers = NDArray[np.int64]
Texts = NDArray[np.str_]

#: Equidistant points of a contact's force, both ends included (thesis, section 4.2.2).
POINTS = 20


@dataclass(frozen=True)
class Predictor:
    """One input of the models: `unit` in SI ("" for a number without one); `levels` name the values
    of a category.

    A category's value is the position of its level: 0 for the first, 1 for the next.
    """

    name: str
    unit: str = ""
    levels: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Inputs:
    """What a model is asked with: n impacts, `x` (n x d) in the order of `predictors`, SI.

    `impactor_mass_kg` and `plate_thickness_m` (n,) are the bench's: physical pulses need them even
    where they never varied and are no predictor. NaN where they are not known.
    """

    predictors: tuple[Predictor, ...]
    x: Floats
    impactor_mass_kg: Floats
    plate_thickness_m: Floats

    def __len__(self) -> int:
        return len(self.x)

    def column(self, name: str) -> Floats:
        """The values (n,) of a predictor, SI.

        Parameters:
            name: The name of the predictor.

        Raises:
            LookupError: For an unknown predictor, with those there are.
        """
        names = [predictor.name for predictor in self.predictors]
        if name not in names:
            raise LookupError(f"no predictor {name!r}; there are: {', '.join(names)}")
        return self.x[:, names.index(name)]

    def take(self, rows: NDArray[np.intp] | NDArray[np.bool_] | slice) -> Self:
        """The same of some rows.

        Parameters:
            rows: Which rows are taken: numbers, a mask (n,) or a slice.
        """
        arrays = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "predictors"}
        return replace(
            self, **{name: values[rows] for name, values in arrays.items() if values is not None}
        )


@dataclass(frozen=True, eq=False)
class PulseTable(Inputs):
    """Measured pulses beside their inputs; every array has n rows.

    `force_n` (n x 20) is equidistant over the contact, ends included; the four figures after
    `contact_time_s` are those of the finely smoothed pulse (`peak_force_n` its peak).
    `configuration` tells factor combinations apart (repetitions share it), `treatment` only those
    that the predictors other than the impact velocity see. `target_material` is the first layer
    hit. `key` identifies the pulse by content, in any store; `pulse_id` is its row in this one.
    `sample_s` is the sampling period of the force record, NaN where it is not known; None: it is
    known of no pulse.
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
    sample_s: Floats | None = None

    @property
    def inputs(self) -> Inputs:
        """The inputs alone: what a model may see when it predicts."""
        return Inputs(self.predictors, self.x, self.impactor_mass_kg, self.plate_thickness_m)


def concatenate(tables: Sequence[PulseTable]) -> PulseTable:
    """One table after the other.

    Parameters:
        tables: Pulses with the same predictors; at least one table.

    Raises:
        ValueError: Where their predictors differ.
    """
    first = tables[0]
    if any(table.predictors != first.predictors for table in tables):
        raise ValueError("tables of different predictors cannot be joined")
    names = [f.name for f in fields(first) if f.name != "predictors"]
    columns = {name: [getattr(table, name) for table in tables] for name in names}
    arrays: dict[str, Any] = {
        name: None if any(part is None for part in parts) else np.concatenate(parts)
        for name, parts in columns.items()
    }
    return replace(first, **arrays)


#: Share that is held out: 2 of the thesis's 10 repetitions, a fifth of the configurations.
HELD_OUT = 0.2


@dataclass(frozen=True, eq=False)
class Split:
    """Row numbers of both sides; `what` says in words what is held out."""

    text: str
    train: NDArray[np.int64]
    test: NDArray[np.int64]
    what: str


def split_of(table: PulseTable, text: str, seed: int = 0) -> Split:
    """The two sides of a split. Copies of a pulse (`near_duplicates`) are on one side.

    Parameters:
        table: The pulses of a dataset.
        text: Which pulses are held out, one of `forms()`, such as "configurations" or
            "material=steel".
        seed: The seed of the draw; by default 0. Where a material or campaign is named, nothing is
            drawn.

    Raises:
        ValueError: For another text, and where a side would be empty.
        LookupError: For a material or campaign that the table has not.
    """
    check_form(text)
    name, _, value = text.partition("=")
    test, what = _NAMED[name][0](table, value) if value else _DRAWN[name](table, seed)
    test = test[first_copies(table)]
    if not test.any() or test.all():
        side = "held out" if test.all() else "left to learn from"
        none = f"every pulse would be {side}" if test.any() else "no pulse would be held out"
        raise ValueError(f"split {text!r} of {len(table)} pulses: {none}; take another split")
    return Split(text, np.flatnonzero(~test), np.flatnonzero(test), what)


def first_copies(table: PulseTable) -> NDArray[np.intp]:
    """The row (n,) of the pulse that each pulse is a copy of, which may be its own
    (`near_duplicates`).

    Parameters:
        table: The n pulses.
    """
    return duplicate_groups(
        table.key, table.force_n, table.peak_force_n, table.contact_time_s, table.impulse_n_s
    )


def check_form(text: str) -> None:
    """Refuse a text that names no split, of whatever table.

    Parameters:
        text: The text of a split, such as "configurations".

    Raises:
        ValueError: For a text that is none of `forms()`.
    """
    name, equals, value = text.partition("=")
    if not (name in _NAMED and value if equals else text in _DRAWN):
        raise ValueError(f"split is {text!r}; expected one of {', '.join(forms())}")


def forms() -> tuple[str, ...]:
    """The texts that name a split."""
    return (*_DRAWN, *(f"{name}={placeholder}" for name, (_, placeholder) in _NAMED.items()))


def expand(table: PulseTable, text: str) -> tuple[str, ...]:
    """The splits of a text: those that leave out one material or campaign after the other, or the
    text as it is.

    What every pulse has (the only campaign, a plate's material throughout) cannot be left out and
    is not listed.

    Parameters:
        table: The pulses of a dataset.
        text: "materials", "campaigns", or the text of one split.
    """
    if text == "materials":
        materials = sorted({*table.tip_material.tolist(), *table.target_material.tolist()} - {""})
        return tuple(
            f"material={material}"
            for material in materials
            if not _of_material(table, material)[0].all()
        )
    if text == "campaigns":
        campaigns = sorted(set(table.campaign.tolist()))
        return tuple(f"campaign={campaign}" for campaign in campaigns) if len(campaigns) > 1 else ()
    return (text,)


def _repetitions(table: PulseTable, seed: int) -> tuple[Mask, str]:
    """Thesis, section 4.3: two of ten of each configuration."""
    places = zip(
        table.campaign.tolist(), table.run.tolist(), table.repetition.tolist(), strict=True
    )
    names = [f"{campaign}/{run}/{repetition}" for campaign, run, repetition in places]
    rank = np.array([_lot(seed, "repetitions", name) for name in names])
    test = np.zeros(len(table), dtype=bool)
    for rows in _groups(table.configuration):
        order = rows[np.lexsort((table.key[rows], rank[rows]))]
        test[order[: _share_of(len(rows))]] = True
    return test, "a fifth of the repetitions of each configuration"


def _groups(values: NDArray[np.str_]) -> list[NDArray[np.intp]]:
    """Row numbers of each value."""
    _, inverse, counts = np.unique(values, return_inverse=True, return_counts=True)
    return np.split(np.argsort(inverse, kind="stable"), np.cumsum(counts)[:-1])


def _configurations(table: PulseTable, seed: int) -> tuple[Mask, str]:
    return _fifth_of_values(
        table.configuration, seed, "configurations"
    ), "a fifth of the configurations"


def _treatments(table: PulseTable, seed: int) -> tuple[Mask, str]:
    what = "a fifth of the combinations that the predictors other than the velocity tell apart"
    return _fifth_of_values(table.treatment, seed, "treatments"), what


def _fifth_of_values(values: NDArray[np.str_], seed: int, what: str) -> Mask:
    """All rows of a fifth of the values."""
    distinct = sorted(set(values.tolist()), key=lambda value: (_lot(seed, what, value), value))
    return np.isin(values, distinct[: _share_of(len(distinct))])


def _share_of(n: int) -> int:
    """How many of n are held out: at least one, where there are two."""
    return max(1, round(HELD_OUT * n)) if n >= 2 else 0


def _lot(seed: int, what: str, name: str) -> str:
    return hashlib.sha256(f"{seed}/{what}/{name}".encode()).hexdigest()


def _of_material(table: PulseTable, material: str) -> tuple[Mask, str]:
    test = (table.tip_material == material) | (table.target_material == material)
    _refuse_unknown(
        "material", material, test, (*table.tip_material.tolist(), *table.target_material.tolist())
    )
    return test, f"every pulse of a tip or a first layer of {material}"


def _of_campaign(table: PulseTable, campaign: str) -> tuple[Mask, str]:
    test = table.campaign == campaign
    _refuse_unknown("campaign", campaign, test, table.campaign.tolist())
    return test, f"campaign {campaign}"


def _refuse_unknown(what: str, name: str, test: Mask, there: Iterable[str]) -> None:
    if not test.any():
        levels_there = ", ".join(sorted(set(there) - {""}))
        raise LookupError(f"no {what} {name!r} in the dataset; there: {levels_there}")


_DRAWN: dict[str, Callable[[PulseTable, int], tuple[Mask, str]]] = {
    "repetitions": _repetitions,
    "configurations": _configurations,
    "treatments": _treatments,
}
_NAMED: dict[str, tuple[Callable[[PulseTable, str], tuple[Mask, str]], str]] = {
    "material": (_of_material, "NAME"),
    "campaign": (_of_campaign, "NAME"),
}
