"""Progress of long work: shown at once on a terminal, every ten seconds in a log, and not at all of
what is quick."""

from __future__ import annotations

import os
import pty
import select
import subprocess
import sys
import time

import pytest
from pyroshock.app.common import progress
from pyroshock.app.common.progress import notebook_bar, progress_bar

LONG = (
    "simulate spring --out out", "ingest spring", "train spring", "tune --target spec.csv",
    "validate spring",
    "diagnose spring", "predict", "predict --plan spring", "extract spring",
    "report spring --out spring.html",
    "export impacts --out impacts.csv", "db copy sqlite:///lab.db sqlite:///new.db",
    "db export spring --out spring.pyroshock", "db import spring.pyroshock", "db check",
    "campaigns archive spring --out a.pyroshock --reason old", "campaigns restore spring.pyroshock",
    "blind-check --cases 1", "plan lhs spring --runs 5", "plan augment spring", "compare a b",
    "srs spec.csv", "models", "models show tree@1", "promote tree@1",
)  # fmt: skip


@pytest.mark.parametrize("words", LONG)
def test_a_terminal_shows_what_is_done_before_the_store_is_opened(words, tmp_path):
    """The whole program at a pseudo-terminal; there is no store, so that a later line would be the
    refusal."""
    for name in ("spec.csv", "spring.pyroshock"):
        (tmp_path / name).touch()
    # a request is read before anything is shown, and an empty specification is refused at once
    (tmp_path / "spec.csv").write_text("frequency_hz,level_g\n100,30\n10000,300\n")
    (tmp_path / "spring").mkdir()
    own_end, terminal = pty.openpty()
    start = time.monotonic()
    program = subprocess.Popen(
        [sys.executable, "-m", "pyroshock", *words.split()],
        cwd=tmp_path,
        stdout=subprocess.DEVNULL,
        stderr=terminal,
        env=os.environ | {"PYROSHOCK_DB": "sqlite:///lab.db"},
    )
    try:
        ready, _, _ = select.select([own_end], [], [], 20.0)
        seconds = time.monotonic() - start
        text = os.read(own_end, 1000).decode() if ready else ""
    finally:
        program.kill()
        program.wait()
        os.close(own_end)
        os.close(terminal)
    assert text.splitlines()[0].endswith(" …"), text
    assert seconds < 3.0  # 0.3 s on a quiet machine; the tests share theirs


def test_a_log_has_lines_at_the_beginning_and_the_end_and_between_them_how_much_is_left(
    monkeypatch, capfd
):
    monkeypatch.setattr(progress, "SILENT_S", 0.05)
    monkeypatch.setattr(progress, "BETWEEN_LINES_S", 0.1)
    with progress_bar("Firing", "shots") as step:
        time.sleep(0.2)
        step(1, 4, "run 1")
        time.sleep(0.25)
    first, second, *_, before_last, last = capfd.readouterr().err.splitlines()
    assert (first, second, last) == ("Firing …", "Firing: 0 s elapsed", "Firing: done in 0 s")
    assert before_last.startswith("Firing: 1 of 4 shots, 0 s elapsed, about ")


def test_a_log_has_nothing_of_what_is_quick_and_no_end_of_what_failed(monkeypatch, capfd):
    with progress_bar("Firing", "shots") as step:
        step(1, 1, "run 1")
    assert capfd.readouterr().err == ""
    monkeypatch.setattr(progress, "SILENT_S", 0.0)
    with pytest.raises(OSError, match="no plate"), progress_bar("Firing"):
        time.sleep(0.1)
        raise OSError("no plate")
    assert capfd.readouterr().err == "Firing …\n"


def test_a_terminal_shows_the_time_until_the_block_begins(monkeypatch, capfd):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setattr(progress, "BEFORE_THE_BLOCK_S", 0.1)
    bar = progress_bar("Firing", "shots")
    time.sleep(0.35)
    before = capfd.readouterr().err.splitlines()
    with bar:
        time.sleep(0.3)
    assert before[:2] == ["Firing …", "Firing: 0 s elapsed"] and len(before) >= 3
    assert "Firing" not in capfd.readouterr().err


def test_a_bar_shows_the_remaining_time_from_the_first_step(monkeypatch, capfd):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    with progress_bar("Firing", "shots") as step:
        step(0, 4, "")
        time.sleep(0.15)
        step(1, 4, "run 1")
        time.sleep(0.15)
        step(2, 4, "run 2")
    line, *bar = capfd.readouterr().err.splitlines()
    assert line == "Firing …"
    assert (
        "working [00:00]" in "".join(bar)
        and "2 of 4 shots" in "".join(bar)
        and "left], run 2" in "".join(bar)
    )


def test_a_bar_of_the_library_that_is_not_shown_takes_its_steps(capfd):
    """Outside of a notebook and a terminal, as in a script; it failed at its first step."""
    with notebook_bar("Firing", "shots") as step:
        step(1, 4, "run 1")
    assert capfd.readouterr().err == ""
