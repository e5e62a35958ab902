"""The table of docs/measurements/blind-check.md is that of the kept answers."""

from __future__ import annotations

from pyroshock.validation.case_plan import BENCHES
from support.records.blind_check_table import FOLDER, lines

PAGE = FOLDER.parents[1] / "measurements" / "blind-check.md"


def shown_rows() -> list[str]:
    """Rows below the head that begins with `| tier, kind |`."""
    table = PAGE.read_text(encoding="utf-8").split("| tier, kind |")[1].split("\n\n")[0]
    return table.splitlines()[2:]


def test_shown_rows_are_those_of_the_kept_answers() -> None:
    computed = list(lines())
    assert [row for row in shown_rows() if row not in computed] == []


def test_every_tier_has_a_row() -> None:
    names = {row.split("|")[1].strip() for row in shown_rows()}
    assert names >= set(BENCHES)
