"""Work that is sent to Ray, where it is installed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pyroshock.compute.crew import HERE, Crew
from pyroshock.compute.mapping import mapped
from support.processes import chores
from support.processes.planted import planted, ran

pytest.importorskip("ray", reason="Ray is not among the extras: pip install ray")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("ignore"),
]  # Ray's own warnings differ from release to release


@pytest.fixture(autouse=True)
def workers_find_chores(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(Path(chores.__file__).parents[2]))


@pytest.mark.parametrize(("function", "shared"), [(chores.product, ()), (chores.scaled, (np.ones(300_000), 7))])
def test_results_are_those_of_this_process(function, shared):
    here, there = (sorted(mapped(crew, function, range(3), shared=shared)) for crew in (HERE, Crew("ray")))
    assert here == there


def test_item_that_kills_its_workers_costs_no_other():
    found = dict(mapped(Crew("ray"), chores.deadly, range(6), lost=lambda number: -number))
    assert found == {n: -3 if n == 3 else n for n in range(6)}


def test_its_processes_import_nothing_from_the_working_directory(tmp_path, monkeypatch):
    """Ray itself puts the caller's working directory first."""
    (tmp_path / "c").mkdir()
    trap = planted(tmp_path / "c")
    monkeypatch.chdir(tmp_path / "c")
    assert dict(mapped(Crew("ray"), chores.squared, range(3))) == {0: 0, 1: 1, 2: 4}
    assert ran(trap) == ""
