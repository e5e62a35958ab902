"""What is expected of pyDOE3, and of whatever takes its place."""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np
import pytest
from pyroshock.doe.designs.pydoe import unit_lhs
from scipy.spatial.distance import pdist

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize(("n", "axes"), [(1, 1), (1, 4), (2, 3), (50, 6)])
def test_each_axis_has_one_point_in_each_part(n: int, axes: int) -> None:
    found = unit_lhs(n, axes, np.random.default_rng(0))
    assert np.sort(np.floor(found * n), axis=0).tolist() == [[k] * axes for k in range(n)]


def test_generator_alone_decides() -> None:
    first, again, other = (unit_lhs(20, 3, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert first.tolist() == again.tolist() != other.tolist()
    rng = np.random.default_rng(3)
    ours = np.mean([pdist(unit_lhs(30, 4, rng)).min() for _ in range(20)])
    random = np.mean([pdist(rng.random((30, 4))).min() for _ in range(20)])
    assert ours > 1.2 * random


@pytest.mark.parametrize(("n", "axes"), [(0, 3), (3, 0)])
def test_nothing_to_draw_is_refused(n: int, axes: int) -> None:
    with pytest.raises(ValueError, match="expected at least 1 of each"):
        unit_lhs(n, axes, np.random.default_rng(0))


def test_one_module_knows_the_package() -> None:
    """So that its successor can take its place."""
    sources = [path for path in (ROOT / "doe").rglob("*.py") if "pyDOE3" in _imported(path)]
    assert [path.name for path in sources] == ["pydoe.py"]


def _imported(path: Path) -> set[str]:
    nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
    plain = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    return plain | {node.module for node in nodes if isinstance(node, ast.ImportFrom) and node.module}
