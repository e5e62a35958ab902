"""Registered models whose error is larger than the force, than that of the mean pulse, or far above
what the bench repeats to: they are listed, but told as not usable."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..evaluation.floor import SCOPES, floor_metrics
from ..evaluation.gate import Unusable, find_unusable
from ..evaluation.metrics import OF_MEAN
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
    where it is usable, as far as its figures tell."""
    unseen = [record for record in records if record.split == _UNSEEN]
    reasons = (unusable_record(record, floors) for record in unseen or records)
    return next((str(reason) for reason in reasons if reason is not None), "")


def unusable_record(record: Version, floors: Mapping[str, str]) -> Unusable | None:
    """Why a version is not usable by its record of one split; None where it is."""
    if _METRIC not in record.metrics:
        return None
    floor = repeatability(floors[record.split]) if record.split in floors else None
    of_mean = record.metrics.get(OF_MEAN)
    return find_unusable(
        record.label,
        record.split,
        record.metrics[_METRIC].mean,
        record.metrics[_METRIC].low,
        floor,
        None if of_mean is None else of_mean.mean,
    )
