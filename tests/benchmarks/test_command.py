"""The command: its themes, its exit code, and the page with a row for each question and its
picture."""

from __future__ import annotations

import ast
import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks import __main__ as command
from benchmarks.__main__ import THEMES
from benchmarks.harness import ROOT, Figure, Spread, missing
from benchmarks.page import QUICK_COMMAND, draw_ratios, drawn_figures, page, summary

#: What is asked for, by theme; memory is read where Linux shows it.
WANTED = {
    "ingest", "memory", "pulses", "series", "querying", "listings", "growth", "start-up", "library",
    "srs", "gun",
    "impacts", "coupled", "plate", "prediction", "coregional", "genetic", "designs", "diagnosing",
    "row-hashes", "serving",
}  # fmt: skip
SPECTRUM = Figure(
    "Spectra", "pyyeti", "3 ms", "34 ms", Spread(0.091, 0.08, 0.1), 1 / 8, "the recursion: 1 ms",
    Spread(3, 2, 4),
    question="a spectrum", peer_name="pyyeti",
)  # fmt: skip
PLAN = Figure(
    "Plans", "time, SMT", "3 s", "1 s", Spread(3.0, 2.5, 3.5), question="a plan", peer_name="SMT"
)
FIGURES = [
    SPECTRUM,
    replace(SPECTRUM, name="scipy", value=Spread(0.111, 0.1, 0.125), limit=None, peer_name="scipy"),
    missing("Spectra", "endaq", "not installed", question="a spectrum", peer_name="endaq"),
    PLAN,
    replace(
        PLAN, name="spread, SMT", value=Spread(0.5, 0.4, 0.6), question="spread", kind="quality"
    ),
]


def _figure(value: float, *, limit: float | None = 1.0, binding: bool = True) -> Figure:
    return Figure(
        "theme", f"figure of {value:g}", "ours", "peer", Spread.of([value]), limit, binding=binding
    )


def _section(text: str, title: str) -> str:
    return text.split(f"## {title}\n")[1].split("\n## ")[0]


def test_all_that_was_asked_for_is_registered():
    assert WANTED - {"memory"} <= set(THEMES) <= WANTED


@pytest.mark.parametrize("name", THEMES)
def test_theme_is_a_function_that_takes_its_sizes(name):
    """Read, not imported: together they import nearly everything there is."""
    theme = THEMES[name]
    tree = ast.parse((ROOT / "benchmarks" / f"{theme.module}.py").read_text(encoding="utf-8"))
    (function,) = [
        node
        for node in tree.body
        if isinstance(node, ast.FunctionDef) and node.name == theme.function
    ]
    names = [argument.arg for argument in function.args.args]
    assert {*theme.quick, *(theme.full or {})} <= set(names[1:])


def test_modules_import_each_other_without_cycles():
    """In whichever order: `graphlib` refuses a cycle."""
    import graphlib

    imports = {}
    for path in (ROOT / "benchmarks").glob("*.py"):
        names = re.findall(
            r"^\s*from \.(\w*) import (\w+)", path.read_text(encoding="utf-8"), re.MULTILINE
        )
        imports[path.stem] = {module or name for module, name in names}
    assert len(list(graphlib.TopologicalSorter(imports).static_order())) == len(imports) > 20


def test_figures_come_back_from_a_fresh_process(tmp_path, monkeypatch):
    """As they went in, an infinite ratio and a missing peer among them."""
    figures = [
        _figure(0.5),
        _figure(float("inf")),
        Figure("theme", "x", "—", "not installed", None),
    ]
    monkeypatch.setattr(command.Theme, "measure", lambda *_: iter(figures))
    answer = tmp_path / "figures.json"
    assert command.main(["--figures-of", "srs", "quick", str(tmp_path), str(answer)]) == 0
    assert [
        command.figure_from(table) for table in json.loads(answer.read_text(encoding="utf-8"))
    ] == figures


def test_unknown_theme_is_refused(capsys):
    assert command.main(["weather"]) == 2
    assert "unknown: weather; known: --full, ingest" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("figures", "code"),
    [
        ([_figure(0.5), _figure(3.0, limit=None)], 0),
        ([_figure(0.5), _figure(3.0)], 1),
        ([_figure(3.0, binding=False)], 0),
    ],
)
def test_exit_code_tells_of_lost_promises(monkeypatch, capsys, figures, code):
    monkeypatch.setattr(command, "measured", lambda *_: figures)
    monkeypatch.setattr(command, "write", lambda *_: pytest.fail("named themes write no page"))
    assert command.main(["srs"]) == code
    lost, missed = (
        any(not f.holds and f.binding is binds for f in figures) for binds in (True, False)
    )
    printed = capsys.readouterr().out
    assert ("**lost**" in printed, "**missed**" in printed) == (lost, missed)


def test_theme_that_fails_loses_a_promise_and_no_other_theme(monkeypatch, capsys):
    def fail(*_):
        raise OSError("no room")

    monkeypatch.setattr(command, "in_fresh_process", fail)
    (figure,) = command.measured("srs", False, Path())
    assert not figure.holds and figure.binding
    assert "srs: OSError('no room')" in capsys.readouterr().err


def test_each_question_has_one_row_with_the_strongest_peer():
    assert [figure.peer_name for figure in summary(FIGURES)] == ["scipy", "SMT", "SMT"]
    assert summary([FIGURES[2]]) == [FIGURES[2]]
    short = _section(page(FIGURES, QUICK_COMMAND, 9), "In short")
    assert (
        "| a spectrum | 3 ms | scipy: 34 ms | 0.111 (0.1 to 0.125) | the "
        "recursion: 1 ms | 3 (2 to 4) |" in short
    )
    assert short.count("| a spectrum |") == 1


def test_where_we_are_behind_is_listed():
    behind = _section(page(FIGURES, QUICK_COMMAND, 9), "Where we are behind")
    assert (
        "| Plans | time, SMT | 3 (2.5 to 3.5) **slower** | — |" in behind and "pyyeti" not in behind
    )
    broken = page([replace(SPECTRUM, limit=0.05)], QUICK_COMMAND, 9)
    assert "at most 0.05: **lost**" in _section(broken, "Where we are behind")
    assert "We are behind nowhere in this run." in page([SPECTRUM], QUICK_COMMAND, 9)


def test_every_figure_stands_under_its_theme():
    text = page(FIGURES, QUICK_COMMAND, 9)
    assert all(figure.row() in _section(text, figure.theme) for figure in FIGURES)


@pytest.mark.parametrize("figures", [FIGURES, []], ids=["some", "none"])
def test_picture_has_the_times_by_question(tmp_path, figures):
    assert [figure.peer_name for figure in drawn_figures(figures)] == (
        ["scipy", "pyyeti", "SMT"] if figures else []
    )
    draw_ratios(figures, tmp_path / "new" / "ratios.png")
    assert (tmp_path / "new" / "ratios.png").read_bytes().startswith(b"\x89PNG")


def test_page_and_picture_lie_where_the_page_says(tmp_path):
    path = command.write(FIGURES, False, 9.0, tmp_path, tmp_path / "docs")
    assert path == tmp_path / "docs" / "measurements" / "benchmarks.md"
    assert "](../images/benchmarks.png)" in path.read_text(encoding="utf-8")
    assert (tmp_path / "docs" / "images" / "benchmarks.png").is_file()
    assert "growth" not in path.read_text(encoding="utf-8")
    assert command.write(FIGURES, True, 90.0, tmp_path, tmp_path).name == "benchmarks-full.md"
