"""Whoever makes a figure makes data: plotting libraries are called where figures are rendered."""

from __future__ import annotations

import ast
from pathlib import Path

from pyroshock.tools.structure import product_files

ROOT = Path(__file__).resolve().parents[3]
LIBRARIES = {"matplotlib", "plotly"}
#: Files beside the renderer, and why.
ALLOWED = {
    "app/documents/pdf_fonts.py": "takes the files of the fonts that matplotlib brings",
    "app/figures/inline_svg.py": "the renderer at the size of a report, with the page's colours",
    "app/figures/matplotlib_renderer.py": "the renderer",
}


def imported(tree: ast.Module) -> set[str]:
    """Packages that a file imports when it runs; types alone are left out."""
    packages = set()
    typing_only = {
        node
        for block in ast.walk(tree)
        if isinstance(block, ast.If) and getattr(block.test, "id", "") == "TYPE_CHECKING"
        for node in ast.walk(block)
    }
    for node in ast.walk(tree):
        if node in typing_only:
            continue
        if isinstance(node, ast.Import):
            packages |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            packages.add((node.module or "").partition(".")[0])
    return packages


def test_only_the_renderer_calls_a_plotting_library() -> None:
    callers = {
        str(file.path)
        for file in product_files(ROOT)
        if any(name in file.text for name in LIBRARIES) and imported(file.tree) & LIBRARIES
    }
    assert callers == ALLOWED.keys()
