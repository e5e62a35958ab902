"""Every theme is there, and a run ends well exactly where all promises hold."""

from __future__ import annotations

import ast
import json
import re
from pathlib import Path

import pytest
from pyroshock.benchmarks import __main__ as command
from pyroshock.benchmarks import fresh, themes
from pyroshock.benchmarks.figures import Figure
from pyroshock.benchmarks.measuring import Spread

REPOSITORY = Path(__file__).resolve().parents[2]
#: What is asked for, by theme; memory is read where Linux shows it.
WANTED = {
    "ingest", "memory", "pulses", "series", "querying", "listings", "growth", "start-up", "library", "srs", "gun",
    "impacts", "coupled", "plate", "prediction", "coregional", "genetic", "designs", "diagnosing",
}  # fmt: skip


def _figure(value: float, *, limit: float | None = 1.0, binding: bool = True) -> Figure:
    return Figure("theme", f"figure of {value:g}", "ours", "peer", Spread.of([value]), limit=limit, binding=binding)


def test_all_that_was_asked_for_is_registered():
    assert WANTED - {"memory"} <= set(themes.THEMES) <= WANTED


def test_large_sizes_are_of_themes_that_have_a_small_one():
    assert {name.removesuffix("-postgresql") for name in themes.FULL} <= WANTED


@pytest.mark.parametrize("theme", [*themes.THEMES.values(), *themes.FULL.values()], ids=lambda one: one.args[1])
def test_theme_is_a_function_that_takes_its_sizes(theme):
    """Read, not imported: together they import nearly everything there is."""
    module, function, sizes = theme.args
    tree = ast.parse((REPOSITORY / "benchmarks" / f"{module}.py").read_text(encoding="utf-8"))
    (found,) = [node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name == function]
    names = [one.arg for one in (*found.args.args, *found.args.kwonlyargs)]
    assert set(sizes) <= set(names[1:])


def test_figures_come_back_from_a_fresh_process(tmp_path, monkeypatch):
    """As they went in, an infinite ratio and a missing peer among them."""
    figures = [_figure(0.5), _figure(float("inf")), Figure("theme", "x", "—", "not installed", None)]
    monkeypatch.setitem(themes.THEMES, "made-up", lambda _folder: iter(figures))
    fresh.main(["made-up", "quick", str(tmp_path), str(tmp_path / "figures.json")])
    tables = json.loads((tmp_path / "figures.json").read_text(encoding="utf-8"))
    assert [fresh.figure_from(table) for table in tables] == figures


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
    assert command.main(["srs"]) == code
    lost, missed = (any(not f.holds and f.binding is binds for f in figures) for binds in (True, False))
    told = capsys.readouterr().out
    assert ("**lost**" in told, "**missed**" in told) == (lost, missed)


def test_named_themes_write_no_page(monkeypatch, capsys):
    monkeypatch.setattr(command, "measured", lambda *_: [_figure(0.5)])
    monkeypatch.setattr(command, "write", lambda *_: pytest.fail("written"))
    assert command.main(["srs", "gun"]) == 0
    assert len(re.findall(r"^\| figure of 0.5 ", capsys.readouterr().out, re.MULTILINE)) == 2


def test_theme_that_fails_loses_a_promise_and_no_other_theme(monkeypatch, capsys):
    def fail(_folder):
        raise OSError("no room")

    monkeypatch.setattr(command, "in_fresh_process", lambda name, full, folder: fail(folder))
    (figure,) = command.measured("srs", False, REPOSITORY)
    assert not figure.holds and figure.binding
    assert "srs: OSError('no room')" in capsys.readouterr().err
