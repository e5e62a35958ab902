"""Databases of both engines by the dozen, and the table of what was tried."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from support.processes.striking import HEADER, TALLIES, Forge
from support.stores.many_databases import Databases, Files, on_server


@pytest.fixture(params=["sqlite", "postgresql"])
def databases(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Databases]:
    """Of each engine in turn."""
    if request.param == "sqlite":
        yield Files(tmp_path)
        return
    with on_server(request.getfixturevalue("postgres_url")) as found:
        yield found


@pytest.fixture(scope="session")
def forge(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Forge]:
    """Starts the commands that are struck."""
    if not hasattr(os, "fork"):
        pytest.skip("no fork on this system")
    found = Forge(tmp_path_factory.mktemp("forge"))
    yield found
    found.close()


@pytest.fixture(scope="session")
def forge_without_models(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Forge]:
    """The same, ready in a third of the time: for commands that know no registry."""
    if not hasattr(os, "fork"):
        pytest.skip("no fork on this system")
    found = Forge(tmp_path_factory.mktemp("forge"), models=False)
    yield found
    found.close()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """As docs/measurements/faults.md shows it."""
    if TALLIES:
        terminalreporter.section("killed at random moments")
        terminalreporter.write_line(
            "\n".join([HEADER, *(tally.row() for tally in TALLIES.values())])
        )
