"""A difference between two models in one metric, as a record and as a sentence."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

#: Below which a difference is told to be beyond chance.
LEVEL = 0.05


@dataclass(frozen=True)
class Difference:
    """Mean error of `a` minus that of `b` in one metric, over all pulses or over those of a group.

    `low` to `high` is the 90 % interval (NaN with a single configuration); `p_value` of a group is corrected for their
    number. `group` is ("tip_material", "steel"), None for all pulses.
    """

    a: str
    b: str
    metric: str
    mean_a: float
    mean_b: float
    low: float
    high: float
    p_value: float
    pulses: int
    configurations: int
    group: tuple[str, str] | None = None

    @property
    def difference(self) -> float:
        """Below zero where `a` is the better one."""
        return self.mean_a - self.mean_b

    @property
    def beyond_chance(self) -> bool:
        """Whether chance alone would hardly have made it."""
        return self.p_value < LEVEL

    @property
    def verdict(self) -> str:
        """In a sentence."""
        where = f" where {self.group[0]} is {self.group[1]}" if self.group else ""
        if self.difference == 0:
            return f"{self.a} and {self.b} are equal in {_words(self.metric)}{where}."
        better, worse = (self.a, self.b) if self.difference < 0 else (self.b, self.a)
        ends = sorted((-self.low, -self.high) if self.difference < 0 else (self.low, self.high))
        range_ = f" ({ends[0]:.2g} to {ends[1]:.2g})" if np.isfinite(ends).all() else ""
        by = f"{abs(self.difference):.2g}{range_}{_unit(self.metric)}"
        if self.beyond_chance:
            return f"{better} is better than {worse} in {_words(self.metric)} by {by}{where}, beyond chance."
        chance = f"which may be chance (p = {self.p_value:.2g})"
        return f"{better} leads {worse} in {_words(self.metric)} by {by}{where}, {chance}."

    def row(self) -> dict[str, Any]:
        """As commands print it in JSON."""
        finite = np.isfinite([self.low, self.high]).all()
        named: dict[str, Any] = {"a": self.a, "b": self.b, "metric": self.metric, "difference": self.difference}
        named |= {"ci90": [self.low, self.high] if finite else None, "p_value": self.p_value}
        return named | ({"group": {self.group[0]: self.group[1]}} if self.group else {})


def _words(metric: str) -> str:
    return metric.removesuffix("_n").replace("_", " ").replace("rmse", "RMSE").replace("nRMSE", "NRMSE")


def _unit(metric: str) -> str:
    return " N" if metric.endswith("_n") else ""
