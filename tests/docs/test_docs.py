"""The pages say what is there: every command, reader, check and table has a row, and the examples run."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
import sealed_table
from click.testing import CliRunner
from hammer_stores import full_campaign
from pyroshock.app.cli import serve
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
    monkeypatch.setattr(serve, "_listen", _first_page)
    known = runner.invoke(main, ["ingest", "examples/modal-hammer-hit", "small", "--db", "sqlite:///lab.db"])
    assert known.exit_code == 0, known.stderr
    for example in examples:
        result = runner.invoke(main, shlex.split(example))
        assert result.exit_code == 0, (example, result.stderr)


def _first_page(app, *_):
    """Ask the window for its first page, where `serve` would listen until it is stopped."""
    from starlette.testclient import TestClient

    assert TestClient(app, base_url="http://127.0.0.1").get("/campaigns").status_code == 200


def test_every_reader_has_a_row():
    suffixes = {suffix for reader in READERS for suffix in reader.suffixes}
    rows = set(re.findall(r"`(\.[a-z0-9]+)`", page("campaigns.md")[page("campaigns.md").index("## Readers") :]))
    assert rows == suffixes


def test_every_check_has_a_row():
    rows = set(re.findall(r"^\| `([a-z-]+)` \|", page("method.md"), re.MULTILINE))
    names = {check.__name__.removeprefix("check_").replace("_", "-") for check in CHECKS}
    assert rows == names


def test_every_table_has_a_row():
    tables = page("store.md").split("\n## ")[0]
    rows = [line.split("|")[1] for line in tables.splitlines() if line.startswith("| `")]
    assert {name for row in rows for name in re.findall(r"`(\w+)`", row)} == set(metadata.tables)


@pytest.mark.parametrize("file", [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))], ids=lambda p: p.name)
def test_links_lead_somewhere(file):
    for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", file.read_text(encoding="utf-8")):
        if not target.startswith(("http:", "https:")):
            assert (file.parent / target).exists(), target


def test_sealed_figures_are_those_of_the_kept_rows() -> None:
    rows = sealed_table.rows_of_checks()
    shown = page("diagnosis.md").splitlines()
    wanted = [*sealed_table.lines(rows), *sealed_table.of_kinds(rows)]
    missing = [line for line in wanted if line not in shown]
    assert len(rows) == 1600
    assert len(wanted) == 17
    assert missing == []
