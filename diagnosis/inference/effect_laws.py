"""The laws by which effects of the catalogue may act, with priors of their parameters.

Every searched parameter is a number u with a standard normal prior. Parameters that span orders of
magnitude are searched by their logarithm, from where the effect is as large as a tolerance to the
end of its likely range: an effect within tolerance is none. A gain or an offset of a sensor has the
prior of data sheets and calibrations, and beside it, as a law of its own with a small prior, that
of a gross error.

A parameter that the laboratory has measured (`[known]` of campaign.toml) has the prior N(value, u)
of that measurement instead, and no gross error beside it. Where that excludes the value at which
the effect does nothing, the effect acts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...array_types import Floats
from ...schema.known_facts import KnownFact
from ...twin.effects import Effect, Parameter

#: By name of an owner: the level of each configuration (or mode, or sensor), and the names of the
#: levels.
Owners = Mapping[str, tuple[tuple[int, ...], tuple[str, ...]]]

#: The ends of a likely range lie so many standard deviations from the middle of the prior.
LIKELY_SD = 2.0
#: Share of a parameter's prior variance that all levels of its owner have in common (the rest is
#: each level's own).
COMMON_SHARE = 0.8
#: Prior probability of a gross error of a sensor, where it has an error at all.
GROSS_ERROR = 0.2
#: Beyond so many of its standard uncertainties from where an effect does nothing, a measured value
#: says that it acts.
ACTS_BEYOND_U = 4.0
#: In the name of a law with a parameter that the laboratory has measured.
KNOWN = " (known)"
#: Prior probability of the first law of an effect that has several.
USUAL_LAW = 0.7
#: Prior probability that a parameter differs from level to level of its owner, and of what lies on
#: the same side of the contact: a mass that is said to belong to the bullet may differ from tip to
#: tip.
BY_LEVEL, BY_NEIGHBOUR = 0.3, 0.1
_SIDES = (("bullet", "tip"), ("face", "layer", "plate"))
#: A parameter without a size of its own begins at this share of its likely end.
_SMALL = 0.01
#: A range of at least this ratio is searched by logarithms.
_WIDE = 1.5


@dataclass(frozen=True)
class Coordinate:
    """A parameter's value from u: `centre` + `scale` u, or its exponential; kept inside of the
    allowed range."""

    parameter: Parameter
    centre: float
    scale: float
    logarithmic: bool

    @property
    def one_sided(self) -> bool:
        """Whether it grows from nothing, rather than being off to either side."""
        assert self.parameter.likely is not None
        low, high = self.parameter.likely
        return self.logarithmic and not low < self.parameter.off < high

    def value(self, u: Floats) -> Floats:
        """Values of the parameter, in its unit, inside of the allowed range.

        Parameters:
            u: Numbers with a standard normal prior, of any shape.
        """
        raw = self.centre + self.scale * u
        return np.clip(
            np.exp(raw) if self.logarithmic else raw, self.parameter.low, self.parameter.high
        )

    def place(self, value: float) -> float:
        """The u of a value.

        Parameters:
            value: A value of the parameter, in its unit.
        """
        return float(((np.log(value) if self.logarithmic else value) - self.centre) / self.scale)


@dataclass(frozen=True)
class EffectLaw:
    """One law of an effect: the parameters that it is searched by, all others at what switches them
    off.

    `levels` gives the level of the parameters' `owner` in each configuration (C,), or in each mode
    (m,) or sensor (S,) of the plate where it belongs to these; empty where one value serves all.
    Each coordinate then has 1 + L numbers u: what all levels have in common, and what each has of
    its own.
    """

    kind: type[Effect]
    name: str
    coordinates: tuple[Coordinate, ...]
    fixed: tuple[tuple[str, float], ...]
    log_prior: float = 0.0
    levels: tuple[int, ...] = ()
    level_names: tuple[str, ...] = ()
    owner: str = ""
    #: The laboratory has measured a parameter, such that the effect acts.
    surely_acts: bool = False

    @property
    def id(self) -> str:
        return self.kind.id

    @cached_property
    def key(self) -> str:
        """What tells it from all other laws of a campaign."""
        return f"{self.id}/{self.name}"

    @cached_property
    def size(self) -> int:
        """How many numbers u it has."""
        return len(self.coordinates) * (1 + len(self.level_names))

    def values(self, u: Floats) -> dict[str, float | Floats]:
        """Parameters by name: a number, or one for each of `levels`.

        Parameters:
            u: The numbers (size,) of the law.
        """
        if not self.levels:
            return {
                coordinate.parameter.name: float(coordinate.value(at))
                for coordinate, at in zip(self.coordinates, u, strict=True)
            }
        table: dict[str, float | Floats] = {}
        for coordinate, at in zip(
            self.coordinates, (self.placing @ u).reshape(len(self.coordinates), -1), strict=True
        ):
            table[coordinate.parameter.name] = coordinate.value(at)[list(self.levels)]
        return table

    @cached_property
    def placing(self) -> Floats:
        """(k, size): from the numbers u to the place of each coordinate in each level, coordinate
        by coordinate."""
        levels = len(self.level_names)
        if not levels:
            return np.eye(self.size)
        single = np.hstack(
            [
                np.full((levels, 1), np.sqrt(COMMON_SHARE)),
                np.sqrt(1 - COMMON_SHARE) * np.eye(levels),
            ]
        )
        return np.kron(np.eye(len(self.coordinates)), single)

    def effect(self, u: Floats) -> Effect:
        """The effect of the twin at u.

        Parameters:
            u: The numbers (size,) of the law.
        """
        return self.kind(**dict(self.fixed), **self.values(u))

    @property
    def common(self) -> EffectLaw:
        """The same law with one value for all levels."""
        return replace(self, levels=(), level_names=(), owner="")

    def common_part(self, u: Floats) -> Floats:
        """The numbers u of the law with one value for all levels, from those of this law.

        Parameters:
            u: The numbers (size,) of the law.
        """
        rows = u.reshape(len(self.coordinates), -1)
        return np.asarray(rows[:, 0] * (np.sqrt(COMMON_SHARE) if self.levels else 1.0))

    def off(self) -> Effect:
        """The same effect, doing nothing."""
        return self.kind(**{item.name: item.off for item in self.kind.parameters()})

    def starts(self) -> list[Floats]:
        """Where a search begins: small and large, both signs of what is signed."""
        first = [-1.2, 0.0, 1.2] if self.coordinates[0].logarithmic else [-0.8, 0.8]
        places = []
        for value in first:
            u = np.zeros((len(self.coordinates), 1 + len(self.level_names)))
            u[0, 0] = value
            places.append(u.ravel())
        return places

    def level_start(self, places: Floats) -> Floats:
        """The likeliest u with which the first coordinate lies at given places in the levels.

        Parameters:
            places: The place (L,) of the coordinate in each of the L levels.
        """
        common, own = np.sqrt(COMMON_SHARE), np.sqrt(1 - COMMON_SHARE)
        u = np.zeros((len(self.coordinates), 1 + len(self.level_names)))
        u[0, 0] = common * places.sum() / (own**2 + len(places) * common**2)
        u[0, 1:] = (places - common * u[0, 0]) / own
        return u.ravel()

    def smallest_start(self) -> Floats:
        """Where it does little: at the lower end of what grows from nothing, in the middle of what
        has a sign."""
        u = np.zeros((len(self.coordinates), 1 + len(self.level_names)))
        u[0, 0] = -1.5 if self.coordinates[0].one_sided else 0.0
        return u.ravel()


@dataclass(frozen=True)
class LawRanges:
    """By effect id and parameter: the value that moves an observable by a tolerance, where laws of
    a campaign begin to be seen (`smallest`), and what the laboratory measured (`known_facts`)."""

    smallest: Mapping[tuple[str, str], float] = field(default_factory=dict)
    known_facts: Mapping[tuple[str, str], KnownFact] = field(default_factory=dict)


def laws_of(kind: type[Effect], ranges: LawRanges, owners: Owners) -> list[EffectLaw]:
    """All laws of one effect.

    Parameters:
        kind: The class of the effect.
        ranges: Where its parameters begin to be seen, and what the laboratory measured of them.
        owners: What its parameters may belong to, with levels: the laws that have a value for each
            level are added.

    Raises:
        ValueError: For an effect none of whose parameters has a likely range.
    """
    likely = [item for item in kind.parameters() if item.likely is not None]
    if not likely:
        raise ValueError(
            f"{kind.id}: no parameter has a likely range, so that there is nothing to look for"
        )
    acting = {
        item.name
        for item in likely
        if _excludes_off(kind, item, ranges) and not _is_shape(kind, item)
    }
    every_regime = _regimes(kind, likely, ranges)
    # a law that leaves out what was measured is not the bench's, unless each of them does
    regimes = [regime for regime in every_regime if acting <= set(regime)] or every_regime
    laws: list[EffectLaw] = []
    for regime in regimes:
        searched = [item for item in likely if item.name in regime]
        fixed = tuple(
            (item.name, _off_value(kind, item, ranges))
            for item in likely
            if item.name not in regime
        )
        prior = float(np.log(_regime_prior(regimes.index(regime), len(regimes))))
        for label, share, coordinates in _variants(kind, searched, ranges):
            name = "+".join(regime) + label
            log_prior = prior + float(np.log(share))
            laws.append(
                EffectLaw(kind, name, coordinates, fixed, log_prior, surely_acts=bool(acting))
            )
    return laws + [split for law in laws for split in _by_level(law, owners)]


def _regimes(
    kind: type[Effect], likely: Sequence[Parameter], ranges: LawRanges
) -> tuple[tuple[str, ...], ...]:
    """Of a sensor whose error was calibrated those without a shape of it that was not: a
    calibration covers a range."""
    every_regime = kind.regimes or (tuple(item.name for item in likely),)
    measured = {item.name for item in likely if (kind.id, item.name) in ranges.known_facts}
    if not any(item.name in measured for item in likely if item.typical is not None):
        return every_regime
    open_shapes = {item.name for item in likely if _is_shape(kind, item)} - measured
    return tuple(regime for regime in every_regime if not open_shapes & set(regime)) or every_regime


def _regime_prior(place: int, count: int) -> float:
    """The first law of an effect is the usual one; the others are for special circumstances."""
    return 1.0 if count == 1 else USUAL_LAW if place == 0 else (1 - USUAL_LAW) / (count - 1)


def _variants(
    kind: type[Effect], searched: Sequence[Parameter], ranges: LawRanges
) -> list[tuple[str, float, tuple[Coordinate, ...]]]:
    gross = tuple(_coordinate(kind, item, ranges) for item in searched)
    unmeasured = [item for item in searched if (kind.id, item.name) not in ranges.known_facts]
    label = "" if len(unmeasured) == len(searched) else KNOWN
    if all(item.typical is None for item in unmeasured):
        return [(label, 1.0, gross)]
    sheet = tuple(
        Coordinate(item, item.off, item.typical, False)
        if item in unmeasured and item.typical is not None
        else own
        for item, own in zip(searched, gross, strict=True)
    )
    return [(label, 1 - GROSS_ERROR, sheet), (f"{label} (gross)", GROSS_ERROR, gross)]


def _coordinate(kind: type[Effect], item: Parameter, ranges: LawRanges) -> Coordinate:
    assert item.likely is not None
    fact = ranges.known_facts.get((kind.id, item.name))
    if fact is not None:
        return Coordinate(item, fact.value, fact.u, False)
    low, high = item.likely
    shape = _is_shape(kind, item)
    if low < item.off < high and (low < 0 or not shape):
        if low > 0 and high / low > 3:
            return Coordinate(
                item, float(np.log(item.off)), float(np.log(high / item.off)) / LIKELY_SD, True
            )
        return Coordinate(item, item.off, max(high - item.off, item.off - low) / LIKELY_SD, False)
    if low > 0 and high / low <= _WIDE:
        return Coordinate(item, (low + high) / 2, (high - low) / 2 / LIKELY_SD, False)
    smallest = ranges.smallest.get((kind.id, item.name))
    if item.off > high:
        high = max(smallest or 10 * high, 2 * low)
    elif low == 0 or not shape:
        low = min(smallest or max(low, _SMALL * high), high / 3)
    return Coordinate(
        item, float(np.log(low * high)) / 2, float(np.log(high / low)) / 2 / LIKELY_SD, True
    )


def _is_shape(kind: type[Effect], item: Parameter) -> bool:
    """Whether a parameter says how an effect acts, and not whether: it has no size at which it does
    nothing, or is only looked for beside parameters that a law of the same kind has without it."""
    assert item.likely is not None
    has_no_nothing = item.default == item.off and 0 < item.likely[0] <= item.off <= item.likely[1]
    return has_no_nothing or _is_only_beside_others(kind, item.name)


def _is_only_beside_others(kind: type[Effect], name: str) -> bool:
    regimes = [set(regime) for regime in kind.regimes]
    with_it, without_it = (
        [r for r in regimes if (name in r) == has_it] for has_it in (True, False)
    )
    return bool(with_it) and all(any(less < regime for less in without_it) for regime in with_it)


def _excludes_off(kind: type[Effect], item: Parameter, ranges: LawRanges) -> bool:
    fact = ranges.known_facts.get((kind.id, item.name))
    return fact is not None and abs(fact.value - item.off) > ACTS_BEYOND_U * fact.u


def _off_value(kind: type[Effect], item: Parameter, ranges: LawRanges) -> float:
    """Of a parameter that a law is not searched by: off, or as the laboratory measured it."""
    return (
        ranges.known_facts[kind.id, item.name].value
        if _excludes_off(kind, item, ranges)
        else item.off
    )


def _by_level(law: EffectLaw, owners: Owners) -> list[EffectLaw]:
    """The same law with a value for each level of its first parameter's owner, and, in contacts, of
    its neighbours."""
    declared = law.coordinates[0].parameter.owner
    neighbours = next(
        (side for side in _SIDES if declared in side and law.kind.stage() == "contact"), ()
    )
    split = []
    for owner, (levels, names) in owners.items():
        if len(names) > 1 and (owner == declared or owner in neighbours):
            prior = law.log_prior + float(np.log(BY_LEVEL if owner == declared else BY_NEIGHBOUR))
            name = f"{law.name} by {owner}"
            split.append(
                replace(
                    law, name=name, log_prior=prior, levels=levels, level_names=names, owner=owner
                )
            )
    return split


def owners_of(configurations: Sequence[Mapping[str, Any]]) -> Owners:
    """Levels of what parameters may belong to.

    "bullet": the projectile, told by its mass; "tip" and "face": what touches; "layer": the
    insulator; "plate".

    Parameters:
        configurations: The factors of C configurations, by name.
    """
    columns = {
        "bullet": [row.get("bullet_mass", "") for row in configurations],
        "tip": [row.get("tip_material", "") for row in configurations],
        "face": [_face(row) for row in configurations],
        "layer": [row.get("insulator", "none") for row in configurations],
        "plate": [row.get("plate_material", "") for row in configurations],
    }
    owners: dict[str, tuple[tuple[int, ...], tuple[str, ...]]] = {}
    for owner, column in columns.items():
        names = sorted({str(value) for value in column})
        if owner == "layer":
            names = [name for name in names if name != "none"]
        if len(names) > 1 and (owner != "layer" or "none" not in {str(value) for value in column}):
            owners[owner] = tuple(names.index(str(value)) for value in column), tuple(names)
    return owners


def _face(row: Mapping[str, Any]) -> Any:
    anvil = row.get("anvil_material", "none")
    return row.get("plate_material", "") if anvil == "none" else anvil
