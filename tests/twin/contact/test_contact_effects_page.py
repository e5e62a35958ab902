"""docs/contact-effects.md has every effect of the contact as it is."""

from __future__ import annotations

from pathlib import Path

import pytest
from pyroshock.twin.contact.effect import ContactEffect
from pyroshock.twin.contact.spread import SPREADS
from pyroshock.twin.effects import catalogue

PAGE = (Path(__file__).resolve().parents[3] / "docs" / "contact-effects.md").read_text(encoding="utf-8")
EFFECTS = {name: kind for name, kind in catalogue().items() if issubclass(kind, ContactEffect)}


@pytest.mark.parametrize("name", EFFECTS)
def test_every_parameter_has_its_row(name: str) -> None:
    rows = PAGE.split(f"| `{name}` |")[1].splitlines()
    for row, item in zip(rows, EFFECTS[name].parameters(), strict=False):
        assert (
            f"`{item.name}` | {item.unit or '1'} | {item.low:g} to {item.high:g} | {item.default:g} | {item.off:g}"
            in row
        )


@pytest.mark.parametrize("law", SPREADS)
def test_every_spread_has_its_row(law: str) -> None:
    row = next(line for line in PAGE.splitlines() if f"`{law}`" in line and "%" in line)
    assert f"{100 * SPREADS[law].force:g} % | {100 * SPREADS[law].time:g} %" in row
