"""Lock files of requirements/ cover what pyproject.toml asks for, at the versions of
constraints.txt, with hashes."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
from packaging.markers import default_environment
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tools.lock import ENVIRONMENTS, FOLDER

ROOT = Path(__file__).resolve().parents[2]
PROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))[
    "project"
]
_CHANGE = "run make lock"


def _entries(name: str) -> list[str]:
    text = (FOLDER / f"{name}.txt").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if not line.startswith(("#", "-r "))]
    return re.split(r"\n(?=[A-Za-z0-9])", "\n".join(lines).strip())


def _locked(name: str) -> dict[str, str]:
    """Package -> version, of an environment with all that it adds to."""
    before = ENVIRONMENTS[name][0]
    own = {}
    for entry in _entries(name):
        requirement = Requirement(entry.partition(" \\")[0])
        own[canonicalize_name(requirement.name)] = str(requirement.specifier).removeprefix("==")
    return (_locked(before) if before else {}) | own


def _wanted(extra: str | None) -> list[Requirement]:
    texts = PROJECT["dependencies"] if extra is None else PROJECT["optional-dependencies"][extra]
    requirements: list[Requirement] = []
    for requirement in map(Requirement, texts):
        if requirement.name == PROJECT["name"]:
            requirements += [
                further for name in sorted(requirement.extras) for further in _wanted(name)
            ]
        else:
            requirements.append(requirement)
    return requirements


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_what_the_project_asks_for_is_locked(name: str) -> None:
    locked = _locked(name)
    environment = {**default_environment(), "sys_platform": "linux"}
    for requirement in _wanted(None) + _wanted(ENVIRONMENTS[name][1] or None):
        if requirement.marker is None or requirement.marker.evaluate(environment):
            package = canonicalize_name(requirement.name)
            assert package in locked, f"{package} is not locked: {_CHANGE}"
            assert requirement.specifier.contains(locked[package]), (
                f"{package}=={locked[package]}: {_CHANGE}"
            )
    assert "setuptools" in locked


@pytest.mark.parametrize("name", [*ENVIRONMENTS, "cuda", "cpu", "installer"])
def test_versions_are_those_of_the_constraints_and_every_file_has_its_hash(name: str) -> None:
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    pins = {
        canonicalize_name(line.split("==")[0]): line.split("==")[1]
        for line in lines
        if "==" in line and line[0] != "#"
    }
    for entry in _entries(name):
        head, *hashes = entry.split(" \\\n")
        requirement = Requirement(head)
        version = str(requirement.specifier).removeprefix("==").partition("+")[0]
        assert pins.get(canonicalize_name(requirement.name), version) == version, _CHANGE
        assert hashes and all(
            re.fullmatch(r"    --hash=sha256:[0-9a-f]{64}", line) for line in hashes
        ), head


def test_no_index_is_named_and_the_files_are_small() -> None:
    texts = [path.read_text(encoding="utf-8") for path in FOLDER.glob("*.txt")]
    assert sum(map(len, texts)) < 1_000_000
    assert not any("://" in text or "index-url" in text or "find-links" in text for text in texts)


def test_every_environment_of_the_makefile_is_installed_from_its_lock() -> None:
    rules = (ROOT / "Makefile").read_text(encoding="utf-8")
    for name in ENVIRONMENTS:
        assert f"$(LOCKED) requirements/{name}.txt" in rules
