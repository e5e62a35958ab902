"""Mutants tried from a process of their own: the fork server is one for each process, and loaded
once."""

from __future__ import annotations

import multiprocessing
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from tools.mutation import plan, session
from tools.mutation.trial import Outcome


def tried_alone(root: Path, trials: Sequence[session.Trial]) -> list[Outcome]:
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as alone:
        return alone.submit(_tried, root, trials).result()


def limits_alone(root: Path, targets: Sequence[plan.Target]) -> None:
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as alone:
        alone.submit(_limits, root, targets).result()


def _tried(root: Path, trials: Sequence[session.Trial]) -> list[Outcome]:
    with session.workers(root, (), (), 1) as pool:
        found = dict(session.outcomes(pool, trials))
    return [found[trial.mutant] for trial in trials if trial.mutant]


def _limits(root: Path, targets: Sequence[plan.Target]) -> None:
    with session.workers(root, (), (), 1) as pool:
        session.limits(pool, targets)
