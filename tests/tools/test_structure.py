"""What `tools.structure` counts, on a small tree of which everything is known."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from tools import structure

PROJECT = """
[tool.setuptools]
packages = ["pyroshock", "pyroshock.gun", "pyroshock.plate", "pyroshock.plate.modes"]
"""
GUN = '''"""A gun."""

from ..plate import modes


class Barrel:
    """A tube."""


def velocity(shots):
    """In m/s."""
    found = [each.speed for each in shots]  # a comment
    for shot in found:
        # a reason
        speed = shot
    return speed
'''
PLATE = "from ..gun import barrel\n\n\nclass Barrel:\n    pass\n\n\nclass Mode(plate.Mode):\n    pass\n"


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    contents = {
        "pyproject.toml": PROJECT,
        "__init__.py": "",
        "gun/__init__.py": "",
        "gun/barrel.py": GUN,
        "plate/__init__.py": "",
        "plate/modes.py": PLATE,
        "docs/explanation/plate.md": "# A plate\n\nTwo words.\n\n```python\nnot = prose\n```\n",
        "docs/reference/plate.md": "<!-- generated: plate -->\n",
        "README.md": "Read me now.\n",
        "tests/test_gun.py": "found = 1\n",
    }
    for name, text in contents.items():
        (tmp_path / name).parent.mkdir(exist_ok=True, parents=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def test_tree_is_counted_and_its_faults_named(tree: Path) -> None:
    table = structure.figures(tree)
    assert table["product files"] == "5" and table["lines"] == str(GUN.count("\n") + PLATE.count("\n"))
    assert table["lines of code"] == str(7 + 5) and table["lines of tests"] == "1" and table["words of docs"] == "5"
    assert table["words of README"] == "3"
    assert structure.figures(tree)["assigned locals that say nothing"] == "50.00 % (2 of 4)"
    first, second, *_ = structure.problems(tree)
    assert first.startswith("gun/barrel.py:12: 'found' says nothing")
    assert second.startswith("gun/barrel.py:12: 'each' says nothing")
    assert structure.duplicate_classes(structure.product_files(tree)) == {"Barrel": ["gun/barrel.py", "plate/modes.py"]}
    assert "class Barrel is also defined in plate/modes.py" in structure.problems(tree)[-1]
    assert structure.sibling_cycles(structure.product_files(tree)) == [["pyroshock.gun", "pyroshock.plate"]]


def test_functions_are_measured_without_their_decorators() -> None:
    tree = ast.parse("@decorator\ndef f():\n    return 1\n")
    assert structure.function_lengths(tree) == [2]


def test_the_table_is_printed_and_the_lint_fails(tree: Path, monkeypatch, capsys) -> None:
    monkeypatch.setattr(structure, "ROOT", tree)
    assert structure.main([]) == 0
    rows = capsys.readouterr().out.splitlines()
    assert rows[0] == "| | now |" and rows[-1] == "| words of README | 3 |" and structure.main(["--lint"]) == 1
