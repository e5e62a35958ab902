"""The Bayesian optimisation of the contact-time process: once for all models of a split."""

from __future__ import annotations

import json
import os
import time
from pathlib import Path
from typing import Any

import numpy as np

from ..dataset.table import PulseTable
from .locks import locked
from .tasks import TRAINING_VERSION, rng_of


def shared_time_settings(pulses: PulseTable, dataset_hash: str, split: str, seed: int, work: Path) -> dict[str, Any]:
    """Settings found for the contact time of these training pulses, from `work` where they were found before."""
    file = work / f"contact-time-{dataset_hash[:16]}-{split.replace('/', '_')}-{seed}-v{TRAINING_VERSION}.json"
    with locked(file.with_suffix(".lock")):  # of two processes that want it, one searches
        try:
            found: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))["tuned"]
            return found
        except (OSError, ValueError, KeyError):
            pass  # not there, or not what we write
        tuned, seconds = _searched(pulses, rng_of("contact-time", dataset_hash, split, seed))
        replace_text(file, json.dumps({"tuned": tuned, "seconds": seconds}))
    return tuned


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
