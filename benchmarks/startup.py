"""How long a command takes from call to end, beside what a person would call elsewhere, and Python's own start."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np

from .apart import interpreter_with
from .figures import Figure, missing
from .ingest import ingest_once
from .limits import starting
from .measuring import Spread, interleaved, ratio, run_child, run_program
from .peers import ABSENT
from .recordings import write_campaign

THEME = "Commands from call to end, in fresh processes"
RECORDINGS = 4
_BIN = Path(sys.executable).parent
_ROWS = "SELECT * FROM impacts AS i JOIN pulses AS p ON p.impact_id = i.id"
#: Name -> the way it is called; None where it is not installed.
Peers = dict[str, Callable[[], object] | None]


def measure_startup(folder: Path, repeats: int = 5) -> Iterator[Figure]:
    store = _small_store(folder)
    plain = f"import sqlite3; sqlite3.connect({str(store)!r}).execute({_ROWS!r}).fetchall()"
    frame = f"import sqlite3, pandas; pandas.read_sql({_ROWS!r}, sqlite3.connect({str(store)!r}))"
    yield from _beside(
        "pyroshock --version", ["--version"], "Python that starts and ends", starting, repeats,
        {
            "mlflow --version": partial(run_program, [_BIN / "mlflow", "--version"]),
            "import qcodes": _importing("qcodes"),
            "import pyyeti.srs": _importing("pyyeti.srs"),
            "import endaq.calc": _importing("endaq.calc"),
        },
    )  # fmt: skip
    yield from _beside(
        "pyroshock --help", ["--help"], "Python that starts and ends", starting, repeats,
        {"mlflow --help": partial(run_program, [_BIN / "mlflow", "--help"])},
    )  # fmt: skip
    yield from _beside(
        f"pyroshock impacts, {10 * RECORDINGS} of them", ["impacts", "--db", f"sqlite:///{store}"],
        "Python that fetches the same rows with sqlite3", partial(run_child, ["-c", plain]), repeats,
        {"pandas.read_sql": partial(run_child, ["-c", frame])},
    )  # fmt: skip


def _importing(module: str) -> Callable[[], object] | None:
    python = interpreter_with(module.split(".")[0])
    return partial(run_program, [python, "-c", f"import {module}"]) if python else None


def _beside(
    name: str, words: list[str], bound: str, limit: Callable[[], object], repeats: int, peers: Peers
) -> Iterator[Figure]:
    there = {peer: run for peer, run in peers.items() if run}
    taken = interleaved({"ours": partial(run_program, [_BIN / "pyroshock", *words]), **there, "limit": limit}, repeats)
    text = {way: Spread.of(seconds).text(" ms", 1e3) for way, seconds in taken.items()}
    about = f"`{name.split(',')[0]}`"
    for peer in peers:
        if peer not in there:
            yield missing(THEME, f"{name}; {peer}", ABSENT, ours=text["ours"], question=about, rival=peer)
            continue
        yield Figure(
            THEME, f"{name}; {peer}", text["ours"], text[peer], ratio(taken["ours"], taken[peer]),
            nature=f"{bound}: {text['limit']}", near=ratio(taken["ours"], taken["limit"]), question=about, rival=peer,
        )  # fmt: skip


def _small_store(folder: Path) -> Path:
    """With the impacts of a few recordings."""
    source, kept = folder / "startup", folder / "startup-store"
    if not (source / "complete").exists():
        write_campaign(source, RECORDINGS, ".npz", np.random.default_rng(3))
        (source / "complete").touch()
    kept.mkdir(exist_ok=True)
    ingest_once(source, kept, jobs=1)
    return kept / "ingested.db"
