"""What CONTRIBUTING.md and the page on the architecture name is there, as the code has it."""

from __future__ import annotations

import re
import tomllib
from collections import defaultdict
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import pytest
from fuzzing.readers import READERS as FUZZED
from pyroshock.doe.designs.methods import METHODS
from pyroshock.ingest.readers import READERS
from pyroshock.training.models.serialization import KINDS
from support.records.recipes import RECIPES

from tools import structure

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
#: What a recipe leaves to whoever follows it.
_PLACEHOLDER = re.compile(r"NAME|STAGE|NNNN|ADDRESS|FEATURE")
QUOTED = re.findall(r"`([^`\n]+)`", re.sub(r"```.*?```", "", PAGE, flags=re.DOTALL))
FILES = sorted(
    {word for word in QUOTED if re.fullmatch(r"[\w./-]+\.(py|md|toml|txt)", word) and "/" in word}
)


def source(path: str) -> str:
    return (ROOT / path).read_text(encoding="utf-8")


@pytest.mark.parametrize("path", FILES)
def test_files_are_there(path: str) -> None:
    whole = _PLACEHOLDER.search(path) is None
    known = ROOT / path if whole else ROOT / _PLACEHOLDER.split(path)[0].rpartition("/")[0]
    assert known.is_file() if whole else known.is_dir()


def test_make_targets_are_there_and_enough_files_are_named() -> None:
    assert len(FILES) > 45
    named = set(re.findall(r"`make ([a-z-]+)", PAGE)) | set(
        re.findall(r"^make ([a-z-]+)", PAGE, re.MULTILINE)
    )
    targets = set(re.findall(r"^([a-z-]+):", source("Makefile"), re.MULTILINE))
    assert {"setup", "check", "coverage"} <= named <= targets


PAIRS = [
    *re.findall(r"`([\w./-]+\.py)` \(`(\w+)`\)", PAGE),
    *((path, name) for name, path in re.findall(r"`(\w+)`\s+(?:of|in)\s+`([\w./-]+\.py)`", PAGE)),
]


@pytest.mark.parametrize(("path", "name"), PAIRS)
def test_names_stand_in_their_files(path: str, name: str) -> None:
    assert re.search(rf"^\s*(def|class) {name}\b|^{name}\b.*=", source(path), re.MULTILINE)


# --- lists that a recipe has one write into ---
def test_every_reader_has_a_recipe_and_is_fuzzed() -> None:
    written = {suffix for suffix, _ in RECIPES.values()}
    fuzzed = {
        target.name.split()[0].replace("mat5", "mat").replace("mat73", "mat") for target in FUZZED
    }
    absent = (
        set() if find_spec("idelib") else {"ide"}
    )  # whose files the library that reads them writes
    for reader in READERS:
        if reader.format in absent:
            continue
        assert written & set(reader.suffixes), f"{reader.format}: no recipe in recipes.py"
        assert reader.format in fuzzed, f"{reader.format}: no target in fuzzing/readers.py"


def test_every_estimator_is_held_to_the_promises_of_all_and_every_design_has_a_command() -> None:
    suites = [
        path.read_text(encoding="utf-8")
        for path in (ROOT / "tests/training/estimators").glob("test_*.py")
    ]
    listed = [text for text in suites if "estimator_checks" in text]
    for kind, (module, name) in KINDS.items():
        if module.startswith("estimators."):
            assert any(f"{name}(" in text for text in listed), (
                f"{kind}: {name} is in no list of members"
            )
    from click import Context
    from pyroshock.app.doors.command_line.operation_group import OperationGroup

    plan = OperationGroup("plan")
    for method in METHODS:
        assert plan.get_command(Context(plan), method) is not None


# --- docs/explanation/architecture.md: its drawing, its arrows and its four ways ---
ARCHITECTURE = (ROOT / "docs" / "explanation" / "architecture.md").read_text(encoding="utf-8")
WAYS = [
    tuple(part.split("\n", 1)) for part in ARCHITECTURE.split("\n## ") if part.startswith("From ")
]
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
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"][
        "importlinter"
    ]["contracts"]
    layers = next(contract["layers"] for contract in contracts if contract["type"] == "layers")
    drawing = re.search(r"```text\n(   app.*?)```", ARCHITECTURE, re.DOTALL)
    assert (
        drawing is not None
        and re.findall(r"^   (\w+(?: \| \w+)*)(?:  |$)", drawing[1], re.MULTILINE) == layers
    )
    drawn = {
        room: set(targets.split())
        for room, targets in re.findall(r"^(\w+) -> (.+)$", ARCHITECTURE, re.MULTILINE)
    }
    real: dict[str, set[str]] = defaultdict(set)
    for path, targets in imports().items():
        room = path.split("/")[0]
        real[room] |= {
            target.split("/")[0] for target in targets if "/" in target and "/" in path
        } - {room}
    assert drawn == {room: targets for room, targets in real.items() if targets} and len(WAYS) == 4


@pytest.mark.parametrize(("title", "text"), WAYS, ids=[title for title, _ in WAYS])
def test_way_goes_down_through_files_that_have_what_it_names(title: str, text: str) -> None:
    steps = _STEP.findall(text)
    assert len(steps) >= 8
    paths = [path for path, _ in steps]
    assert len(paths) == len(set(paths)), "a file is entered twice"
    assert set(paths) <= reachable(paths[0])
    for path, name in steps:
        assert re.search(
            rf"^(?:async )?(?:def|class) {name}\b",
            (ROOT / path).read_text(encoding="utf-8"),
            re.MULTILINE,
        ), path
