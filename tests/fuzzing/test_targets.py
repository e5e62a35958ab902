"""The first inputs of the long run, without guidance: the same targets, damage and rules, a few of
each.

At its end what the long run has found, each mended since. What is easily described stands beside
what it is about: tests/ingest/readers/test_bombs.py, tests/ingest/storing/test_setting_aside.py,
tests/parallel/test_mapping.py, tests/app/web/test_guard.py, tests/app/test_measured_shots.py.
"""

from __future__ import annotations

import gzip
import time
from pathlib import Path
from random import Random

import pytest
from click.testing import CliRunner
from fuzzing import seeds
from fuzzing.mutations import folders
from fuzzing.target import ACCEPTED, FINDING, REFUSED, SET_ASIDE, Target, judge
from fuzzing.targets import TARGETS, ingest
from pyroshock.app.doors.command_line.main import main

#: A whole ingest takes as long as a hundred tables. What may crash its library is left to the long
#: run's processes.
INPUTS, SLOW_INPUTS = 25, 4
SHORT = {name: target for name, target in TARGETS.items() if not target.may_crash}


@pytest.mark.parametrize("name", SHORT)
def test_damaged_input_is_accepted_whole_or_refused(name: str, tmp_path: Path) -> None:
    target, rng = SHORT[name], Random(f"short run of {name}")
    seeds = list(target.seeds())
    for _n in range(INPUTS if target.weight >= 1 else SLOW_INPUTS):
        data = target.mutate(rng.choice(seeds), rng, seeds)
        outcome = judge(target, data, tmp_path / "x")
        assert outcome.kind != FINDING, f"{outcome.where}\n{outcome.detail}\n{data[:300]!r}"


@pytest.mark.parametrize("name", [name for name in SHORT if SHORT[name].weight >= 1])
def test_every_seed_is_accepted(name: str, tmp_path: Path) -> None:
    """Else the campaign would damage what is refused anyway."""
    target = SHORT[name]
    assert {judge(target, data, tmp_path / "x").kind for data in target.seeds()} == {ACCEPTED}


@pytest.mark.parametrize(
    ("error", "kind"),
    [
        (ValueError("input.csv: no number"), REFUSED),
        (ValueError("no number"), FINDING),
        (KeyError("force"), FINDING),
        (SystemExit(3), FINDING),
        (MemoryError(), FINDING),
    ],
)
def test_anything_but_a_refusal_that_names_the_file_is_found(
    error: BaseException, kind: str, tmp_path: Path
) -> None:
    assert judge(_raising(error), b"", tmp_path / "x").kind == kind


def test_lack_of_memory_behind_a_refusal_is_found(tmp_path: Path) -> None:
    refusal = ValueError("input.csv: damaged")
    refusal.__cause__ = MemoryError()
    assert judge(_raising(refusal), b"", tmp_path / "x").kind == FINDING


def _raising(error: BaseException) -> Target:
    def use(data: bytes, folder: Path) -> str:
        raise error

    return Target(
        "a reader", use, list, lambda data, rng, others: data, (ValueError,), "input.csv", ()
    )


#: Five wrong bytes: libhdf5 reads an attribute for ever. Before, the ingest gave up after two
#: minutes.
WITHOUT_END = gzip.decompress(
    (Path(__file__).parent / "samples" / "hdf5-without-end.h5.gz").read_bytes()
)


def test_recording_without_end_is_set_aside_in_seconds(tmp_path: Path) -> None:
    files = folders.unpack(seeds.hammer_folders("npz")[0])
    row = seeds.HAMMER_RUNS.format("endless.h5").splitlines()[1].replace("1,1,", "2,1,", 1)
    files |= {"endless.h5": WITHOUT_END, "runs.csv": files["runs.csv"] + f"{row}\n".encode()}
    before = time.monotonic()
    assert ingest(folders.pack(files), tmp_path) == SET_ASIDE
    assert (
        time.monotonic() - before < 100
    )  # 3 s of processor time, on a machine that may have other work; before 240


@pytest.mark.slow
def test_spectrum_of_a_recording_without_end_is_refused(tmp_path: Path) -> None:
    """`srs` read it in its own process, and never came back."""
    path = tmp_path / "endless.h5"
    path.write_bytes(WITHOUT_END)
    result = CliRunner().invoke(main, ["srs", str(path)])
    assert result.exit_code == 2
    assert (
        "endless.h5: the library that reads it was crashed by it, or did not end" in result.stderr
    )


def test_error_about_pages_of_text_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / "target.csv"
    path.write_text(f"frequency_hz,level_g\n100,{'9' * 9000}x\n200,1\n")
    result = CliRunner().invoke(
        main, ["tune", "--target", str(path), "--db", f"sqlite:///{tmp_path}/none.db"]
    )
    assert result.exit_code == 2
    assert len(result.stderr.splitlines()[-1]) < 1100


@pytest.fixture(autouse=True)
def _no_store(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("PYROSHOCK_DB", raising=False)
