"""The table of benches in the documentation is that of the rows that are kept."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.records.before_table import FOLDER, NOW, lines

PAGE = Path(FOLDER).parents[1] / "explanation" / "diagnosis.md"


@pytest.mark.parametrize("folder", [FOLDER, NOW], ids=["before", "now"])
def test_table_is_that_of_the_kept_rows(folder: Path) -> None:
    text = PAGE.read_text(encoding="utf-8")
    table = list(lines(folder))
    assert table
    assert [line for line in table if line not in text] == []
