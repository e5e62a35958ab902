"""What a campaign varies: factors with their levels, and the rules by which some levels need
others.

Glossary: a level is one setting of a factor; a combination holds one level for each of several
factors; a treatment is a combination of all factors of a space. The levels of a continuous factor
are all values from its lowest to its highest in steps of what the bench can set.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ..files.delimited_text import parse_number

#: Names stand in table headers and in names of axes: no signs that a table or an axis gives a
#: meaning to.
_NAME = re.compile(r"[a-z][a-z0-9_]{0,62}", re.ASCII)
#: Columns of a plan's sheet or of runs.csv that say something else about a run.
_RESERVED = (
    *("run", "order", "position", "repetition", "repetitions", "done", "remarks", "recording"),
    *(
        "impact_velocity_m_s",
        "impact_velocity_u_m_s",
        "measured_velocity_m_s",
        "measured_velocity_u_m_s",
    ),
    *("bullet_length_mm", "bullet_length_u_mm", "laser_sampling_rate_hz"),
)
_LONGEST_LEVEL = 200
#: Combinations of connected factors are listed one by one, before any rule thins them out.
_MOST_COMBINATIONS = 100_000
#: No instrument of the bench is read more finely than this part of its range.
_MOST_VALUES = 2001


@dataclass(frozen=True)
class DesignFactor:
    """One thing that the bench can set. Raises `ValueError` naming the factor, the value and what
    was expected."""

    name: str  #: as in the store where recordings know the column too: "tip_radius"
    column: str  #: in a plan's table and in runs.csv: "tip_radius_mm"
    levels: tuple[str, ...]  #: as a table writes them, all different
    numbers: (
        tuple[float, ...] | None
    )  #: the levels as numbers in `unit`, rising; None where they are words
    ordered: bool  #: words with an order too: low < medium < high
    change: int  #: work to change it: 0 for easy, the higher the more
    unit: str | None = None  #: of `numbers`, or of `values`
    values: tuple[float, ...] | None = (
        None  #: what ordered words stand for (a velocity level's m/s), rising
    )
    continuous: bool = False  #: the levels are a range in equal steps

    def __post_init__(self) -> None:
        for key, value in (("name", self.name), ("column", self.column)):
            if not _NAME.fullmatch(value) or value in _RESERVED:
                raise ValueError(
                    f"factor {self.name!r}: {key} is {value!r}; expected "
                    f"lower-case letters, digits and _, at most 63, "
                    "and no name that a table of runs needs for something else"
                )
        if self.change < 0:
            raise ValueError(
                f"factor {self.name!r}: change is {self.change!r}; expected 0 (easy) or more"
            )
        _check_levels(self)
        if self.numbers is not None:
            _check_numbers(self, self.numbers)
        if self.values is not None:
            _check_numbers(self, self.values)
        ending = _ending(self.unit or "")
        if self.numbers is not None and not self.column.endswith(ending):
            expected = f"a name that ends in {ending!r} for unit {self.unit!r}"
            raise ValueError(
                f"factor {self.name!r}: column is {self.column!r}; expected {expected}"
            )

    @property
    def has_order(self) -> bool:
        return self.ordered or self.numbers is not None

    @property
    def step(self) -> float:
        """The distance of two values of a continuous factor, in `unit`."""
        low, high = self.limits
        return (high - low) / (len(self.levels) - 1)

    @property
    def limits(self) -> tuple[float, float]:
        """The lowest and the highest number, in `unit`. Raises `ValueError` for a factor of
        words."""
        if self.numbers is None:
            raise ValueError(f"factor {self.name!r} has words for levels; expected numbers")
        return self.numbers[0], self.numbers[-1]

    @property
    def level_text(self) -> str:
        """The levels as a message or a page names them: "steel, PLA", "0.8 to 6 bar in steps of
        0.05"."""
        if not self.continuous:
            return ", ".join(self.levels)
        return (
            f"{self.levels[0]} to {self.levels[-1]} {self.unit} in steps of "
            f"{number_label(self.step)}"
        )

    def index(self, text: str) -> int:
        """Index of the level that a cell names.

        Parameters:
            text: A cell of a table. A number may be written otherwise than the level is ("30.0",
                "30", "0,5").

        Raises:
            ValueError: For a cell that names no level; the message states the known levels.
        """
        cell = text.strip()
        if cell in self.levels:
            return self.levels.index(cell)
        labels = [number_label(number) for number in self.numbers or ()]
        label = _label_of(cell)
        if label is None or label not in labels:
            expected = self.level_text if self.continuous else f"one of {self.level_text}"
            raise ValueError(f"{self.column} is {text[:_LONGEST_LEVEL]!r}; expected {expected}")
        return labels.index(label)


def continuous_levels(low: float, high: float, step: float | None) -> tuple[str, ...]:
    """The values of a continuous factor as a table writes them: from `low` to `high`, both
    included.

    Parameters:
        low: The lowest value, in the unit of the factor.
        high: The highest value, in the same unit.
        step: The distance of two values, in the same unit. None: the largest of 1, 2 or 5 times a
            power of ten that divides the range into fifty parts or more.

    Raises:
        ValueError: For limits that are not finite or do not rise, a step that does not divide the
            range, and more than 2001 values.
    """
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise ValueError(
            f"low is {low:g} and high {high:g}; expected finite numbers, low below high"
        )
    span = high - low
    if step is None:
        decades = range(math.floor(math.log10(span)) - 1, math.floor(math.log10(span)) - 5, -1)
        steps = [digit * 10.0**decade for decade in decades for digit in (5, 2, 1)]
        fine_steps = [size for size in steps if span / size >= 49.5 and _divides(size, span)]
        if not fine_steps:
            raise ValueError(
                f"low is {low:g} and high {high:g}; expected a step that divides the range"
            )
        step = fine_steps[0]
    if not (math.isfinite(step) and step > 0 and _divides(step, span)):
        raise ValueError(f"step is {step:g}; expected a part of the range from {low:g} to {high:g}")
    count = round(span / step) + 1
    if count > _MOST_VALUES:
        raise ValueError(
            f"step is {step:g}, which gives {count} values; expected {_MOST_VALUES} at most"
        )
    return tuple(number_label(low + index * span / (count - 1)) for index in range(count))


def _divides(step: float, span: float) -> bool:
    parts = span / step
    return round(parts) >= 1 and abs(parts - round(parts)) < 1e-6


@dataclass(frozen=True)
class Requirement:
    """`level` of `factor` needs `needs` to be at one of `levels` (the insulator needs an anvil)."""

    factor: str
    level: str
    needs: str
    levels: tuple[str, ...]

    @property
    def factors(self) -> tuple[str, ...]:
        return self.factor, self.needs

    @property
    def mentions(self) -> tuple[tuple[str, str], ...]:
        """Every (factor, level) that the rule names."""
        return (self.factor, self.level), *((self.needs, level) for level in self.levels)

    def allows(self, levels: Mapping[str, str]) -> bool:
        """Whether a combination of levels keeps the rule.

        Parameters:
            levels: The level of each factor, by the factor's name; the factors of the rule must be
                there.
        """
        return levels[self.factor] != self.level or levels[self.needs] in self.levels

    def __str__(self) -> str:
        return f"{self.factor} = {self.level} needs {self.needs} = {' or '.join(self.levels)}"


@dataclass(frozen=True)
class Tie:
    """Factors that are set together: only these combinations exist (each hammer tip has its
    radius)."""

    factors: tuple[str, ...]
    combinations: tuple[tuple[str, ...], ...]

    @property
    def mentions(self) -> tuple[tuple[str, str], ...]:
        """Every (factor, level) that the rule names."""
        return tuple(
            pair for levels in self.combinations for pair in zip(self.factors, levels, strict=True)
        )

    def allows(self, levels: Mapping[str, str]) -> bool:
        """Whether a combination of levels keeps the rule.

        Parameters:
            levels: The level of each factor, by the factor's name; the factors of the rule must be
                there.
        """
        return tuple(levels[name] for name in self.factors) in self.combinations

    def __str__(self) -> str:
        allowed = ", ".join("/".join(levels) for levels in self.combinations)
        return f"{' and '.join(self.factors)} go together as {allowed}"


Rule = Requirement | Tie
Combinations = tuple[tuple[int, ...], ...]


def connected(
    factors: Sequence[DesignFactor], rules: Sequence[Rule]
) -> list[tuple[tuple[DesignFactor, ...], Combinations]]:
    """Factors that depend on each other, with the feasible combinations of each group.

    Parameters:
        factors: All factors of a space.
        rules: The rules by which factors depend on each other.

    Returns:
        The factors and the combinations of each group. Groups stand in the order of their first
        factor. A combination has a level index per factor; combinations stand in the order of their
        levels, the last factor fastest.

    Raises:
        ValueError: Where a rule names what is not there or a continuous factor, where nothing is
            feasible, where a level never is, and for a group of more than 100,000 combinations.
    """
    _check_rules(factors, rules)
    group = {factor.name: index for index, factor in enumerate(factors)}
    for rule in rules:
        joined = {group[name] for name in rule.factors}
        group = {name: min(joined) if index in joined else index for name, index in group.items()}
    result = []
    for index in sorted(set(group.values())):
        members = tuple(factor for factor in factors if group[factor.name] == index)
        own = [rule for rule in rules if group[rule.factors[0]] == index]
        result.append((members, _feasible(members, own)))
    return result


def _feasible(factors: tuple[DesignFactor, ...], rules: Sequence[Rule]) -> Combinations:
    names = "+".join(factor.name for factor in factors)
    if math.prod(len(factor.levels) for factor in factors) > _MOST_COMBINATIONS:
        raise ValueError(
            f"{names}: more than {_MOST_COMBINATIONS} combinations of "
            f"connected factors; expected fewer"
        )
    feasible = []
    for levels in itertools.product(*(range(len(factor.levels)) for factor in factors)):
        texts = {
            factor.name: factor.levels[level] for factor, level in zip(factors, levels, strict=True)
        }
        if all(rule.allows(texts) for rule in rules):
            feasible.append(levels)
    if not feasible:
        raise ValueError(f"{names}: no feasible combination: {'; '.join(map(str, rules))}")
    for place, factor in enumerate(factors):
        missing = set(range(len(factor.levels))) - {levels[place] for levels in feasible}
        if missing:
            label = factor.levels[min(missing)]
            raise ValueError(
                f"factor {factor.name!r}: level {label!r} is in no feasible combination"
            )
    return tuple(feasible)


def _check_rules(factors: Sequence[DesignFactor], rules: Sequence[Rule]) -> None:
    factors_by_name = {factor.name: factor for factor in factors}
    for rule in rules:
        if len(set(rule.factors)) != len(rule.factors) or len(rule.factors) < 2:
            raise ValueError(
                f"rule '{rule}': factors are {', '.join(rule.factors)}; "
                f"expected two or more different ones"
            )
        for name in rule.factors:
            if name not in factors_by_name:
                raise ValueError(
                    f"rule '{rule}': factor {name!r} is unknown; expected one "
                    f"of {', '.join(factors_by_name)}"
                )
            if factors_by_name[name].continuous:
                raise ValueError(
                    f"rule '{rule}': factor {name!r} is continuous; expected factors with levels"
                )
        for name, level in rule.mentions:
            if level not in factors_by_name[name].levels:
                expected = ", ".join(factors_by_name[name].levels)
                raise ValueError(
                    f"rule '{rule}': {name!r} has no level {level!r}; expected one of {expected}"
                )


def _check_levels(factor: DesignFactor) -> None:
    if not factor.levels:
        raise ValueError(f"factor {factor.name!r}: levels is empty; expected at least one")
    for level in factor.levels:
        if (
            not level
            or level != level.strip()
            or not level.isprintable()
            or len(level) > _LONGEST_LEVEL
        ):
            raise ValueError(
                f"factor {factor.name!r}: level {level[:_LONGEST_LEVEL]!r}; expected printable "
                f"text without blanks around it, at most {_LONGEST_LEVEL} characters"
            )
    if len(set(factor.levels)) < len(factor.levels):
        level = next(level for level in factor.levels if factor.levels.count(level) > 1)
        raise ValueError(
            f"factor {factor.name!r}: level {level!r} stands twice; expected different ones"
        )


def _check_numbers(factor: DesignFactor, numbers: tuple[float, ...]) -> None:
    if len(numbers) != len(factor.levels):
        raise ValueError(
            f"factor {factor.name!r}: {len(numbers)} numbers; expected "
            f"{len(factor.levels)}, one per level"
        )
    if factor.continuous and len(numbers) < 2:
        raise ValueError(f"factor {factor.name!r}: one value; expected a range")
    if not all(map(math.isfinite, numbers)) or any(
        low >= high for low, high in itertools.pairwise(numbers)
    ):
        raise ValueError(
            f"factor {factor.name!r}: levels are {numbers}; expected finite numbers in rising order"
        )


def number_label(number: float) -> str:
    """A number as a table writes it, with 12 digits at most and none to spare. Levels with the same
    label are the same.

    Parameters:
        number: The level, or another number of a factor, in the factor's unit.
    """
    return f"{number + 0.0:.12g}"  # the sum makes -0 a 0


def _label_of(cell: str) -> str | None:
    """The label of a number however it is written, None where it is none."""
    try:
        return number_label(parse_number(cell))
    except ValueError:
        return None


def _ending(unit: str) -> str:
    """What a column's name ends in: "_m_s" for "m/s", nothing where a unit has no letters ("%",
    "1")."""
    words = re.findall("[a-z]+[0-9]*", unit.lower())
    return "".join(f"_{word}" for word in words)
