"""Inputs that the long run has found, each mended since. Those that are easily described stand beside what they are
about: tests/ingest/readers/test_bombs.py, tests/ingest/test_setting_aside.py, tests/ingest/test_parallel.py,
tests/app/web/test_guard.py, tests/app/test_measured_shots.py."""

from __future__ import annotations

import gzip
import time
from pathlib import Path

import pytest
from click.testing import CliRunner
from fuzzing import seeds
from fuzzing.campaigns_in import ingest
from fuzzing.mutations import folders
from fuzzing.target import SET_ASIDE
from pyroshock.app.cli.main import main

#: Five wrong bytes: libhdf5 reads an attribute for ever. Before, the ingest gave up after two minutes.
WITHOUT_END = gzip.decompress((Path(__file__).parent / "samples" / "hdf5-without-end.h5.gz").read_bytes())


def test_recording_without_end_is_set_aside_in_seconds(tmp_path: Path) -> None:
    files = folders.unpack(seeds.hammer_folders("npz")[0])
    row = seeds.HAMMER_RUNS.format("endless.h5").splitlines()[1].replace("1,1,", "2,1,", 1)
    files |= {"endless.h5": WITHOUT_END, "runs.csv": files["runs.csv"] + f"{row}\n".encode()}
    before = time.monotonic()
    assert ingest(folders.pack(files), tmp_path) == SET_ASIDE
    assert time.monotonic() - before < 100  # 3 s of processor time, on a machine that may have other work; before 240


@pytest.mark.slow
def test_spectrum_of_a_recording_without_end_is_refused(tmp_path: Path) -> None:
    """`srs` read it in its own process, and never came back."""
    path = tmp_path / "endless.h5"
    path.write_bytes(WITHOUT_END)
    result = CliRunner().invoke(main, ["srs", str(path)])
    assert result.exit_code == 2
    assert "endless.h5: the library that reads it was crashed by it, or did not end" in result.stderr


def test_error_about_pages_of_text_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / "target.csv"
    path.write_text(f"frequency_hz,level_g\n100,{'9' * 9000}x\n200,1\n")
    result = CliRunner().invoke(main, ["tune", "--target", str(path), "--db", f"sqlite:///{tmp_path}/none.db"])
    assert result.exit_code == 2
    assert len(result.stderr.splitlines()[-1]) < 1100


@pytest.fixture(autouse=True)
def _no_store(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("PYROSHOCK_DB", raising=False)
