"""What every way of designing a campaign gives.

Coded designs (-1 low, 0 centre, 1 high) on the axes of a space: which level stands for which code.

Factors with an order take codes by the rank of their levels, continuous ones by value. An axis of
one level is left as it is. Words without order have no low and high: a design says what it does
with them, and names the factor otherwise.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats, Ids
from ..space import Axis, Space


@dataclass(frozen=True)
class Design:
    """Treatments (n, axes) of a space, as indices along its axes, in order of run.

    `method` is stored with a plan ("lhs", "factorial", "import", ...); `seed` is None where nothing
    was drawn. Raises `ValueError` where a row is no treatment of the space.
    """

    space: Space
    treatments: NDArray[np.int64]
    method: str
    seed: int | None

    def __post_init__(self) -> None:
        object.__setattr__(self, "treatments", self.space.checked(self.treatments))

    @property
    def rows(self) -> list[dict[str, str]]:
        """Column to level for each run."""
        return self.space.rows(self.treatments)


TwoLevelWords = Literal["refuse", "first-last"]
SurfaceWords = Literal["refuse", "cross"]


def varied_axes(space: Space) -> list[int]:
    """Indices of the axes of more than one level.

    Parameters:
        space: What the campaign varies.

    Raises:
        ValueError: Where there is no such axis.
    """
    varied = [index for index, axis in enumerate(space.axes) if axis.size > 1]
    if not varied:
        raise ValueError(
            f"space {space.name!r}: no factor of two or more levels; expected one at least"
        )
    return varied


def from_two_levels(space: Space, coded: Floats, words: TwoLevelWords) -> Ids:
    """Treatments `(n, axes)` of a two-level design: lowest and highest level, or first and last
    word.

    Parameters:
        space: What the campaign varies.
        coded: The design, of shape `(n, varied axes)`: -1 for the low level and 1 for the high one.
        words: What is done with an axis of more than two levels without order: "refuse" it, or take
            the first and the last level ("first-last").

    Raises:
        ValueError: For an axis of more than two levels without order, which the message names,
            unless `words` is "first-last"; for other `words`; and where no axis has two levels.
    """
    _check("categorical", words, get_args(TwoLevelWords))
    varied = varied_axes(space)
    rows = np.zeros((len(coded), len(space.axes)), dtype=np.int64)
    for column, index in enumerate(varied):
        axis = space.axes[index]
        if not axis.ordered and axis.size > 2 and words == "refuse":
            raise ValueError(
                f"{axis.name} has {axis.size} levels without order ({', '.join(axis.labels)}), and "
                "the design takes two; expected fewer levels, or categorical=first-last"
            )
        rows[:, index] = np.where(coded[:, column] > 0, axis.size - 1, 0)
    return rows


def ordered_axes(space: Space, words: SurfaceWords) -> list[int]:
    """Indices of the axes that a response surface is fitted along.

    Parameters:
        space: What the campaign varies.
        words: What is done with an axis of levels without order: "refuse" it, or leave it out
            ("cross"), so that `from_surface` repeats the design at each of its levels.

    Raises:
        ValueError: For an axis of levels without order, which the message names, unless `words` is
            "cross"; for other `words`; and where no axis has two levels.
    """
    _check("categorical", words, get_args(SurfaceWords))
    varied = varied_axes(space)
    for index in varied:
        axis = space.axes[index]
        if not axis.ordered and words == "refuse":
            raise ValueError(
                f"{axis.name} has levels without order "
                f"({', '.join(axis.labels)}), along which no surface is fitted; "
                "expected numbers, or categorical=cross for the whole design at each level"
            )
    return [index for index in varied if space.axes[index].ordered]


def from_surface(space: Space, coded: Floats, ordered: list[int]) -> Ids:
    """Treatments `(runs, axes)` of a response-surface design, repeated at each combination of the
    other axes.

    Parameters:
        space: What the campaign varies.
        coded: The design, of shape `(n, ordered axes)`: from -1 at the lowest level to 1 at the
            highest.
        ordered: Indices of the axes that the columns of `coded` are of, as `ordered_axes` gives
            them.

    Raises:
        ValueError: For a code beyond -1 to 1, and for one between the levels of a factor that is
            not continuous.
    """
    others = [index for index in range(len(space.axes)) if index not in ordered]
    crossed = list(itertools.product(*(range(space.axes[index].size) for index in others)))
    rows = np.zeros((len(crossed), len(coded), len(space.axes)), dtype=np.int64)
    rows[:, :, others] = np.array(crossed, dtype=np.int64).reshape(len(crossed), 1, len(others))
    for column, index in enumerate(ordered):
        rows[:, :, index] = _level_positions(space.axes[index], coded[:, column])
    return rows.reshape(-1, len(space.axes))


def _level_positions(axis: Axis, coded: Floats) -> Ids:
    if np.abs(coded).max() > 1 + 1e-9:
        raise ValueError(
            f"{axis.name}: a run lies at {np.abs(coded).max():.3g} times its range; expected "
            "within the range: a smaller cube, or face cci or ccf"
        )
    exact = (np.asarray(coded) + 1) / 2 * (axis.size - 1)
    places = np.rint(exact)
    if not axis.continuous and np.abs(exact - places).max() > 1e-6:
        between = coded[np.abs(exact - places) > 1e-6][0]
        raise ValueError(
            f"{axis.name} has {axis.size} levels, and a run lies between two "
            f"of them (at {between:.3g} from -1 to 1); "
            "expected three levels for face ccf or Box-Behnken, or a continuous factor"
        )
    return places.astype(np.int64)


def _check(name: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise ValueError(f"{name} is {value!r}; expected one of {', '.join(choices)}")
