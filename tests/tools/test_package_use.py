"""Counts of importing files on small made trees; the page has the counts of today."""

from __future__ import annotations

import re
from pathlib import Path

from tools.package_use import PACKAGES, ROOT, imported, importing_files, product_files

SETUP = '[tool.setuptools]\npackages = ["pyroshock", "pyroshock.training"]\n'


def test_imports_of_installed_files_count_once_as_the_page_has_them(tmp_path: Path) -> None:
    (tmp_path / "pyproject.toml").write_text(SETUP)
    for folder in ("training", "tests"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "one.py").write_text("import sklearn\n")
    (tmp_path / "top.py").write_text("import sklearn\nimport torch\n")
    counts = importing_files(tmp_path)
    assert (counts["scikit-learn"], counts["torch"], counts["gpytorch"], counts["pytest"]) == (2, 1, 0, 0)
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
