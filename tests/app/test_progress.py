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
from pyroshock.app.common.progress import RemainingTime, notebook_bar, progress_bar
from pyroshock.parallel.phases import WHOLE, Phases

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
        time.sleep(0.1)
        step(0, 4, "run 1")
        time.sleep(0.1)
        step(1, 4, "run 2")
        time.sleep(0.2)
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


class Clock:
    """Shows the time that a test sets."""

    now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def estimates(ends_s: list[float], begin_s: float = 0.0, told_first: bool = False):
    """The estimate after each step of work whose steps end at these times."""
    clock = Clock()
    remaining, remaining_s = RemainingTime(clock), []
    clock.now_s = begin_s
    if told_first:
        remaining.step(0, len(ends_s))
    for done, end_s in enumerate(ends_s, 1):
        clock.now_s = end_s
        remaining.step(done, len(ends_s))
        remaining_s.append(remaining.estimate_s())
    return remaining_s


def test_nothing_is_said_before_a_tenth_of_the_work_is_done():
    remaining_s = estimates([float(end) for end in range(1, 41)])
    assert remaining_s[:4] == [None] * 4
    assert remaining_s[4:] == pytest.approx([40.0 - end for end in range(5, 41)])


@pytest.mark.parametrize("told_first", [False, True])
def test_a_long_begin_is_not_taken_for_the_pace_of_the_work(told_first):
    """A minute of imports and a first step of ten seconds, then a step each second."""
    remaining_s = estimates([70.0 + step for step in range(40)], 60.0, told_first)
    assert remaining_s[4:] == pytest.approx([39.0 - step for step in range(4, 40)])


def test_between_two_steps_the_estimate_falls_with_the_clock_and_then_waits():
    clock = Clock()
    remaining = RemainingTime(clock)
    estimates_s = []
    for now_s, done in ((10.0, 1), (20.0, 2), (25.0, None), (30.0, None), (60.0, None)):
        clock.now_s = now_s
        if done is not None:
            remaining.step(done, 4)
        estimates_s.append(remaining.estimate_s())
    assert estimates_s[0] is None and estimates_s[1:] == pytest.approx([20.0, 15.0, 10.0, 10.0])


def test_other_work_begins_where_fewer_steps_are_done_than_before():
    """Simulated in ten seconds each, and then read in one second each."""
    clock = Clock()
    remaining = RemainingTime(clock)
    for done in range(1, 11):
        clock.now_s = 10.0 * done
        remaining.step(done, 10)
    assert remaining.estimate_s() == 0.0
    for done in range(1, 6):
        clock.now_s = 100.0 + done
        remaining.step(done, 10)
        assert remaining.estimate_s() == (None if done == 1 else pytest.approx(10.0 - done))


def test_phases_share_one_scale_by_what_they_cost():
    told_steps = []
    phases = Phases(
        lambda *step: told_steps.append(step), {"labels": 1.0, "answers": 8.0, "score": 1.0}
    )
    for name, steps in (("labels", 2), ("answers", 4), ("score", 1)):
        step = phases.of(name)
        for done in range(1, steps + 1):
            step(done, steps, name)
    shares = [done for done, total, _ in told_steps if total == WHOLE]
    assert shares == [5, 10, 30, 50, 70, 90, 100]
    with pytest.raises(KeyError):
        phases.of("oracles")
