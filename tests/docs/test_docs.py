"""The pages say what is there: every command, reader, check and table has a row, and the examples run."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from doc_pages.running import place_in
from pyroshock.app.cli.main import COMMANDS
from pyroshock.schema.tables import metadata
from support.stores.hammer_stores import full_campaign
from support.stores.registries import fresh_registry

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"


def page(name: str) -> str:
    return (DOCS / name).read_text(encoding="utf-8")


def test_every_command_and_every_table_has_a_row():
    rows = re.findall(r"^\| `([a-z-]+)` \|", page("reference/command-overview.md"), re.MULTILINE)
    assert rows == list(COMMANDS)
    tables = page("reference/store.md").split("\n## ")[0]
    rows = [line.split("|")[1] for line in tables.splitlines() if line.startswith("| `")]
    assert {name for row in rows for name in re.findall(r"`(\w+)`", row)} == set(metadata.tables)


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_examples_of_the_commands_run(tmp_path, request):
    examples = re.findall(r"\| `pyroshock ([^`]+)` \|$", page("reference/command-overview.md"), re.MULTILINE)
    assert len(examples) == len(COMMANDS)
    with place_in(tmp_path, request) as place:
        full_campaign(tmp_path / "small", "small")
        fresh_registry(tmp_path)
        place.pyroshock("ingest", "examples/modal-hammer-hit", "small", "--db", "sqlite:///lab.db")
        for example in examples:
            code, said = place.invoked(shlex.split(example))
            # The shipped specification is softer than what the shipped bench gives at its least pressure.
            assert code == (1 if example.startswith("tune") else 0), f"pyroshock {example}: {said}"
