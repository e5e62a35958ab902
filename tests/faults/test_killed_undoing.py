"""Killed at random moments while a campaign or recording is taken back, the store is as before or as after.

`make test-faults` kills 200 times, over both engines; PYROSHOCK_FAULTS_SEED moves the moments, PYROSHOCK_FAULTS_KILLS
their number.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from support.processes.striking import Forge, strike
from support.processes.undone_places import COMMANDS, UndonePlace, undone_places
from support.stores.many_databases import Databases, Files

SEED = int(os.environ.get("PYROSHOCK_FAULTS_SEED", "8"))
KILLS = int(os.environ.get("PYROSHOCK_FAULTS_KILLS", "200"))


#: Those that take seconds; the slow tests kill all. Of an archive, `tests/app/removal/test_archiving.py` looks at the
#: moment between file and deletion in the default tests; a restoration is one transaction, as a deletion is.
QUICK = {"campaigns delete", "runs discard", "runs replace"}


def killed(forge: Forge, operation: str, databases: Databases, folder: Path, kills: int) -> None:
    """Kill and look; the tally is told whatever comes of it."""
    make = undone_places(operation, databases, folder)
    rng = np.random.default_rng([SEED, *operation.encode(), *databases.engine.encode()])
    tally = strike(forge, operation, databases.engine, make, kills, rng, UndonePlace.is_done)
    assert tally.lost == []
    assert tally.struck >= kills


@pytest.mark.parametrize("operation", COMMANDS)
@pytest.mark.slow
@pytest.mark.timeout(7200)
def test_nothing_is_between_before_and_after_in_many_kills(forge, operation, databases, tmp_path):
    killed(forge, operation, databases, tmp_path, round(KILLS / 2 / len(COMMANDS)))


@pytest.mark.parametrize(
    "operation", [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in COMMANDS]
)
def test_killed_it_is_before_or_after(forge_without_models, operation, tmp_path):
    killed(forge_without_models, operation, Files(tmp_path), tmp_path / "places", 2)
