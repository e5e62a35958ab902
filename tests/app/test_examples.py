"""The examples of every command's help run as they stand, in a folder where `pyroshock demo` was
called."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import signal
import subprocess
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import click
import pytest
from support.records.verdicts import verdict
from support.stores.stores import CLI, opened, pyroshock, run_pyroshock

from tools.reference.blocks import blocks_of
from tools.reference.commands import commands

REPOSITORY = Path(__file__).resolve().parents[2]
#: Commands whose examples are not run, with the reason.
NOT_RUN = {
    "pyroshock": "its lines are those of `demo`, `ingest` and `impacts`",
    "pyroshock demo": "it takes minutes; tests/app/test_demo.py runs it",
    "pyroshock serve": "it serves until it is stopped; the test below runs it",
    "pyroshock db roles": "it needs PostgreSQL; tests/schema/access run it",
}
#: Commands whose answer may be no: exit code 1.
CHECKS = ("validate", "promote", "tune")
#: What makes the work of an example small; of an option that is given twice the last one counts.
SMALLER = {"blind-check": ("--cases", "1", "--no-baselines", "--no-shrinkage")}
#: Starting a server imports much, on a machine that may be busy.
PATIENCE_S = 60.0
COMMANDS = [(context.command_path, command) for context, command in commands()]


def example_lines(text: str) -> list[str]:
    """The lines below `Example:`, those that end with a backslash joined with the next."""
    blocks = blocks_of(text)
    titles = [number for number, block in enumerate(blocks) if block.text.strip() == "Example:"]
    code = "\n".join(blocks[number + 1].text for number in titles)
    return [line.strip() for line in code.replace("\\\n", " ").splitlines() if line.strip()]


@pytest.fixture(scope="session")
def demo_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the demo leaves, with the names that it gives; its plates have few modes, and its
    diagnosis is made up."""
    from pyroshock.app.demo.virtual_campaign import CHANGED, fire_campaign
    from pyroshock.app.jobs.known_kinds import KINDS
    from pyroshock.app.jobs.queue import ask
    from pyroshock.app.operations.diagnose.diagnosing import keep
    from pyroshock.app.operations.ingest.extract import Extraction
    from pyroshock.virtualbench.campaigns import ringing
    from support.stores.registries import without_figures

    place = tmp_path_factory.mktemp("examples")
    out, url = place / "results", f"sqlite:///{place / 'results' / 'demo.db'}"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ringing, "MAX_FREQUENCY_HZ", 500.0)
        without_figures(patch)
        patch.delenv("MLFLOW_TRACKING_URI", raising=False)
        run_pyroshock("demo", "--out", out, "--chapters", "3")
        with opened(url) as store:
            fire_campaign(store, CHANGED, out / CHANGED.name, lambda *_: None)
            keep(store, verdict(campaign=CHANGED.name))
            ask(store, KINDS["extract"], "Extraction", Extraction(campaign=CHANGED.name))
    return place


@pytest.fixture
def working_folder(
    demo_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Path]:
    """A copy of the stores, the current folder; recordings are only read."""
    from pyroshock.app.twins import building
    from support.records.twin_parts import unsolved

    results = tmp_path / "results"
    results.mkdir()
    for path in (demo_folder / "results").iterdir():
        if path.is_file():
            shutil.copy2(path, results)
        elif path.name.endswith("-models"):
            shutil.copytree(path, results / path.name)
        else:
            (results / path.name).symlink_to(path)
    (tmp_path / "examples").symlink_to(REPOSITORY / "examples")
    _correct_tip_radius(REPOSITORY / "examples" / "rehearsal", tmp_path / "corrected")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYROSHOCK_DB", "sqlite:///results/demo.db")
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    monkeypatch.setattr(building, "solved", unsolved)
    yield tmp_path
    os.chdir(REPOSITORY)


def _correct_tip_radius(campaign: Path, corrected: Path) -> None:
    """The campaign's folder with another tip radius in run 8, as `runs replace` reads it."""
    corrected.mkdir()
    shutil.copytree(campaign / "recordings", corrected / "recordings")
    shutil.copy2(campaign / "campaign.toml", corrected)
    header, *rows = (campaign / "runs.csv").read_text(encoding="utf-8").splitlines()
    column = header.split(",").index("tip_radius_mm")
    lines = [row.split(",") for row in rows]
    for cells in lines:
        if cells[0] == "8":
            cells[column] = "45"
    text = "\n".join([header, *(",".join(cells) for cells in lines)])
    (corrected / "runs.csv").write_text(f"{text}\n", encoding="utf-8")


def test_every_command_has_an_example_and_a_help_of_whole_sentences():
    without = [path for path, command in COMMANDS if not example_lines(command.help or "")]
    assert without == []
    listed = [
        text
        for _, command in COMMANDS
        for text in [command.get_short_help_str(1000)]
        if "..." in text
    ]
    assert listed == [] and set(NOT_RUN) <= {path for path, _ in COMMANDS}


@pytest.mark.parametrize("path", [path for path, _ in COMMANDS])
def test_help_has_whole_sentences_within_80_columns(path: str):
    """Examples are whole lines, which a person copies; all else is wrapped, and nothing is
    shortened."""
    command = dict(COMMANDS)[path]
    lines = command.get_help(click.Context(command, info_name=path, terminal_width=80)).splitlines()
    examples = {line.strip() for line in (command.help or "").splitlines()}
    assert [line for line in lines if len(line) > 80 and line.strip() not in examples] == []
    assert [line for line in lines if line.endswith("...") and not line.startswith("Usage:")] == []
    words = [
        option.help or ""
        for option in command.params
        if isinstance(option, click.Option) and not option.hidden
    ]
    texts = [re.sub(r"\s*\[default: [^]]*\]$", "", text) for text in words]
    assert [text for text in texts if not re.fullmatch(r"[A-Z].*\.", text)] == []
    paragraphs = [block.text for block in blocks_of(command.help or "") if block.kind == "text"]
    assert [text for text in paragraphs if not re.fullmatch(r"[A-Z`].*[.:]", text)] == []


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_example_of_serve_answers_until_it_is_terminated(
    working_folder: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("BROWSER", "true")  # the program that opens the page: one that does nothing
    (line,) = example_lines(dict(COMMANDS)["pyroshock serve"].help or "")
    words = [*CLI, *shlex.split(line)[1:], "--port", "0"]
    with subprocess.Popen(words, stderr=subprocess.PIPE, text=True, cwd=working_folder) as server:
        try:
            assert server.stderr is not None
            address = server.stderr.readline().removeprefix("pyroshock: ").strip()
            with urllib.request.urlopen(address, timeout=PATIENCE_S) as answer:
                assert "rehearsal" in answer.read().decode()
            server.send_signal(signal.SIGTERM)
            assert server.wait(PATIENCE_S) in (0, -signal.SIGTERM)
        finally:
            server.kill()


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("path", [path for path, _ in COMMANDS if path not in NOT_RUN])
def test_examples_run_in_a_fresh_demo_store(path: str, working_folder: Path):
    for line in example_lines(dict(COMMANDS)[path].help or ""):
        program, *words = shlex.split(line)
        assert program == "pyroshock", line
        result = pyroshock(*words, *SMALLER.get(words[0], ()))
        allowed = (0, 1) if words[0] in CHECKS else (0,)
        assert result.exit_code in allowed, f"{line}\n{result.output}{result.stderr}"
