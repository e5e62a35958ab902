"""The promised figures, measured at full size: `make bench-full`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks import designs
from benchmarks.__main__ import THEMES, measured
from benchmarks.harness import work_folder

pytestmark = pytest.mark.bench


@pytest.fixture(scope="session")
def folder() -> Iterator[Path]:
    with work_folder() as folder:
        yield folder


@pytest.mark.parametrize("theme", THEMES)
def test_promises_hold(theme: str, folder: Path) -> None:
    lost = [
        figure.row()
        for figure in measured(theme, True, folder)
        if figure.binding and not figure.holds
    ]
    assert not lost, "\n".join(lost)


def test_designs_are_at_least_the_peers(capsys: pytest.CaptureFixture[str]) -> None:
    assert designs.main([]) == 0, capsys.readouterr().out
