"""Tables of the thesis and ids of effects that tests use are those of the exchange folder, where that is there."""

from __future__ import annotations

import re
from pathlib import Path


def test_tables_and_effects_are_those_of_the_exchange_folder(thesis_tables: Path, shared: Path, effect_ids: list[str]):
    ours = {path.name: path.read_text(encoding="utf-8") for path in thesis_tables.glob("*.csv")}
    assert ours == {path.name: path.read_text(encoding="utf-8") for path in (shared / "reference").glob("*.csv")}
    text = (shared / "effects.md").read_text(encoding="utf-8")
    assert effect_ids == re.findall(r"^\| `([a-z_.]+)` \|", text, re.MULTILINE)
