"""The control chart of individual values and their moving range."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ....array_types import Floats

#: Limits of individual values are 3 / d2 mean moving ranges from the centre, the limit of the
#: moving range is D4 times its mean, both for ranges of two: d2 = 1.128, D4 = 3.267.
LIMIT_OF_VALUES, LIMIT_OF_RANGES = 2.66, 3.267
#: So many in a row on one side of the centre are no chance.
RUN = 8
BEYOND, ONE_SIDE, RANGE_BEYOND = (
    "beyond a limit",
    f"{RUN} in a row on one side of the centre",
    "moving range beyond its limit",
)


@dataclass(frozen=True, eq=False)
class ControlChart:
    """Values (n,) in the order of recording, n >= 2, with centre line and limits.

    `moving_range` (n - 1,) is the distance of each value but the first from the one before it.
    `beyond`, `one_side` and `range_beyond` are the places of values that break a rule.
    """

    values: Floats
    moving_range: Floats
    centre: float
    lower: float
    upper: float
    mean_range: float
    range_limit: float
    beyond: NDArray[np.intp]
    one_side: NDArray[np.intp]
    range_beyond: NDArray[np.intp]

    def rules_broken(self, most: int) -> dict[int, list[str]]:
        """Place -> the rules that the value there breaks, in the order of recording, of `most`
        values at the most: those beyond a limit go before the others."""
        by_rule = (
            (BEYOND, self.beyond),
            (RANGE_BEYOND, self.range_beyond),
            (ONE_SIDE, self.one_side),
        )
        chosen = dict.fromkeys(place for _, places in by_rule for place in places[:most].tolist())
        named = sorted(list(chosen)[:most])
        broken = [(rule, np.isin(named, places)) for rule, places in by_rule]
        return {
            place: [rule for rule, breaks in broken if breaks[number]]
            for number, place in enumerate(named)
        }

    @property
    def broken(self) -> int:
        """How many values break a rule."""
        return int(np.unique(np.concatenate([self.beyond, self.range_beyond, self.one_side])).size)


def control_chart(values: Floats) -> ControlChart:
    """Centre line, limits and broken rules of finite values (n,), n >= 2.

    Parameters:
        values: The values in the order of recording.

    Raises:
        ValueError: For fewer than two values, which have no moving range.

    Source:
        D. C. Montgomery: Introduction to Statistical Quality Control, section 6.4 (chart of
        individuals with limits from the moving range) and section 5.3.6 (eight in a row on one
        side, of the Western Electric handbook); ISO 7870-2:2023, chart of individuals.
    """
    if values.size < 2:
        raise ValueError(
            f"there are {values.size} values; expected 2 or more, for the limits follow from the "
            "distance between neighbours"
        )
    moving_range = np.abs(np.diff(values))
    centre, mean_range = float(values.mean()), float(moving_range.mean())
    reach, range_limit = LIMIT_OF_VALUES * mean_range, LIMIT_OF_RANGES * mean_range
    lower, upper = centre - reach, centre + reach
    return ControlChart(
        values,
        moving_range,
        centre,
        lower,
        upper,
        mean_range,
        range_limit,
        np.flatnonzero((values < lower) | (values > upper)),
        _ends_of_runs(np.sign(values - centre)),
        np.flatnonzero(moving_range > range_limit) + 1,
    )


def _ends_of_runs(side: Floats) -> NDArray[np.intp]:
    """Places (k,) up to which `RUN` values or more in a row are on one side; on the centre line is
    on no side."""
    if side.size < RUN:
        return np.zeros(0, dtype=np.intp)
    sums = np.convolve(side, np.ones(RUN), "valid")
    return np.flatnonzero(np.abs(sums) == RUN) + RUN - 1
