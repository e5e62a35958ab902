"""docs/explanation/architecture.md: its drawing, its arrows and its four ways are those of the code."""

from __future__ import annotations

import re
import tomllib
from collections import defaultdict
from functools import cache
from pathlib import Path

import pytest

from tools import structure

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "explanation" / "architecture.md").read_text(encoding="utf-8")
WAYS = [tuple(part.split("\n", 1)) for part in PAGE.split("\n## ") if part.startswith("From ")]
_STEP = re.compile(r"`([\w/]+\.py)`\s+\(`(\w+)`\)")


@cache
def imports() -> dict[str, set[str]]:
    """Module -> modules that it imports anywhere in it, by their paths."""
    files = structure.product_files(ROOT)
    paths = {structure._module(file.path): file.path.as_posix() for file in files}
    edges: dict[str, set[str]] = defaultdict(set)
    for file in files:
        name = structure._module(file.path)
        for target in structure._imports(name, file):
            while target and target not in paths:
                target = target.rpartition(".")[0]
            if target:
                edges[paths[name]].add(paths[target])
    return edges


def reachable(start: str) -> set[str]:
    seen, waiting = {start}, [start]
    while waiting:
        new = imports()[waiting.pop()] - seen
        seen |= new
        waiting += new
    return seen


def test_drawing_and_arrows_are_those_of_the_imports() -> None:
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
        "contracts"
    ]
    layers = next(contract["layers"] for contract in contracts if contract["type"] == "layers")
    drawing = re.search(r"```text\n(   app.*?)```", PAGE, re.DOTALL)
    assert drawing is not None
    floors = re.findall(r"^   (\w+(?: \| \w+)*)(?:  |$)", drawing[1], re.MULTILINE)
    assert floors == layers
    drawn = {room: set(targets.split()) for room, targets in re.findall(r"^(\w+) -> (.+)$", PAGE, re.MULTILINE)}
    real: dict[str, set[str]] = defaultdict(set)
    for path, targets in imports().items():
        room = path.split("/")[0]
        real[room] |= {target.split("/")[0] for target in targets if "/" in target and "/" in path} - {room}
    assert drawn == {room: targets for room, targets in real.items() if targets}
    assert len(WAYS) == 4


@pytest.mark.parametrize(("title", "text"), WAYS, ids=[title for title, _ in WAYS])
def test_way_goes_down_through_files_that_have_what_it_names(title: str, text: str) -> None:
    steps = _STEP.findall(text)
    assert len(steps) >= 8
    paths = [path for path, _ in steps]
    assert len(paths) == len(set(paths)), "a file is entered twice"
    assert set(paths) <= reachable(paths[0])
    for path, name in steps:
        assert re.search(
            rf"^(?:async )?(?:def|class) {name}\b", (ROOT / path).read_text(encoding="utf-8"), re.MULTILINE
        ), path
