"""`python -m tools.package_use`: how many files of the product import each package, as Markdown.

Files of the product are those of the packages that pyproject.toml installs: no tests, benchmarks,
tools or pages. An import inside of a function counts.
"""

from __future__ import annotations

import ast
import tomllib
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
#: Name of a distribution -> the module that is imported.
PACKAGES: Mapping[str, str] = {
    "sqlalchemy": "sqlalchemy",
    "pydantic": "pydantic",
    "pandas": "pandas",
    "mlflow": "mlflow",
    "scikit-learn": "sklearn",
    "gpytorch": "gpytorch",
    "torch": "torch",
    "scipy": "scipy",
    "pyDOE3": "pyDOE3",
    "jinja2": "jinja2",
    "plutoprint": "plutoprint",
    "pytest": "pytest",
}


def product_files(root: Path = ROOT) -> list[Path]:
    """Python files of the packages that are installed, in order."""
    setup = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["tool"][
        "setuptools"
    ]
    folders = [root.joinpath(*name.split(".")[1:]) for name in setup["packages"]]
    return sorted(path for folder in folders for path in folder.glob("*.py"))


def imported(text: str) -> set[str]:
    """Top-level modules that a Python text imports, wherever in it; imports of its own package have
    none."""
    modules = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            modules |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            modules.add(node.module.partition(".")[0])
    return modules


def importing_files(root: Path = ROOT) -> dict[str, int]:
    """Package of `PACKAGES` -> number of product files that import it."""
    counts = Counter(
        module
        for path in product_files(root)
        for module in imported(path.read_text(encoding="utf-8"))
    )
    return {package: counts[module] for package, module in PACKAGES.items()}


def main() -> None:
    print("| package | product files |\n| --- | ---: |")
    for package, count in importing_files().items():
        print(f"| {package} | {count} |")


if __name__ == "__main__":
    main()
