"""A page run from top to bottom in a folder of its own, in this process: processes would import all
of it anew each."""

from __future__ import annotations

import contextlib
import io
import math
import re
import runpy
import shlex
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from pyroshock.app.doors.command_line.main import main
from pyroshock.app.jobs.worker import Worker
from pyroshock.app.server import command as cli
from pyroshock.app.twins import building as twins
from pyroshock.virtualbench.campaigns import ringing
from support.stores.registries import without_figures

from .blocks import PYTHON, Block, Statement, statements_of
from .parsing import ROOT, check

#: Of other programs, those that a page's steps are made of; the rest is not ours to run.
_FILE_PROGRAMS = frozenset({"cat", "cp", "ls", "mkdir", "mv", "printf", "rm", "sed"})
#: A store, a registry, an address of the machine that runs the tests would be taken for the page's.
_OF_THIS_MACHINE = ("PYROSHOCK_DB", "PYROSHOCK_MODELS", "PYROSHOCK_TOKEN", "MLFLOW_TRACKING_URI")


@dataclass
class Place:
    """Where a page is run. `names` is what stands for what the page calls by a name of its own:
    servers, clusters."""

    folder: Path
    patch: pytest.MonkeyPatch
    request: pytest.FixtureRequest
    open_until_the_end: contextlib.ExitStack
    names: dict[str, str] = field(default_factory=dict)
    python: dict[str, Any] = field(default_factory=lambda: {"__name__": "__main__"})

    def here(self, word: str) -> str:
        """The word with the page's names replaced."""
        for name in sorted(self.names, key=len, reverse=True):
            word = word.replace(name, self.names[name])
        return word

    def pyroshock(self, *words: str) -> str:
        """What a command of a preparation prints. Raises `AssertionError` where it fails."""
        code, said = self.invoked(list(words))
        assert code == 0, f"pyroshock {shlex.join(words)}: {said}"
        return said

    def invoked(self, words: list[str]) -> tuple[int, str]:
        """Exit code, and both streams together."""
        self.patch.setattr(sys, "argv", ["pyroshock", *words])
        result = CliRunner().invoke(main, words)
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result.exit_code, result.output


@contextlib.contextmanager
def place_in(folder: Path, request: pytest.FixtureRequest) -> Iterator[Place]:
    """An empty folder with the shipped examples, and nothing of this machine's settings.

    What would not end is ended: `serve` answers one page, `work` ends when nothing waits. Plates of
    the virtual bench have few modes, for solving for all takes ten seconds each; those of the twin
    are solved once for all pages; a training draws no pictures.
    """
    solved = request.getfixturevalue("tmp_path_factory").getbasetemp() / "solved-plates"
    for name in ("doe", "examples"):  # of the clone, what pages copy from
        (folder / name).symlink_to(ROOT / name)
    with pytest.MonkeyPatch.context() as patch, contextlib.ExitStack() as stack:
        patch.chdir(folder)
        for name in _OF_THIS_MACHINE:
            patch.delenv(name, raising=False)
        patch.syspath_prepend(ROOT)
        patch.setattr(ringing, "MAX_FREQUENCY_HZ", 500.0)
        patch.setattr(twins, "plates_folder", lambda _db: solved)
        patch.setattr(cli, "_listen", _first_page)
        run = Worker.run
        patch.setattr(Worker, "run", lambda self, once=False: run(self, once=True))
        without_figures(patch)
        yield Place(folder, patch, request, stack)


def _first_page(app: Any, settings: Any, *_: Any) -> None:
    """Ask the window for its first page, where `serve` would listen until it is stopped; it is
    refused where people sign in first."""
    from starlette.testclient import TestClient

    answer = TestClient(app, base_url="http://127.0.0.1").get("/campaigns")
    asks_first = settings.lets_in_users or settings.token is not None
    assert answer.status_code == (401 if asks_first else 200)


def run_block(block: Block, place: Place) -> None:
    """Raises `AssertionError` naming the line of the first statement that ends otherwise than the
    page says."""
    said = _python(block, place) if block.language == PYTHON else _commands(block, place)
    if block.printed is not None:
        lost = missing(block.printed, said)
        assert lost is None, (
            f"{block.page.name}, block at line {block.line}: does not print\n{lost}\nbut\n{said}"
        )


def _commands(block: Block, place: Place) -> str:
    statements = statements_of(block)
    told = []
    for statement in statements:
        if statement.program != "pyroshock":  # which says so itself, and may be meant to
            check(statement)
        code, said = _run(statement, place)
        expected = block.exit_code if statement is statements[-1] else 0
        assert code == expected, f"{statement}\nended with {code}, not {expected}: {said}"
        told.append(said)
    return "\n".join(told)


def _run(statement: Statement, place: Place) -> tuple[int, str]:
    words = [place.here(word) for word in statement.words]
    match statement.program:
        case "pyroshock":
            return place.invoked(words)
        case "make" if words == [
            "demo"
        ]:  # the recipe's one line; other targets are tests and measurements
            return place.invoked(["demo"])
        case "export":
            for name, _, value in (word.partition("=") for word in words):
                place.patch.setenv(name, value)
        case "python" | "python3" if words[0] == "-m":
            return 0, _module(words[1], words[2:], place)
        case program if program in _FILE_PROGRAMS:
            step = ["/bin/sh", "-c", statement.line]
            done = subprocess.run(
                step, cwd=place.folder, capture_output=True, text=True, check=False
            )
            return done.returncode, done.stdout + done.stderr
    return 0, ""


def _module(name: str, arguments: list[str], place: Place) -> str:
    place.patch.setattr(sys, "argv", [name, *arguments])
    place.patch.delitem(sys.modules, name, raising=False)  # runpy warns of one that is there
    told = io.StringIO()
    with contextlib.redirect_stdout(told):
        runpy.run_module(name, run_name="__main__", alter_sys=False)
    return told.getvalue()


def _python(block: Block, place: Place) -> str:
    told = io.StringIO()
    lines = "\n" * (block.line - 1) + place.here(
        block.text
    )  # a traceback names the page's own line
    with contextlib.redirect_stdout(told):
        # the page's own code
        exec(compile(lines, str(block.page), "exec"), place.python)  # noqa: S102
    return told.getvalue()


# --- what a page says that its commands print, held against what they did print ---
#: A figure of another machine may differ in its last digits.
TOLERANCE = 0.02
#: ... but a count is a count.
_COUNTS_BELOW = 1000.0
#: ... and a share is told to some percent.
_PERCENT = 3.0
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?: %)?")


def missing(shown: str, printed: str) -> str | None:
    """The first line of `shown` that `printed` has not after those before it; None where all are
    there.

    White space counts as one blank; a line that is `…` is passed over, one that ends with ` …` is
    the beginning of a line.
    """
    rest = iter(printed.splitlines())
    for line in shown.splitlines():
        wanted = " ".join(line.split())
        if wanted in ("", "…"):
            continue
        if not any(alike(wanted, " ".join(printed_line.split())) for printed_line in rest):
            return line
    return None


def alike(wanted: str, told: str) -> bool:
    if wanted.endswith("…"):
        wanted = wanted.removesuffix("…").rstrip()
        told = " ".join(told.split(" ")[: len(wanted.split(" "))])
    if _NUMBER.split(wanted) != _NUMBER.split(told):
        return False
    pairs = list(zip(_NUMBER.findall(wanted), _NUMBER.findall(told), strict=True))
    return all(a.endswith("%") == b.endswith("%") and _near(a, b) for a, b in pairs)


def _near(wanted: str, told: str) -> bool:
    if wanted.endswith("%"):
        return math.isclose(float(wanted[:-1]), float(told[:-1]), abs_tol=_PERCENT)
    a, b = float(wanted), float(told)
    mantissa, _, power = wanted.partition("e")
    _, point, decimals = mantissa.partition(".")
    if not point and abs(a) < _COUNTS_BELOW:
        return a == b
    last_digit = 10.0 ** (int(power or 0) - len(decimals))
    return math.isclose(a, b, rel_tol=TOLERANCE, abs_tol=2 * last_digit)
