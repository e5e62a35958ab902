"""A genetic search over a grid: elitist, parallel, and the same after an interruption as without
one.

Optuna's NSGA-II sampler with one objective is an elitist genetic search as well, well kept, and not
used: the state of its chance is not in its storage, so a study that was interrupted goes on
differently; it fits duplicates again; and with workers its result depends on who finishes first.
Here a generation is a function of the seed, its number and the values of the one before. Only
values by genes are stored (`SearchJournal`): a search that resumes goes through its generations
from the first again, and what was evaluated already costs nothing. PyGAD and pymoo can be replayed
so too; docs/decisions/0022 tells what they were measured at.

Operators (Eiben and Smith, Introduction to Evolutionary Computing, 2015): tournaments of two, each
gene drawn anywhere between its parents' (whole arithmetic recombination with chance), creep
mutation along the levels; the best survive.

What a search has found so far, on disk: one line for each evaluation, and nothing that must be kept
in step.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...parallel.executor import HERE, ExecutorConfig
from ...parallel.map_tasks import run_all_tasks

Key = tuple[int, ...]


class SearchJournal:
    """Values by key, in a file of JSON lines whose first tells which search it belongs to; no file
    without `path`.

    `durations_s` are what the values took (s), by key; a line of older software has none.

    A line reaches the disk before `add` returns. A run that is killed leaves whole lines, and at
    most the last one torn: that one is cut off when the file is opened again. Not for two runs at
    once.
    """

    def __init__(self, path: Path | None, search: Mapping[str, Any]) -> None:
        """Opens or begins the file. Raises `ValueError` where it belongs to another search."""
        self.path = path
        self.values: dict[Key, float] = {}
        self.durations_s: dict[Key, float] = {}
        if path is None:
            return
        path.parent.mkdir(parents=True, exist_ok=True)
        lines = _whole_lines(path)
        if not lines:
            self._write({"search": dict(search)})
        elif lines[0].get("search") != json.loads(json.dumps(dict(search))):
            raise ValueError(
                f"{path} belongs to another search (other data, settings or "
                f"seed): delete it, or name another"
            )
        for line in lines[1:]:
            self.values[tuple(line["key"])] = float(line["value"])
            if "duration_s" in line:
                self.durations_s[tuple(line["key"])] = float(line["duration_s"])

    def add(self, key: Key, value: float, duration_s: float) -> None:
        self.values[key], self.durations_s[key] = value, duration_s
        self._write({"key": list(key), "value": value, "duration_s": duration_s})

    def _write(self, line: dict[str, Any]) -> None:
        """One write of one line at the end of the file, and through to the disk."""
        if self.path is None:
            return
        file = os.open(self.path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)
        try:
            os.write(file, json.dumps(line).encode() + b"\n")
            os.fsync(file)
        finally:
            os.close(file)


def _whole_lines(path: Path) -> list[dict[str, Any]]:
    """The lines that were written to their end; what stands behind them is cut off."""
    if not path.exists():
        return []
    content = path.read_bytes()
    whole = content[: content.rfind(b"\n") + 1]
    if len(whole) < len(content):
        os.truncate(path, len(whole))
    try:
        lines = [json.loads(line) for line in whole.splitlines()]
        if all(isinstance(line, dict) for line in lines) and all(
            {"key", "value"} <= set(line) for line in lines[1:]
        ):
            return lines
    except ValueError:
        pass
    raise ValueError(f"{path} is no journal of a search: delete it, or name another")


#: A candidate: a level of each axis.
Genes = tuple[int, ...]
#: What is minimised. Depends on the genes alone; may be called from several threads, or be sent to
#: other processes.
Evaluate = Callable[[Genes], float]
#: Called with (generations that are done, all of them, what was found).
Progress = Callable[[int, int, str], None]

CROSSED, MUTATED, CREEP = (
    0.9,
    0.3,
    0.15,
)  # of couples; of genes; standard deviation over an axis's length


@dataclass(frozen=True)
class Search:
    """How to search. `levels` are the numbers of levels of the axes, in an order that means
    something."""

    levels: tuple[int, ...]
    population: int = 50
    generations: int = 50
    elite: int = 2
    workers: int = 1

    def __post_init__(self) -> None:
        if (
            not 0 < self.elite < self.population
            or self.generations < 0
            or self.workers < 1
            or min(self.levels) < 1
        ):
            raise ValueError(
                f"not a search: {self}; it needs 0 < elite < population, a "
                f"level of each axis, a worker"
            )


@dataclass(frozen=True)
class GeneticResult:
    """The best genes and their value; best value and candidates evaluated so far, both after each
    generation.

    `asked` counts the candidates of all generations, duplicates too.
    """

    genes: Genes
    value: float
    best: tuple[float, ...]
    asked: int
    evaluated_by_generation: tuple[int, ...]

    @property
    def evaluated(self) -> int:
        return self.evaluated_by_generation[-1]


def run_search(
    search: Search,
    evaluate: Evaluate,
    seed: int,
    journal: SearchJournal,
    progress: Progress | None = None,
    show: Callable[[Genes], str] = str,
    executor: ExecutorConfig = HERE,
) -> GeneticResult:
    """The best of a first population and `generations` bred from it; the same for any workers and
    any executor.

    An executor of this process works in `search.workers` threads; to another `evaluate` is sent,
    pickled.
    """
    population = _first(search, np.random.default_rng([seed, 0]))
    best, evaluated, seen, requested = list[float](), list[int](), set[Genes](), 0
    for generation in range(search.generations + 1):
        if generation:
            values = [journal.values[genes] for genes in population]
            population = _bred(
                search, population, values, np.random.default_rng([seed, generation])
            )
        # High levels first: where they are the dear ones, no worker is left with the dearest at the
        # end.
        missing = sorted(
            {genes for genes in population if genes not in journal.values}, reverse=True
        )
        for genes, (value, duration_s) in _evaluated(missing, evaluate, search.workers, executor):
            journal.add(genes, value, duration_s)
        seen.update(population)
        requested += search.population if generation == 0 else search.population - search.elite
        leader = min(seen, key=lambda genes: (journal.values[genes], genes))
        best.append(journal.values[leader])
        evaluated.append(len(seen))
        if progress:
            progress(
                generation + 1,
                search.generations + 1,
                f"generation {generation} of {search.generations}: {best[-1]:.4f} with "
                f"{show(leader)}; {len(seen)} evaluated, {requested - len(seen)} duplicates saved",
            )
    return GeneticResult(leader, best[-1], tuple(best), requested, tuple(evaluated))


#: A value, and the seconds that it took.
_Timed = tuple[float, float]


def _evaluated(
    missing: Sequence[Genes], evaluate: Evaluate, workers: int, executor: ExecutorConfig
) -> Iterable[tuple[Genes, _Timed]]:
    """Values as they come, each with its seconds. Here by threads: products of matrices leave
    Python's lock."""
    if workers == 1 or not executor.is_here:
        return run_all_tasks(executor, _value, missing, shared=(evaluate,))
    return _by_threads(missing, evaluate, workers)


def _value(genes: Genes, evaluate: Evaluate) -> _Timed:
    begun = time.perf_counter()
    return evaluate(genes), time.perf_counter() - begun


def _by_threads(
    missing: Sequence[Genes], evaluate: Evaluate, workers: int
) -> Iterable[tuple[Genes, _Timed]]:
    with ThreadPoolExecutor(workers) as pool:
        running = {pool.submit(_value, genes, evaluate): genes for genes in missing}
        try:
            for done in as_completed(running):
                yield running[done], done.result()
        finally:
            pool.shutdown(cancel_futures=True)


def _first(search: Search, rng: np.random.Generator) -> list[Genes]:
    """A Latin hypercube: each axis's levels evenly, in an order of its own."""
    places = np.arange(search.population) + rng.random((len(search.levels), search.population))
    shuffled = rng.permuted(places, axis=1) / search.population
    return [_genes(search, point * search.levels - 0.5) for point in shuffled.T]


def _bred(
    search: Search, parents: list[Genes], values: list[float], rng: np.random.Generator
) -> list[Genes]:
    """The next generation: the best survive, the rest are children."""
    order = sorted(range(len(parents)), key=lambda one: (values[one], parents[one]))
    elite = list(dict.fromkeys(parents[place] for place in order))[: search.elite]
    place = {parent: rank for rank, parent in enumerate(order)}

    def chosen() -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        rivals = rng.integers(len(parents), size=2)
        return np.array(parents[min(map(int, rivals), key=place.__getitem__)], dtype=np.float64)

    children: list[Genes] = []
    while len(elite) + len(children) < search.population:
        mother, father = chosen(), chosen()
        share = rng.random(len(search.levels)) if rng.random() < CROSSED else 0.0
        child = mother + share * (father - mother)
        mutated = rng.random(len(search.levels)) < MUTATED
        creep = np.maximum(CREEP * np.array(search.levels), 1.0) * rng.standard_normal(
            len(search.levels)
        )
        children.append(_genes(search, child + mutated * creep))
    return elite + children


def _genes(search: Search, point: np.ndarray[tuple[int], np.dtype[np.float64]]) -> Genes:
    """The nearest level of each axis."""
    return tuple(int(level) for level in np.clip(np.rint(point), 0, np.array(search.levels) - 1))
