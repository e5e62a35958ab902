"""Every equation of the thesis has its page and its code; what the code cites is among them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
#: How many numbered equations each chapter has.
CHAPTERS = {1: 28, 2: 18, 3: 1, 4: 9, 5: 7}
EQUATIONS = [f"{chapter}.{number}" for chapter, last in CHAPTERS.items() for number in range(1, last + 1)]
ROOMS = ("dataset", "diagnosis", "doe", "ingest", "training", "twin")
_CITED = re.compile(r"[Tt]hesis,? eq\. [\d., to-]+")


def rows() -> list[tuple[set[str], list[str], list[str]]]:
    """Of the table in deviations.md: equations, pages, files."""
    text = (
        (DOCS / "explanation" / "deviations.md").read_text(encoding="utf-8").split("## Where each equation stands")[1]
    )
    cells = [line.strip("|").split("|") for line in text.splitlines() if re.match(r"\| \d", line)]
    return [
        (numbers(first), re.findall(r"\]\(([\w./-]+)(?:#[\w.-]*)?\)", pages), re.findall(r"`([\w/.]+)`", files))
        for first, pages, files in cells
    ]


def numbers(text: str) -> set[str]:
    """`1.4 to 1.8` and `2.7, 2.8` as each of them."""
    found = set()
    for first, last in re.findall(r"(\d\.\d+)(?: (?:to|-) (\d\.\d+))?", text):
        chapter, begin = first.split(".")
        end = int(last.split(".")[1]) if last else int(begin)
        found |= {f"{chapter}.{number}" for number in range(int(begin), end + 1)}
    return found


def test_each_equation_has_a_row() -> None:
    assert set().union(*(equations for equations, _, _ in rows())) == set(EQUATIONS)


@pytest.mark.parametrize(("equations", "pages", "files"), rows(), ids=lambda value: " ".join(sorted(value)))
def test_row_leads_to_pages_that_have_it_and_code_that_names_some(
    equations: set[str], pages: list[str], files: list[str]
) -> None:
    shown = set().union(*(mentioned(DOCS / "explanation" / page) for page in pages))
    assert sorted(equations - shown) == []
    assert all((ROOT / file).is_file() for file in files)
    assert any(equations & mentioned(ROOT / file) for file in files)


@pytest.mark.parametrize("room", ROOMS)
def test_code_cites_equations_that_the_thesis_has(room: str) -> None:
    for file in sorted((ROOT / room).rglob("*.py")):
        cited = numbers(" ".join(_CITED.findall(file.read_text(encoding="utf-8"))))
        assert cited <= set(EQUATIONS), file


def mentioned(file: Path) -> set[str]:
    """Equations that a file names: in a cell of a table, or after `eq.`."""
    text = file.read_text(encoding="utf-8")
    return numbers(" ".join(re.findall(r"(?:[Ee]qs?\.|[Ee]quation|\|)[^|\n]*", text)))
