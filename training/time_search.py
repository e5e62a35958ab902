"""The Bayesian optimisation of the contact-time process: once for all models of a split."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..dataset.splits import split_of
from ..dataset.table import PulseTable
from .fit_report import FitReport
from .fitting import Ground
from .tasks import TRAINING_VERSION, rng_of


@dataclass(frozen=True)
class TimeSettings:
    """What was found for the contact time of a split's training pulses, how long it took, and how the search went.

    `histories` are those of `FitReport`: by name a value for each step. A file of older software has none.
    """

    tuned: Mapping[str, Any]
    seconds: float
    histories: Mapping[str, Sequence[float]] = field(default_factory=dict)

    @property
    def report(self) -> FitReport:
        """What a model that shares the search says of it beside its own training."""
        return FitReport({"search_seconds": self.seconds}, histories=self.histories).under("time")


def searched_time(split: str, ground: Ground) -> TimeSettings:
    """Raises `ValueError` where nothing can be learned from the split."""
    training = ground.table.take(split_of(ground.table, split, ground.seed).train)
    return _searched(training, rng_of("contact-time", ground.dataset.hash, split, ground.seed))


def kept_time(split: str, ground: Ground) -> TimeSettings | None:
    """What was found earlier."""
    try:
        return TimeSettings(**json.loads(_file(split, ground).read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return None  # not there, or not what we write


def keep_time(found: TimeSettings, split: str, ground: Ground) -> None:
    """For the next training on this split."""
    replace_text(_file(split, ground), json.dumps(asdict(found)))


def _file(split: str, ground: Ground) -> Path:
    of = f"{ground.dataset.hash[:16]}-{split.replace('/', '_')}-{ground.seed}-v{TRAINING_VERSION}"
    return ground.work / f"contact-time-{of}.json"


def _searched(pulses: PulseTable, rng: np.random.Generator) -> TimeSettings:
    from .estimators.contact_time import ContactTimeProcess

    begun = time.perf_counter()
    process = ContactTimeProcess()
    process.fit(pulses.x, pulses.contact_time_s[:, np.newaxis], pulses.configuration, rng)
    assert process.tuned_ is not None
    return TimeSettings(process.tuned_, time.perf_counter() - begun, process.fit_report().histories)


def replace_text(file: Path, text: str) -> None:
    """Write so that a reader, or whoever comes after a kill, sees the old file or the whole new one."""
    file.parent.mkdir(parents=True, exist_ok=True)
    beside = file.with_name(f"{file.name}.{os.getpid()}")
    beside.write_text(text, encoding="utf-8")
    beside.replace(file)
