"""From evidence to probabilities that mean something: a map of margins, learned on campaigns whose cause was known.

Evidence is too sure: laws are never quite those of the bench. A temperature does not mend that, since margins reach
thousands of nats. The map is a conditional logit (McFadden 1974) on compressed margins, asinh((l_k - max l) / 2), with
an intercept for none, for unknown and for pairs. It sees margins only: a map that also sees how badly the best
hypothesis fits takes a rough background for something unknown.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from importlib.resources import files
from typing import Self

import numpy as np
from numpy.typing import NDArray

from .verdict import NONE, UNKNOWN

Floats = NDArray[np.float64]

#: Margins up to so many nats count in proportion, beyond by their logarithm. Of 0.5 to 20 this one had the smallest
#: loss and the smallest calibration error on development campaigns.
_LINEAR = 2.0


@dataclass(frozen=True)
class CalibrationMap:
    """`slope` of the compressed margin, and intercepts. `source` says on what it was learned."""

    slope: float
    none: float
    unknown: float
    pair: float
    source: str = ""

    def __call__(self, log_joint: Mapping[str, float]) -> dict[str, float]:
        """Probabilities by falling size, from log evidences with the priors in them."""
        names = list(log_joint)
        scores = self.scores(names, np.array([log_joint[name] for name in names]))
        weights = np.exp(scores - scores.max())
        weights /= weights.sum()
        return {names[i]: float(weights[i]) for i in np.argsort(-weights, kind="stable")}

    def scores(self, names: Sequence[str], logs: Floats) -> Floats:
        """(n,)"""
        return self.slope * _margins(logs) + self._intercepts()[_kinds(names)]

    def _intercepts(self) -> Floats:
        """(4,), in the order of `_kinds`."""
        return np.array([0.0, self.none, self.unknown, self.pair])

    def as_json(self) -> dict[str, float | str]:
        return asdict(self)

    @classmethod
    def learned(
        cls,
        campaigns: Sequence[tuple[Mapping[str, float], str]],
        source: str,
        towards: CalibrationMap | None = None,
        shares: Mapping[str, float] | None = None,
    ) -> Self:
        """From log joints and each true hypothesis: the likeliest map, drawn a little to slope 1 and no intercepts, or
        `towards` another.

        `shares` of what is true in the campaigns that the map is for: "none", "unknown", "pair" and "single"; those
        that it learns from are weighted accordingly (None: as they are). A campaign whose truth is not among its
        hypotheses says nothing. Raises `ValueError` without any that does.
        """
        from scipy.optimize import minimize

        useful = [(list(logs), np.array(list(logs.values())), truth) for logs, truth in campaigns if truth in logs]
        if not useful:
            raise ValueError("no campaign whose true cause is among the hypotheses: nothing to learn from")

        weight = np.array(_weights([truth for _, _, truth in useful], shares))
        start = np.zeros(4)
        if towards is not None:
            start = np.array([np.log(towards.slope), towards.none, towards.unknown, towards.pair])

        margins = np.concatenate([_margins(logs) for _, logs, _ in useful])
        kinds = np.concatenate([_kinds(names) for names, _, _ in useful])
        sizes = np.array([len(names) for names, _, _ in useful])
        begins = np.concatenate([[0], sizes.cumsum()[:-1]])
        true = begins + np.array([names.index(truth) for names, _, truth in useful])

        def loss(theta: Floats) -> float:
            one = cls(float(np.exp(theta[0])), float(theta[1]), float(theta[2]), float(theta[3]))
            scores = one.slope * margins + one._intercepts()[kinds]
            highest = np.maximum.reduceat(scores, begins)
            sums = np.add.reduceat(np.exp(scores - highest.repeat(sizes)), begins)
            likely = scores[true] - np.log(sums) - highest
            return 0.5 * float((theta - start) @ (theta - start)) - float(weight @ likely)

        best = minimize(loss, start, method="Nelder-Mead", options={"maxiter": 2000, "xatol": 1e-3, "fatol": 1e-4})
        slope, none, unknown, pair = (float(value) for value in best.x)
        return cls(float(np.exp(slope)), none, unknown, pair, source)


def _margins(logs: Floats) -> Floats:
    """Behind the likeliest, compressed."""
    return np.asarray(np.arcsinh((logs - logs.max()) / _LINEAR))


def _kinds(names: Sequence[str]) -> NDArray[np.int64]:
    """A single effect 0, none 1, unknown 2, a pair 3."""
    return np.array([1 if name == NONE else 2 if name == UNKNOWN else 3 if "+" in name else 0 for name in names])


def _weights(truths: Sequence[str], shares: Mapping[str, float] | None) -> list[float]:
    """Of each campaign, one on the mean."""
    kinds = [truth if truth in (NONE, UNKNOWN) else "pair" if "+" in truth else "single" for truth in truths]
    if shares is None:
        return [1.0] * len(kinds)
    present = sum(shares[kind] for kind in set(kinds))
    return [shares[kind] / present * len(kinds) / kinds.count(kind) for kind in kinds]


#: The map of campaigns in which several stages were compared.
SEVERAL = "several"


def shipped(stages: Sequence[str]) -> CalibrationMap:
    """The map that comes with the software for campaigns in which these stages were compared.

    Evidence of one velocity for each configuration is not as much too sure as that of seventy lines and modes.
    """
    maps = _maps()
    return maps[stages[0]] if len(stages) == 1 and stages[0] in maps else maps[SEVERAL]


@cache
def _maps() -> dict[str, CalibrationMap]:
    text = (files(__package__) / "data" / "calibration.json").read_text(encoding="utf-8")
    return {name: CalibrationMap(**each) for name, each in json.loads(text).items()}
