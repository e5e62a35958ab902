"""The pages say what is there: every command, reader, check and table has a row, and the examples run."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner
from hammer_stores import full_campaign
from pyroshock.app.cli.main import COMMANDS, main
from pyroshock.ingest.quality import CHECKS
from pyroshock.ingest.readers import READERS
from pyroshock.schema.tables import metadata
from registries import fresh_registry, without_figures

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"


def page(name: str) -> str:
    return (DOCS / name).read_text(encoding="utf-8")


def test_every_command_has_a_row():
    rows = re.findall(r"^\| `([a-z-]+)` \|", page("commands.md"), re.MULTILINE)
    assert rows == list(COMMANDS)


def test_examples_of_the_commands_run(tmp_path, monkeypatch, coarse_plates):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    examples = re.findall(r"\| `pyroshock ([^`]+)` \|$", page("commands.md"), re.MULTILINE)
    assert len(examples) == len(COMMANDS)
    runner = CliRunner()
    full_campaign(tmp_path / "small", "small")
    fresh_registry(tmp_path)
    without_figures(monkeypatch)
    known = runner.invoke(main, ["ingest", "examples/modal-hammer-hit", "small", "--db", "sqlite:///lab.db"])
    assert known.exit_code == 0, known.stderr
    for example in examples:
        result = runner.invoke(main, shlex.split(example))
        assert result.exit_code == 0, (example, result.stderr)


def test_every_reader_has_a_row():
    suffixes = {suffix for reader in READERS for suffix in reader.suffixes}
    rows = set(re.findall(r"`(\.[a-z0-9]+)`", page("campaigns.md")[page("campaigns.md").index("## Readers") :]))
    assert rows == suffixes


def test_every_check_has_a_row():
    rows = set(re.findall(r"^\| `([a-z-]+)` \|", page("method.md"), re.MULTILINE))
    names = {check.__name__.removeprefix("check_").replace("_", "-") for check in CHECKS}
    assert rows == names


def test_every_table_has_a_row():
    rows = [line.split("|")[1] for line in page("store.md").splitlines() if line.startswith("| `")]
    assert {name for row in rows for name in re.findall(r"`(\w+)`", row)} == set(metadata.tables)


@pytest.mark.parametrize("file", [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))], ids=lambda p: p.name)
def test_links_lead_somewhere(file):
    for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", file.read_text(encoding="utf-8")):
        if not target.startswith(("http:", "https:")):
            assert (file.parent / target).exists(), target
