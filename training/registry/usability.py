"""Registered models whose error is far above what the bench repeats to: they are listed, but told
as not usable."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..evaluation.floor import SCOPES, floor_metrics
from ..evaluation.gate import not_usable
from .records import Version

_METRIC = "force_nrmse"
#: Of a version that was judged on it, its figures count alone: held-out repetitions flatter a
#: model.
_UNSEEN = "configurations"


def repeatability(floor: str) -> float | None:
    """The force NRMSE of repeated impacts of a configuration, of a split's floor as the registry
    keeps it."""
    metrics = floor_metrics(floor, SCOPES[0])
    return metrics[_METRIC].mean if metrics and metrics[_METRIC].mean > 0 else None


def usability(records: Sequence[Version], floors: Mapping[str, str]) -> str:
    """Why a version is not usable, by its records of all splits and the floors by split; empty
    where it is usable, and where the repeatability is not known."""
    unseen = [record for record in records if record.split == _UNSEEN]
    judged = unseen or records
    errors = {
        record.split: record.metrics[_METRIC].mean for record in judged if _METRIC in record.metrics
    }
    values = {split: repeatability(text) for split, text in floors.items()}
    return not_usable(
        judged[0].label,
        errors,
        {split: value for split, value in values.items() if value is not None},
    )
