"""docs/explanation/contact-effects.md says the spreads as they are."""

from __future__ import annotations

from pathlib import Path

import pytest
from pyroshock.twin.contact.stage import SPREADS

PAGE = (Path(__file__).resolve().parents[3] / "docs" / "explanation" / "contact-effects.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("law", SPREADS)
def test_every_spread_has_its_row(law: str) -> None:
    row = next(line for line in PAGE.splitlines() if f"`{law}`" in line and "%" in line)
    assert f"{100 * SPREADS[law].force:g} % | {100 * SPREADS[law].time:g} %" in row
