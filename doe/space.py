"""All treatments that the bench can run: factors, and axes along which a design moves freely.

An axis is one factor, or several that depend on each other together with their feasible
combinations. Axes are independent: every row of axis-level indices is a feasible treatment, so no
design ever meets a dependency.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast, get_args

from ..files.toml_text import read_toml_text
from .factors import DesignFactor, Rule, connected
from .toml_space import parse

if TYPE_CHECKING:  # stored plans are read without arrays
    import numpy as np
    from numpy.typing import NDArray

Kind = Literal["hammer", "gun"]

#: Parts into which figures of balance cut the range of a continuous factor.
STRATA = 5
#: All treatments are listed only up to here.
_MOST_TREATMENTS = 1_000_000
_DATA = Path(__file__).resolve().parent / "data"


@dataclass(frozen=True)
class Axis:
    """Feasible combinations of factors that depend on each other; of a single factor, its
    levels."""

    name: str  #: the factors' names with "+" between them
    factors: tuple[DesignFactor, ...]
    combinations: tuple[tuple[int, ...], ...]  #: level index per factor

    def __post_init__(self) -> None:
        if not self.combinations or len(set(self.combinations)) < len(self.combinations):
            raise ValueError(
                f"axis {self.name!r}: combinations are {self.combinations}; expected different ones"
            )
        sizes = [len(factor.levels) for factor in self.factors]
        for levels in self.combinations:
            if len(levels) != len(sizes) or any(
                not 0 <= n < size for n, size in zip(levels, sizes, strict=True)
            ):
                raise ValueError(
                    f"axis {self.name!r}: combination {levels}; expected indices below {sizes}"
                )

    @property
    def size(self) -> int:
        return len(self.combinations)

    @property
    def ordered(self) -> bool:
        """Whether the combinations run from low to high: those of one ordered factor."""
        return len(self.factors) == 1 and self.factors[0].has_order

    @property
    def continuous(self) -> bool:
        """Whether it is one continuous factor; rules do not connect continuous factors with
        others."""
        return len(self.factors) == 1 and self.factors[0].continuous

    @property
    def strata(self) -> int:
        """Cells by which its balance is judged: combinations, or parts of a continuous factor's
        range."""
        return min(STRATA, self.size) if self.continuous else self.size

    @property
    def change(self) -> int:
        """Work to change it: that of its hardest factor."""
        return max(factor.change for factor in self.factors)

    @property
    def labels(self) -> tuple[str, ...]:
        """A text per combination: "steel/polymeric"."""
        return tuple(
            "/".join(
                factor.levels[level] for factor, level in zip(self.factors, levels, strict=True)
            )
            for levels in self.combinations
        )


@dataclass(frozen=True)
class Space:
    """What a campaign varies. Raises `ValueError` where names repeat or the axes do not hold each
    factor once."""

    name: str
    kind: Kind
    factors: tuple[DesignFactor, ...]  #: in the order of the table's columns
    axes: tuple[Axis, ...]
    rules: tuple[
        Rule, ...
    ] = ()  #: that the axes' combinations follow; they explain why a row is refused
    bench: Mapping[str, Any] = field(
        default_factory=dict, hash=False
    )  #: the file's [bench] table, as written

    def __post_init__(self) -> None:
        if self.kind not in get_args(Kind):
            raise ValueError(
                f"space {self.name!r}: kind is {self.kind!r}; expected one of "
                f"{', '.join(get_args(Kind))}"
            )
        for key, names in (
            ("name", [f.name for f in self.factors]),
            ("column", [f.column for f in self.factors]),
        ):
            twice = sorted({name for name in names if names.count(name) > 1})
            if twice:
                raise ValueError(
                    f"space {self.name!r}: {key} "
                    f"{twice[0]!r} stands twice; expected one factor of it"
                )
        if not self.factors:
            raise ValueError(f"space {self.name!r}: factors is empty; expected at least one")
        held = sorted(factor.name for axis in self.axes for factor in axis.factors)
        if held != sorted(factor.name for factor in self.factors):
            raise ValueError(
                f"space {self.name!r}: axes hold {', '.join(held)}; expected every factor once"
            )

    @property
    def size(self) -> int:
        """Number of feasible treatments."""
        return math.prod(axis.size for axis in self.axes)

    @cached_property
    def stratified(self) -> Space:
        """The space with the range of each continuous factor cut into `STRATA` ordered levels."""
        if not any(axis.continuous for axis in self.axes):
            return self
        axes = tuple(_stratified(axis) if axis.continuous else axis for axis in self.axes)
        by_name = {factor.name: factor for axis in axes for factor in axis.factors}
        return replace(
            self, factors=tuple(by_name[factor.name] for factor in self.factors), axes=axes
        )

    def in_strata(self, treatments: NDArray[np.int64]) -> NDArray[np.int64]:
        """The treatments as treatments `(n, axes)` of `stratified`.

        Parameters:
            treatments: Treatments of the space, of shape `(n, axes)`.

        Raises:
            ValueError: As `checked` raises it.
        """
        import numpy as np

        rows = self.checked(treatments)
        sizes, strata = (
            np.array([getattr(axis, name) for axis in self.axes]) for name in ("size", "strata")
        )
        return np.asarray(rows * strata // sizes, dtype=np.int64)

    @property
    def columns(self) -> tuple[str, ...]:
        return tuple(factor.column for factor in self.factors)

    def velocity_m_s(self, row: Mapping[str, str]) -> float | None:
        """What the level of a row stands for, in m/s.

        Parameters:
            row: A run of a plan: column to level.

        Returns:
            The value that the level has in the first factor whose levels have values in m/s; None
            where there is none.
        """
        for factor in self.factors:
            if (
                factor.unit == "m/s"
                and factor.values is not None
                and row.get(factor.column) in factor.levels
            ):
                return factor.values[factor.levels.index(row[factor.column])]
        return None

    def all_treatments(self) -> NDArray[np.int64]:
        """Every feasible treatment, (size, axes), the last axis fastest. Raises `ValueError` beyond
        a million."""
        import numpy as np

        if self.size > _MOST_TREATMENTS:
            raise ValueError(
                f"space {self.name!r}: {self.size} treatments; expected at "
                f"most {_MOST_TREATMENTS} to list"
            )
        grid = np.indices([axis.size for axis in self.axes], dtype=np.int64)
        return grid.reshape(len(self.axes), -1).T.copy()

    def checked(self, treatments: NDArray[Any]) -> NDArray[np.int64]:
        """The rows `(n, axes)` as int64.

        Parameters:
            treatments: Indices along the axes, of shape `(n, axes)`: a treatment in each row.

        Raises:
            ValueError: For another shape, for numbers that are no integers, and for an index beyond
                its axis.
        """
        import numpy as np

        rows = np.asarray(treatments)
        if (
            rows.ndim != 2
            or rows.shape[1] != len(self.axes)
            or not (np.issubdtype(rows.dtype, np.integer))
        ):
            raise ValueError(
                f"treatments are {rows.shape} of {rows.dtype}; expected (n, "
                f"{len(self.axes)}) of integers"
            )
        beyond = np.argwhere((rows < 0) | (rows >= np.array([axis.size for axis in self.axes])))
        if beyond.size:
            row, column = map(int, beyond[0])
            axis = self.axes[column]
            raise ValueError(
                f"treatment {row}: {axis.name} is "
                f"{rows[row, column]}; expected 0 to {axis.size - 1}"
            )
        return rows.astype(np.int64)

    def rows(self, treatments: NDArray[np.int64]) -> list[dict[str, str]]:
        """Column to level for each treatment, in the order of the columns.

        Parameters:
            treatments: Treatments of the space, of shape `(n, axes)`.

        Raises:
            ValueError: As `checked` raises it.
        """
        result = []
        for treatment in self.checked(treatments).tolist():
            cells = {
                factor.column: factor.levels[level]
                for axis, index in zip(self.axes, treatment, strict=True)
                for factor, level in zip(axis.factors, axis.combinations[index], strict=True)
            }
            result.append({column: cells[column] for column in self.columns})
        return result

    def treatments(self, rows: Sequence[Mapping[str, str]]) -> NDArray[np.int64]:
        """The treatments `(n, axes)` that rows of a table name: the inverse of `rows`.

        Parameters:
            rows: Column to level for each run. Columns that are no factor's are left alone.

        Raises:
            ValueError: For an unknown level, a missing column, and an infeasible row. The message
                names the run ("run" of the row, else its number from 1), and the column and the
                value, or the rule that the row breaks.
        """
        import numpy as np

        result = np.empty((len(rows), len(self.axes)), dtype=np.int64)
        for number, row in enumerate(rows):
            try:
                result[number] = self._treatment(row)
            except ValueError as error:
                raise ValueError(f"run {row.get('run', number + 1)}: {error}") from None
        return result

    def _treatment(self, row: Mapping[str, str]) -> list[int]:
        missing = [column for column in self.columns if column not in row]
        if missing:
            raise ValueError(
                f"column {missing[0]!r} is missing; expected {', '.join(self.columns)}"
            )
        level = {factor.name: factor.index(row[factor.column]) for factor in self.factors}
        texts = {factor.name: factor.levels[level[factor.name]] for factor in self.factors}
        for rule in self.rules:
            if not rule.allows(texts):
                values_text = ", ".join(f"{name} = {texts[name]}" for name in rule.factors)
                raise ValueError(f"{values_text} is not feasible: {rule}")
        return [
            _treatment_number(axis, places, tuple(level[factor.name] for factor in axis.factors))
            for axis, places in zip(self.axes, self._places, strict=True)
        ]

    @cached_property
    def _places(self) -> tuple[dict[tuple[int, ...], int], ...]:
        """Per axis, the index of each combination."""
        return tuple(
            {levels: index for index, levels in enumerate(axis.combinations)} for axis in self.axes
        )


def _stratified(axis: Axis) -> Axis:
    """A continuous axis with a level per part of its range; the text is that of the part's lowest
    and highest value."""
    (factor,) = axis.factors
    starts = [-(-stratum * axis.size // axis.strata) for stratum in range(axis.strata + 1)]
    labels = tuple(
        f"{factor.levels[a]} to {factor.levels[b - 1]}" for a, b in itertools.pairwise(starts)
    )
    parts = replace(factor, levels=labels, numbers=None, unit=None, ordered=True, continuous=False)
    return Axis(axis.name, (parts,), tuple((index,) for index in range(axis.strata)))


def _treatment_number(
    axis: Axis, places: Mapping[tuple[int, ...], int], levels: tuple[int, ...]
) -> int:
    if levels not in places:  # an axis made by hand may leave out more than the rules do
        labels = "/".join(
            factor.levels[level] for factor, level in zip(axis.factors, levels, strict=True)
        )
        raise ValueError(
            f"{axis.name} = {labels} is not feasible; expected one of {', '.join(axis.labels)}"
        )
    return places[levels]


def space_of(
    name: str,
    kind: Kind,
    factors: Sequence[DesignFactor],
    rules: Sequence[Rule] = (),
    bench: Mapping[str, Any] | None = None,
) -> Space:
    """The space of factors under rules: connected factors become one axis, in the order of their
    first factor.

    Parameters:
        name: What the space is called, in messages for instance.
        kind: The bench of the campaign, "hammer" or "gun".
        factors: What the campaign varies, in the order of the table's columns.
        rules: The rules by which some levels need others; by default there are none.
        bench: What the bench withstands, as `read_limits` takes it; by default an empty table, with
            which the limits of the thesis's bench hold.

    Raises:
        ValueError: As `Space` and `factors.connected` raise it.
    """
    axes = tuple(
        Axis("+".join(factor.name for factor in members), members, combinations)
        for members, combinations in connected(factors, rules)
    )
    return Space(name, kind, tuple(factors), axes, tuple(rules), dict(bench or {}))


def read_space(path: Path) -> Space:
    """The space that a TOML file describes.

    Parameters:
        path: The file, in the format that `toml_space` describes.

    Raises:
        ValueError: For other content; the message names file, key, value and what was expected.
        FileNotFoundError: Where there is no such file.
    """
    try:
        return space_from_text(read_toml_text(path))
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def space_from_text(text: str) -> Space:
    """The space that the text of a file of factors describes.

    Parameters:
        text: TOML, in the format that `toml_space` describes.

    Raises:
        ValueError: As `read_space` raises it, without the file.
    """
    content = parse(text)
    return space_of(
        content.name, cast(Kind, content.kind), content.factors, content.rules, content.bench
    )


def space_from_form(text: str, name: str = "factors") -> Space:
    """The space that a text typed into a form, or read of a file, describes.

    Parameters:
        text: TOML, in the format that `toml_space` describes.
        name: The field of the form, or the file, which messages name; "factors" by default.

    Raises:
        ValueError: As `read_space` raises it, with `name` in place of the file.
    """
    try:
        return space_from_text(text)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from error


def shipped_factors(kind: Kind) -> str:
    """The text of the thesis's factors, in TOML: what a lab's own file starts from.

    Parameters:
        kind: The bench of the campaign, "hammer" or "gun".
    """
    return read_toml_text(_DATA / f"{kind}.toml")


def gun_space() -> Space:
    """The gun's 810 feasible treatments (thesis, Table 3.2 and eq. 3.1)."""
    return space_from_text(shipped_factors("gun"))


def hammer_space() -> Space:
    """The hammer's 180 configurations (thesis, Table 4.1)."""
    return space_from_text(shipped_factors("hammer"))
