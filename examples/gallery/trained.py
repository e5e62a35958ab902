"""Models trained on the virtual campaign, and their errors on the held-out pulses, as section 4.3
splits them."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence

import numpy as np
from pyroshock.dataset.table import PulseTable, split_of
from pyroshock.parallel.task import one_thread
from pyroshock.training.evaluation.metrics import pulse_errors
from pyroshock.training.models.catalogue import BuildOptions, entry_of
from pyroshock.training.registry.evaluate import Evaluation

#: Those of Fig. 4.10 that learn quickly, the coregional process and the pulses of physics: what
#: Fig. 5.4 compares.
QUICK = (
    *("nn-bilayer", "nn-trilayer", "nn-narrow", "nn-medium", "nn-wide"),
    *("linear", "pls", "coregional-gp", "hann", "hunter", "reed"),
)
#: A fifth of each test's hits is held out.
SPLIT = "repetitions"


def judged(table: PulseTable, models: Sequence[str], seed: int = 0) -> Evaluation:
    """Each model learns from four fifths of the hits and predicts the rest. Raises `LookupError`
    for an unknown one."""
    entries = {name: entry_of(name) for name in models}
    split = split_of(table, SPLIT, seed)
    training, held_out = table.take(split.train), table.take(split.test)
    predictions = {}
    with (
        one_thread()
    ):  # as `pyroshock train` does: more get into each other's way, and change the last bits
        shared = any(entry.shares_time for entry in entries.values())
        making = BuildOptions(tuned_time=_time_settings(training, seed) if shared else None)
        for name, entry in entries.items():
            begun = time.perf_counter()
            model = entry.make(making).fit(training, np.random.default_rng(seed))
            predictions[name] = model.predict(held_out.inputs)
            logging.getLogger(__name__).info(
                "%s trained in %.1f s", name, time.perf_counter() - begun
            )
    errors = {name: pulse_errors(held_out, prediction) for name, prediction in predictions.items()}
    return Evaluation(held_out, errors, predictions, dict.fromkeys(predictions, 0))


def _time_settings(training: PulseTable, seed: int) -> dict[str, object] | None:
    """The search for the contact-time process that models share: once for all of them."""
    from pyroshock.training.estimators.contact_time import ContactTimeProcess

    time_s, rng = training.contact_time_s[:, None], np.random.default_rng(seed)
    return ContactTimeProcess().fit(training.x, time_s, training.configuration, rng).tuned_
