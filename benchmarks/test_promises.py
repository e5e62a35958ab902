"""The promised figures, measured at full size: `make bench-full`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks import coregional, designs, genetic, plate, prediction
from benchmarks.themes import FULL, work_folder

pytestmark = pytest.mark.bench


@pytest.fixture(scope="session")
def folder() -> Iterator[Path]:
    with work_folder() as folder:
        yield folder


@pytest.mark.parametrize("theme", FULL)
def test_promises_hold(theme: str, folder: Path) -> None:
    lost = [figure.row() for figure in FULL[theme](folder) if figure.binding and not figure.holds]
    assert not lost, "\n".join(lost)


def test_designs_are_at_least_the_peers(capsys: pytest.CaptureFixture[str]) -> None:
    if not designs.TABLE.is_file():
        pytest.skip("no ../shared beside the repository: Table A.1 is there")
    assert designs.main([]) == 0, capsys.readouterr().out


def test_coregional_process_beats_the_peers(capsys: pytest.CaptureFixture[str]) -> None:
    assert coregional.main([]) == 0, capsys.readouterr().out


def test_genetic_search_beats_the_peer(capsys: pytest.CaptureFixture[str]) -> None:
    assert genetic.main() == 0, capsys.readouterr().out


def test_plates_are_solved_and_answer_in_time(capsys: pytest.CaptureFixture[str]) -> None:
    assert plate.main() == 0, capsys.readouterr().out


def test_a_prediction_is_as_quick_as_promised(capsys: pytest.CaptureFixture[str]) -> None:
    assert prediction.main() == 0, capsys.readouterr().out
