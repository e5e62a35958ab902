"""Killed at random moments, commands lose nothing, a repeat completes; what takes data back is done
or is not."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from support.processes.striking import Forge, Place, strike
from support.processes.struck_places import (
    ingest_places,
    migrate_places,
    promote_places,
    train_places,
)
from support.processes.undone_places import COMMANDS, UndonePlace, undone_places
from support.stores.many_databases import Databases, Files

SEED = int(os.environ.get("PYROSHOCK_FAULTS_SEED", "8"))
#: In the long run, over both engines.
KILLS = int(os.environ.get("PYROSHOCK_FAULTS_KILLS", "200"))
#: Of each operation; an ingest is the longest work, and the one that a lab does every day.
SHARES = {"ingest": 0.4, "train": 0.2, "promote": 0.2, "db upgrade": 0.2}

Making = Callable[[Databases, Path], Callable[[str], Place]]
MAKINGS: dict[str, Making] = {
    "ingest": ingest_places,
    "train": train_places,
    "promote": promote_places,
    "db upgrade": migrate_places,
}


def killed(forge: Forge, operation: str, databases: Databases, folder: Path, kills: int) -> None:
    """Kill and look; the tally is told whatever comes of it."""
    make = MAKINGS[operation](databases, folder)
    rng = np.random.default_rng([SEED, *operation.encode(), *databases.engine.encode()])
    tally = strike(forge, operation, databases.engine, make, kills, rng)
    assert tally.lost == [] and tally.struck >= kills


@pytest.mark.parametrize("operation", MAKINGS)
@pytest.mark.slow
@pytest.mark.timeout(7200)
def test_nothing_is_lost_in_many_kills(forge, operation, databases, tmp_path):
    killed(forge, operation, databases, tmp_path, round(KILLS * SHARES[operation] / 2))


def test_killed_upgrade_is_before_or_after(forge_without_models, tmp_path):
    killed(forge_without_models, "db upgrade", Files(tmp_path), tmp_path, 3)


#: Those that take seconds; the slow tests kill all. Of an archive,
#: `tests/app/removal/test_removal.py` looks at the moment between file and deletion in the default
#: tests; a restoration is one transaction, as a deletion is.
QUICK = {"campaigns delete", "runs discard", "runs replace"}


def killed_undoing(
    forge: Forge, operation: str, databases: Databases, folder: Path, kills: int
) -> None:
    make = undone_places(operation, databases, folder)
    rng = np.random.default_rng([SEED, *operation.encode(), *databases.engine.encode()])
    tally = strike(forge, operation, databases.engine, make, kills, rng, UndonePlace.is_done)
    assert tally.lost == [] and tally.struck >= kills


@pytest.mark.parametrize("operation", COMMANDS)
@pytest.mark.slow
@pytest.mark.timeout(7200)
def test_nothing_is_between_before_and_after_in_many_kills(forge, operation, databases, tmp_path):
    killed_undoing(forge, operation, databases, tmp_path, round(KILLS / 2 / len(COMMANDS)))


@pytest.mark.parametrize(
    "operation",
    [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in COMMANDS],
)
def test_killed_undoing_is_before_or_after(forge_without_models, operation, tmp_path):
    killed_undoing(forge_without_models, operation, Files(tmp_path), tmp_path / "places", 2)
