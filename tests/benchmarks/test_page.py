"""The page: a row for each question, what is lost, every figure; and the picture of the ratios."""

from __future__ import annotations

from dataclasses import replace

import pytest
from pyroshock.benchmarks import __main__ as command
from pyroshock.benchmarks.figures import Figure, missing
from pyroshock.benchmarks.measuring import Spread
from pyroshock.benchmarks.page import QUICK_COMMAND, answers, page
from pyroshock.benchmarks.picture import draw, shown

SPECTRUM = Figure(
    "Spectra", "pyyeti", "3 ms", "34 ms", Spread(11.0, 9.0, 12.0), "at least", 8.0, "the recursion: 1 ms",
    near=Spread(3, 2, 4), question="a spectrum", rival="pyyeti",
)  # fmt: skip
FIGURES = [
    SPECTRUM,
    replace(SPECTRUM, name="scipy", value=Spread(9.0, 8.0, 10.0), limit=None, rival="scipy"),
    missing("Spectra", "endaq", "not installed", question="a spectrum", rival="endaq"),
    Figure("Plans", "time, SMT", "3 s", "1 s", Spread(3.0, 2.5, 3.5), question="a plan", rival="SMT"),
    Figure("Plans", "spread, SMT", "0.1", "0.2", Spread(0.5, 0.4, 0.6), question="spread", of="quality", rival="SMT"),
]


def _section(text: str, title: str) -> str:
    return text.split(f"## {title}\n")[1].split("\n## ")[0]


def test_each_question_has_one_row_with_the_strongest_peer():
    assert [(one.question, one.rival) for one in answers(FIGURES)] == [
        ("a spectrum", "scipy"),
        ("a plan", "SMT"),
        ("spread", "SMT"),
    ]
    short = _section(page(FIGURES, QUICK_COMMAND, 9), "In short")
    assert "| a spectrum | 3 ms | scipy: 34 ms | 0.111 (0.1 to 0.125) | the recursion: 1 ms | 3 (2 to 4) |" in short
    assert short.count("| a spectrum |") == 1


def test_question_whose_peers_are_all_missing_keeps_its_row():
    assert answers([FIGURES[2]]) == [FIGURES[2]]


def test_where_we_lose_is_listed():
    lost = _section(page(FIGURES, QUICK_COMMAND, 9), "Where we lose")
    assert "| Plans | time, SMT | 3 (2.5 to 3.5) **slower** | — |" in lost
    assert "pyyeti" not in lost
    broken = replace(SPECTRUM, limit=20.0)
    assert "at most 0.05: **lost**" in _section(page([broken], QUICK_COMMAND, 9), "Where we lose")
    assert "Nowhere in this run." in page([SPECTRUM], QUICK_COMMAND, 9)


def test_every_figure_stands_under_its_theme():
    text = page(FIGURES, QUICK_COMMAND, 9)
    for figure in FIGURES:
        assert figure.row() in _section(text, figure.theme)


def test_only_times_with_a_value_are_drawn_by_question():
    assert [one.rival for one in shown(FIGURES)] == ["scipy", "pyyeti", "SMT"]


@pytest.mark.parametrize("figures", [FIGURES, []], ids=["some", "none"])
def test_picture_is_written(tmp_path, figures):
    draw(figures, tmp_path / "new" / "ratios.png")
    assert (tmp_path / "new" / "ratios.png").read_bytes().startswith(b"\x89PNG")


def test_page_and_picture_lie_where_the_page_says(tmp_path):
    path = command.write(FIGURES, False, 9.0, tmp_path, tmp_path / "docs")
    assert path == tmp_path / "docs" / "measurements" / "benchmarks.md"
    assert "](../images/benchmarks.png)" in path.read_text(encoding="utf-8")
    assert (tmp_path / "docs" / "images" / "benchmarks.png").is_file()
    assert "growth" not in path.read_text(encoding="utf-8")


def test_full_size_has_a_page_of_its_own(tmp_path):
    assert command.write(FIGURES, True, 90.0, tmp_path, tmp_path).name == "benchmarks-full.md"
