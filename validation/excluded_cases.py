"""The other way round: an effect of the catalogue is taken out of it, and put back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..diagnosis.verdict import UNKNOWN
from .answer_sets import first_entry
from .case_places import stage_hits
from .case_results import CaseResult, Said, WithheldTruth
from .wilson import Rate


@dataclass(frozen=True)
class LeftOut:
    """Without the effect: `unknown` was the first answer, `others` when a remaining effect was, and `stage` was named.
    With it: `found` first, or in the first group; `fraction` of the gap that disappeared (median), of `n` with a gap.

    `instead`: by the effect left out, what was said for it and how often.
    """

    n: int
    unknown: Rate
    others: Rate
    stage: Rate
    found: Rate
    fraction: float
    instead: Mapping[str, Mapping[str, int]]

    def as_json(self) -> dict[str, Any]:
        rates = {name: getattr(self, name).as_json() for name in ("unknown", "others", "stage", "found")}
        fraction = self.fraction if np.isfinite(self.fraction) else None
        return {"n": self.n, **rates, "fraction": fraction, "instead": {k: dict(v) for k, v in self.instead.items()}}


def left_out(labels: Sequence[WithheldTruth], without: Sequence[Said], added: Sequence[Said]) -> LeftOut:
    """From what was said without and with the effect of each label."""
    first = [answer.labels[0] if answer.labels else "" for answer in without]
    shares = [(answer.shrinkage or {}).get("fraction") for answer in added]
    reported_shares = [share for share in shares if share is not None]
    instead: dict[str, dict[str, int]] = {}
    for label, name in sorted(zip(labels, first, strict=True), key=lambda item: item[0].key):
        counts = instead.setdefault(label.key, {})
        counts[name or "no answer"] = counts.get(name or "no answer", 0) + 1
    return LeftOut(
        n=len(labels),
        unknown=Rate.of(name == UNKNOWN for name in first),
        others=Rate.of("." in name for name in first),
        stage=stage_hits([CaseResult(label, answer) for label, answer in zip(labels, without, strict=True)]),
        found=Rate.of(first_entry(CaseResult(label, answer)) for label, answer in zip(labels, added, strict=True)),
        fraction=float(np.median(reported_shares)) if reported_shares else float("nan"),
        instead=instead,
    )
