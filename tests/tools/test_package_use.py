"""Counts of importing files and of changed lines, on small made trees; the page has the counts of today."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

from tools.package_use import (
    PACKAGES,
    REST,
    ROOT,
    changed_lines,
    imported,
    importing_files,
    numstat_since,
    package_of,
    product_files,
)

SETUP = '[tool.setuptools]\npackages = ["pyroshock", "pyroshock.training"]\n'


def test_imports_anywhere_in_a_file_count_once() -> None:
    text = "import scipy.linalg as la\nfrom ..pandas import x\n"
    text += "def f():\n    from scipy.stats import norm\n    import torch, json\n"
    assert imported(text) == {"scipy", "torch", "json"}
    assert imported("# import mlflow\nx = 'import pandas'\n") == set()


def test_files_that_are_not_installed_do_not_count(tmp_path: Path) -> None:
    (tmp_path / "pyproject.toml").write_text(SETUP)
    for folder in ("training", "tests"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "one.py").write_text("import sklearn\n")
    (tmp_path / "top.py").write_text("import sklearn\nimport torch\n")
    counts = importing_files(tmp_path)
    assert (counts["scikit-learn"], counts["torch"], counts["gpytorch"], counts["pytest"]) == (2, 1, 0, 0)


def test_every_room_is_counted() -> None:
    rooms = {path.relative_to(ROOT).parts[0] for path in product_files()}
    assert {"app", "doe", "schema", "training", "twin"} <= rooms
    assert not rooms & {"tests", "benchmarks", "tools", "docs"}


def test_lines_belong_to_the_package_whose_work_the_file_does() -> None:
    totals = changed_lines(
        "10\t3\ttraining/gp/kernels.py\n0\t7\ttraining/gp/search.py\n5\t1\tapp/cli/main.py\n-\t-\tapp/a.png\n"
    )
    assert totals["gpytorch"] == (10, 10) and totals[REST] == (5, 1) and totals["torch"] == (0, 0)
    assert package_of("training/estimators/support_vectors.py") == "scikit-learn"
    assert package_of("doe/designs/pydoe.py") == "pyDOE3"
    assert package_of("training/estimators/rotated_outputs.py") == REST


def test_lines_are_those_of_the_products_python_files(tmp_path: Path) -> None:
    def git(*words: str) -> None:
        names = ("-c", "user.name=a", "-c", "user.email=a@b", "-c", "commit.gpgsign=false")
        subprocess.run(["git", *names, *words], cwd=tmp_path, check=True, capture_output=True)  # noqa: S607

    git("init", "-q")
    for content in ("a\nb\n", "a\nc\nd\n"):
        for folder in ("training/gp", "tests"):
            (tmp_path / folder).mkdir(parents=True, exist_ok=True)
            (tmp_path / folder / "one.py").write_text(content)
            (tmp_path / folder / "page.md").write_text(content)
        git("add", "-A")
        git("commit", "-qm", "one")
    assert numstat_since("HEAD~1", tmp_path) == "2\t1\ttraining/gp/one.py\n"
    with pytest.raises(subprocess.CalledProcessError):
        numstat_since("unknown", tmp_path)


def test_page_has_the_counts_of_today() -> None:
    page = (ROOT / "docs/measurements/packages.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| \[?([\w-]+)\]?[^|]*\| (\d+) \|", page, re.MULTILINE)
    assert {package: int(count) for package, count in rows} == importing_files()
    assert set(PACKAGES) == {package for package, _ in rows}
