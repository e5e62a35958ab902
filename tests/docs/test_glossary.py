"""The glossary explains each term once, and every name in it leads to code."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

import pytest

GLOSSARY = Path(__file__).resolve().parents[2] / "docs" / "reference" / "glossary.md"
COLUMNS = ["term", "meaning", "symbol", "unit", "in the code"]


def table_lines() -> list[list[str]]:
    """Cells of every line of the glossary's tables, headings included."""
    lines = GLOSSARY.read_text(encoding="utf-8").splitlines()
    return [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in lines
        if line.startswith("|") and not line.startswith("| ---")
    ]


ROWS = [cells for cells in table_lines() if cells[0] != "term"]


def resolve(name: str) -> object:
    """The module, function, class or attribute with this dotted name. Raises `AttributeError` where there is none."""
    parts = name.split(".")
    for length in range(len(parts), 0, -1):
        module_name = ".".join(parts[:length])
        try:
            target: object = importlib.import_module(module_name)
        except ModuleNotFoundError as error:
            if error.name is None or not f"{module_name}.".startswith(f"{error.name}."):
                raise  # the module is there; what it imports is not
            continue
        for part in parts[length:]:
            target = getattr(target, part) if hasattr(target, part) else _annotated(target, part, name)
        return target
    raise AttributeError(name)


def _annotated(owner: object, field: str, name: str) -> object:
    """A field of a class that has an annotation and no default."""
    if field not in getattr(owner, "__annotations__", {}):
        raise AttributeError(name)
    return owner.__annotations__[field]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0])
def test_name_of_a_term_leads_to_code(row: list[str]) -> None:
    names = re.findall(r"`([\w.]+)`", row[-1])
    assert names
    for name in names:
        assert name.split(".")[0] == "pyroshock"
        assert not any(part.startswith("_") for part in name.split("."))
        resolve(name)


@pytest.mark.parametrize("name", ["pyroshock.no_such_module", "pyroshock.twin.chain.Twin.no_such_method"])
def test_wrong_name_is_noticed(name: str) -> None:
    with pytest.raises(AttributeError):
        resolve(name)


def test_every_term_stands_once_with_all_columns() -> None:
    terms = [row[0].lower() for row in ROWS]
    assert len(terms) >= 60
    assert sorted(terms) == sorted(set(terms))
    assert [cells for cells in table_lines() if cells[0] == "term"] == [COLUMNS] * 6
    assert [row[0] for row in ROWS if len(row) != len(COLUMNS) or not all(row)] == []
