"""What `tools.structure`, the commit hooks and the count of packages find, on small trees of which
all is known."""

from __future__ import annotations

import ast
import re
import tomllib
from pathlib import Path

import pytest
import yaml

from tools import commits, structure
from tools.package_use import PACKAGES, imported, importing_files, product_files

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
PLATE = (
    "from ..gun import barrel\n\n\nclass Barrel:\n    pass\n\n\nclass Mode(plate.Mode):\n    pass\n"
)


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
    assert table["product files"] == "5" and table["lines"] == str(
        GUN.count("\n") + PLATE.count("\n")
    )
    assert (
        table["lines of code"] == str(7 + 5)
        and table["lines of tests"] == "1"
        and table["words of docs"] == "5"
    )
    assert table["words of README"] == "3"
    assert structure.figures(tree)["assigned locals that say nothing"] == "50.00 % (2 of 4)"
    first, second, *_ = structure.problems(tree)
    assert first.startswith("gun/barrel.py:12: 'found' says nothing")
    assert second.startswith("gun/barrel.py:12: 'each' says nothing")
    assert structure.duplicate_classes(structure.product_files(tree)) == {
        "Barrel": ["gun/barrel.py", "plate/modes.py"]
    }
    assert "class Barrel is also defined in plate/modes.py" in structure.problems(tree)[-1]
    assert structure.sibling_cycles(structure.product_files(tree)) == [
        ["pyroshock.gun", "pyroshock.plate"]
    ]


def test_functions_are_measured_without_their_decorators() -> None:
    assert structure.function_lengths(ast.parse("@decorator\ndef f():\n    return 1\n")) == [2]


def test_the_table_is_printed_and_the_lint_fails(tree: Path, monkeypatch, capsys) -> None:
    monkeypatch.setattr(structure, "ROOT", tree)
    assert structure.main([]) == 0
    rows = capsys.readouterr().out.splitlines()
    assert (
        rows[0] == "| | now |"
        and rows[-1] == "| words of README | 3 |"
        and structure.main(["--lint"]) == 1
    )


# --- what the commit hooks refuse, and that they call what there is ---
ROOT = Path(__file__).resolve().parents[2]
HOOKS = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))


def test_large_file_is_refused_and_whole_ones_let_through(tmp_path: Path) -> None:
    (tmp_path / "series.npy").write_bytes(bytes(commits.LARGEST_BYTES + 1))
    (objection,) = commits.objections(tmp_path / "series.npy")
    assert "1000001 bytes" in objection
    shipped = ROOT / "examples" / "modal-hammer-hit" / "recordings" / "acceleration.lvm"
    assert list(commits.objections(shipped)) == []
    (tmp_path / "a.md").write_text("title\n========\n")
    assert commits.main([str(tmp_path / "a.md"), str(tmp_path / "gone.py")]) == 0


@pytest.mark.parametrize("mark", ["<" * 7 + " HEAD", "=" * 7, ">" * 7 + " theirs"])
def test_half_a_merge_is_refused_with_its_line(
    tmp_path: Path, mark: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a.py").write_text(f"x = 1\n{mark}\n")
    assert commits.main([str(tmp_path / "a.py")]) == 1 and "line 2" in capsys.readouterr().err


def test_hooks_are_local_and_call_what_is_there() -> None:
    (repository,) = HOOKS["repos"]
    assert repository["repo"] == "local", "others are fetched from a network"
    targets = (ROOT / "Makefile").read_text(encoding="utf-8")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    dev = project["optional-dependencies"]["dev"]
    for hook in repository["hooks"]:
        program, *words = hook["entry"].split()
        if program == "make":
            assert f"\n{words[-1]}:" in targets
        elif words[0] == "-m":
            assert (ROOT / f"{words[1].replace('.', '/')}.py").is_file()
        else:
            assert any(requirement.startswith(Path(program).name) for requirement in dev)


# --- counts of importing files; the page has the counts of today ---
SETUP = '[tool.setuptools]\npackages = ["pyroshock", "pyroshock.training"]\n'


def test_imports_of_installed_files_count_once_as_the_page_has_them(tmp_path: Path) -> None:
    (tmp_path / "pyproject.toml").write_text(SETUP)
    for folder in ("training", "tests"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "one.py").write_text("import sklearn\n")
    (tmp_path / "top.py").write_text("import sklearn\nimport torch\n")
    counts = importing_files(tmp_path)
    assert (counts["scikit-learn"], counts["torch"], counts["gpytorch"], counts["pytest"]) == (
        2,
        1,
        0,
        0,
    )
    page = (ROOT / "docs/measurements/packages.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| \[?([\w-]+)\]?[^|]*\| (\d+) \|", page, re.MULTILINE)
    assert {package: int(count) for package, count in rows} == importing_files()
    assert set(PACKAGES) == {package for package, _ in rows}
    text = "import scipy.linalg as la\nfrom ..pandas import x\n"
    text += "def f():\n    from scipy.stats import norm\n    import torch, json\n"
    assert imported(text) == {"scipy", "torch", "json"}
    assert imported("# import mlflow\nx = 'import pandas'\n") == set()
    rooms = {path.relative_to(ROOT).parts[0] for path in product_files()}
    assert {"app", "doe", "schema", "training", "twin"} <= rooms
    assert not rooms & {"tests", "benchmarks", "tools", "docs"}
