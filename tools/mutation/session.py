"""Modules against their tests, several processes at a time."""

from __future__ import annotations

import multiprocessing
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.pool import Pool
from pathlib import Path

from . import trial
from .mutants import Mutant
from .plan import Target

#: A mutant that runs past this many times the tests' own time, and these seconds, is given up.
_PATIENCE, _GRACE_S = 5.0, 20.0
#: Within which unchanged code must have passed its tests.
_MOST_S = 600.0

_copy: Path | None = None


@dataclass(frozen=True)
class Trial:
    """`mutant` None: the module as it is."""

    mutant: Mutant | None
    target: Target
    limit_s: float


@contextmanager
def workers(root: Path, warm: Sequence[str], own: Sequence[str], jobs: int) -> Iterator[Pool]:
    """Processes that each have a copy of the tree, and end with the context."""
    context = multiprocessing.get_context("forkserver")  # which loads the libraries once
    context.set_forkserver_preload([*warm, __name__])
    with (
        tempfile.TemporaryDirectory(prefix="mutants-") as folder,
        context.Pool(jobs, _begin, (root, folder, warm, own)) as pool,
    ):
        yield pool


def limits(pool: Pool, targets: Sequence[Target]) -> dict[str, float]:
    """Seconds that a mutant of each module may take. Raises `RuntimeError` for tests that fail
    without one."""
    suites = {frozenset(target.tests): target for target in targets}
    found = {}
    for target, outcome in pool.imap(
        _try, [Trial(None, target, _MOST_S) for target in suites.values()]
    ):
        if outcome.what != "survived":
            raise RuntimeError(f"{target.module} as it is: {outcome.what} {outcome.by}")
        found[frozenset(target.tests)] = _PATIENCE * outcome.seconds + _GRACE_S
    return {target.module: found[frozenset(target.tests)] for target in targets}


def outcomes(pool: Pool, trials: Sequence[Trial]) -> Iterator[tuple[Mutant, trial.Outcome]]:
    """Each mutant with what became of it, as they end."""
    return pool.imap_unordered(_try_mutant, trials)


def _begin(root: Path, folder: str, warm: Sequence[str], own: Sequence[str]) -> None:
    global _copy
    trial.warmed(warm)
    _copy = trial.copied(root, Path(tempfile.mkdtemp(dir=folder)))
    trial.warmed_own(_copy, own)


def _try(one: Trial) -> tuple[Target, trial.Outcome]:
    assert _copy is not None
    code = one.mutant.code if one.mutant else None
    return one.target, trial.tried(_copy, one.target.module, code, one.target.words, one.limit_s)


def _try_mutant(one: Trial) -> tuple[Mutant, trial.Outcome]:
    assert one.mutant is not None
    return one.mutant, _try(one)[1]
