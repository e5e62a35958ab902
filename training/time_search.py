"""The Bayesian optimisation of the contact-time process: once for all models of a split."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..dataset.splits import split_of
from ..dataset.table import PulseTable
from .fitting import Ground
from .tasks import TRAINING_VERSION, rng_of


@dataclass(frozen=True)
class TimeSettings:
    """What was found for the contact time of a split's training pulses, and how long it took."""

    tuned: Mapping[str, Any]
    seconds: float


def searched_time(split: str, ground: Ground) -> TimeSettings:
    """Raises `ValueError` where nothing can be learned from the split."""
    training = ground.table.take(split_of(ground.table, split, ground.seed).train)
    tuned, seconds = _searched(training, rng_of("contact-time", ground.dataset.hash, split, ground.seed))
    return TimeSettings(tuned, seconds)


def kept_time(split: str, ground: Ground) -> TimeSettings | None:
    """What was found earlier."""
    try:
        return TimeSettings(**json.loads(_file(split, ground).read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return None  # not there, or not what we write


def keep_time(found: TimeSettings, split: str, ground: Ground) -> None:
    """For the next training on this split."""
    replace_text(_file(split, ground), json.dumps({"tuned": dict(found.tuned), "seconds": found.seconds}))


def _file(split: str, ground: Ground) -> Path:
    of = f"{ground.dataset.hash[:16]}-{split.replace('/', '_')}-{ground.seed}-v{TRAINING_VERSION}"
    return ground.work / f"contact-time-{of}.json"


def _searched(pulses: PulseTable, rng: np.random.Generator) -> tuple[dict[str, Any], float]:
    from .estimators.contact_time import ContactTimeProcess

    begun = time.perf_counter()
    process = ContactTimeProcess()
    process.fit(pulses.x, pulses.contact_time_s[:, np.newaxis], pulses.configuration, rng)
    assert process.tuned_ is not None
    return process.tuned_, time.perf_counter() - begun


def replace_text(file: Path, text: str) -> None:
    """Write so that a reader, or whoever comes after a kill, sees the old file or the whole new one."""
    file.parent.mkdir(parents=True, exist_ok=True)
    beside = file.with_name(f"{file.name}.{os.getpid()}")
    beside.write_text(text, encoding="utf-8")
    beside.replace(file)
