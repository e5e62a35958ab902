"""`python -m tools.package_use [--since COMMIT]`: how many files of the product import each package, as Markdown.

Files of the product are those of the packages that pyproject.toml installs: no tests, benchmarks, tools or pages. An
import inside of a function counts. With `--since`, the lines of those files that were added and removed since that
commit, by the package whose work the files of `MOVED` do.
"""

from __future__ import annotations

import ast
import subprocess
import sys
import tomllib
from collections import Counter
from collections.abc import Mapping, Sequence
from fnmatch import fnmatch
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
#: Name of a distribution -> the module that is imported.
PACKAGES: Mapping[str, str] = {
    "sqlalchemy": "sqlalchemy",
    "pandas": "pandas",
    "mlflow": "mlflow",
    "scikit-learn": "sklearn",
    "gpytorch": "gpytorch",
    "torch": "torch",
    "scipy": "scipy",
    "pyDOE3": "pyDOE3",
    "pytest": "pytest",
}
#: Package -> files, of now or before, that do its work; no file has two.
MOVED: Mapping[str, Sequence[str]] = {
    "mlflow": ("training/registry/*.py", "training/registry/logged.py", "training/registry/loading.py"),
    "scikit-learn": (
        *(
            f"training/estimators/{name}.py"
            for name in ("ensemble", "expansion", "kernel_ridge", "leaf_spread", "linear", "nodes", "pls")
        ),
        *(f"training/estimators/{name}.py" for name in ("scikit_pipeline", "skops_file", "svr", "svr_kernel", "tree")),
        "training/tuning/folds.py",
    ),
    "gpytorch": (
        "training/gp/*.py",
        *(
            f"training/estimators/{name}.py"
            for name in (
                "contact_time",
                "coregional",
                "exact_process",
                "input_kernel",
                "gp_inputs",
                "single_outputs",
            )
        ),
    ),
    "torch": (
        *(f"training/estimators/{name}.py" for name in ("genetic_network", "network", "mlp")),
        "training/tuning/genetic.py",
        "training/tuning/quasi_newton.py",
    ),
    "pyDOE3": ("doe/designs/*.py", "doe/merit/*.py"),
}
REST = "all other files"


def product_files(root: Path = ROOT) -> list[Path]:
    """Python files of the packages that are installed, in order."""
    setup = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]
    folders = [root.joinpath(*name.split(".")[1:]) for name in setup["packages"]]
    return sorted(path for folder in folders for path in folder.glob("*.py"))


def imported(text: str) -> set[str]:
    """Top-level modules that a Python text imports, wherever in it; imports of its own package have none."""
    modules = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            modules |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            modules.add(node.module.partition(".")[0])
    return modules


def importing_files(root: Path = ROOT) -> dict[str, int]:
    """Package of `PACKAGES` -> number of product files that import it."""
    counts = Counter(module for path in product_files(root) for module in imported(path.read_text(encoding="utf-8")))
    return {package: counts[module] for package, module in PACKAGES.items()}


def package_of(file: str) -> str:
    """The package of `MOVED` whose work a file does, its path as git writes it; `REST` where there is none."""
    found = (package for package, patterns in MOVED.items() if any(fnmatch(file, pattern) for pattern in patterns))
    return next(found, REST)


def changed_lines(numstat: str) -> dict[str, tuple[int, int]]:
    """Package or `REST` -> lines added and removed, of what `git diff --numstat` prints; binary files do not count."""
    totals: dict[str, tuple[int, int]] = dict.fromkeys((*MOVED, REST), (0, 0))
    for line in numstat.splitlines():
        added, removed, file = line.split("\t")
        if added != "-":
            package = package_of(file)
            totals[package] = (totals[package][0] + int(added), totals[package][1] + int(removed))
    return totals


def numstat_since(commit: str, root: Path = ROOT) -> str:
    """Of the product's Python files as they are committed. Raises `CalledProcessError` for an unknown commit."""
    outside = ("tests", "benchmarks", "docs", "tools", "examples", "deploy")
    paths = ["*.py", *(f":!{folder}" for folder in outside)]
    command = ["git", "diff", "--numstat", "--no-renames", f"{commit}..HEAD", "--", *paths]
    return subprocess.run(command, cwd=root, capture_output=True, text=True, check=True).stdout


def main(arguments: Sequence[str]) -> None:
    print("| package | product files |\n| --- | ---: |")
    for package, count in importing_files().items():
        print(f"| {package} | {count} |")
    if arguments[:1] == ["--since"]:
        print("\n| files that do the work of | lines added | removed |\n| --- | ---: | ---: |")
        totals = changed_lines(numstat_since(arguments[1]))
        for package, (added, removed) in totals.items():
            print(f"| {package} | {added:,} | {removed:,} |")
        added, removed = (sum(pair[which] for pair in totals.values()) for which in (0, 1))
        print(f"| the product | {added:,} | {removed:,} |")


if __name__ == "__main__":
    main(sys.argv[1:])
