"""plan.toml: which modules are mutated, by which operators, against which tests."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

PLAN = Path(__file__).with_name("plan.toml")


@dataclass(frozen=True)
class Target:
    """A module, the files of tests that it is held to in their order, and how many mutants are
    drawn (None: all)."""

    module: str
    tests: tuple[str, ...]
    sample: int | None
    but: tuple[str, ...] = ()  # tests that take no part

    @property
    def words(self) -> list[str]:
        """For pytest."""
        return [*self.tests, *(word for test in self.but for word in ("--deselect", test))]


@dataclass(frozen=True)
class Plan:
    """`warm`: libraries, `warm_own`: modules of ours, that are loaded once; `targets` in the order
    of the file."""

    seed: int
    operators: tuple[str, ...]
    chosen_arguments: tuple[str, ...]  # that are not mutated
    warm: tuple[str, ...]
    warm_own: tuple[str, ...]
    targets: tuple[Target, ...]

    def chosen(self, patterns: tuple[str, ...]) -> list[Target]:
        """Targets whose path fits one of the patterns, all for none. `ValueError` for a pattern
        that fits none."""
        idle = [
            each
            for each in patterns
            if not any(fnmatch(target.module, each) for target in self.targets)
        ]
        if idle:
            raise ValueError(f"no module of {PLAN.name} fits {idle[0]!r}")
        return [
            one
            for one in self.targets
            if not patterns or any(fnmatch(one.module, each) for each in patterns)
        ]


def read(root: Path, path: Path = PLAN) -> Plan:
    """The plan for a tree. Raises `ValueError` for a module or a test that it lacks, or a module
    that stands twice."""
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    targets = [
        target for group in data["group"] for target in _targets(root, group, tuple(data["but"]))
    ]
    modules = [target.module for target in targets]
    if twice := [module for module in modules if modules.count(module) > 1]:
        raise ValueError(f"{path.name}: {twice[0]} stands twice")
    return Plan(
        data["seed"],
        tuple(data["operators"]),
        tuple(data["chosen"]),
        tuple(data["warm"]),
        tuple(data["warm_own"]),
        tuple(targets),
    )


def _targets(root: Path, group: dict[str, Any], but: tuple[str, ...]) -> Iterator[Target]:
    tests = [file for each in group["tests"] for file in _test_files(root, each)]
    for pattern in group["modules"]:
        found = sorted(path.relative_to(root).as_posix() for path in root.glob(pattern))
        if not found:
            raise ValueError(f"{PLAN.name}: no module {pattern}")
        for module in found:
            if not module.endswith("__init__.py"):
                yield Target(module, _nearest_first(root, module, tests), group.get("sample"), but)


def _test_files(root: Path, path: str) -> list[str]:
    """Of a file or a folder."""
    files = [root / path] if path.endswith(".py") else sorted((root / path).rglob("test_*.py"))
    if not files or not files[0].is_file():
        raise ValueError(f"{PLAN.name}: no tests {path}")
    return [file.relative_to(root).as_posix() for file in files]


def _nearest_first(root: Path, module: str, tests: list[str]) -> tuple[str, ...]:
    """Those that import the module come first: most mutants end there."""
    name = module.removesuffix(".py").replace("/", ".")
    return tuple(
        sorted(
            tests,
            key=lambda test: f"pyroshock.{name} " not in (root / test).read_text(encoding="utf-8"),
        )
    )
