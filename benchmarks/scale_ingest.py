"""How fast one more campaign comes into a store: a new one and a full one, by one client and by several."""

from __future__ import annotations

import time
import uuid
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from pyroshock.ingest.load import ingest_folder
from pyroshock.schema.session import Writer, open_store

from .recordings import HITS, write_campaign

RECORDINGS = 20
IMPACTS = RECORDINGS * HITS


@dataclass(frozen=True)
class Taken:
    """Seconds of an ingest, and those of the client's processor in it: others who use the machine are in the former."""

    wall_s: float
    processor_s: float


def one_client(urls: dict[str, str], folder: Path, repeats: int) -> dict[str, list[Taken]]:
    """What each of the stores takes, in turn, each time of a campaign that none of them has."""
    taken: dict[str, list[Taken]] = {name: [] for name in urls}
    for repeat in range(repeats + 1):
        source = _campaign(folder)
        for name, url in urls.items():
            this = _ingest(url, source)
            if repeat:  # the first one finds nothing warm
                taken[name].append(this)
    return taken


def clients(url: str, folder: Path, count: int, repeats: int) -> list[float]:
    """Impacts a second of `count` clients together, each with campaigns of its own."""
    rates = []
    with ProcessPoolExecutor(count, mp_context=get_context("spawn")) as pool:
        for repeat in range(repeats + 1):
            sources = [_campaign(folder) for _ in range(count)]
            begin = time.perf_counter()
            list(pool.map(partial(_ingest, url), sources))
            if repeat:  # in the first one they start
                rates.append(count * IMPACTS / (time.perf_counter() - begin))
    return rates


def _campaign(folder: Path) -> Path:
    """A folder of a campaign as there is no other."""
    key = uuid.uuid4()
    made = write_campaign(folder / key.hex, RECORDINGS, ".mat", np.random.default_rng(key.int))
    description = made / "campaign.toml"
    description.write_text(description.read_text().replace('"measured"', f'"more-{key.hex}"'))
    return made


def _ingest(url: str, source: Path) -> Taken:
    """Of a store that is open already."""
    with open_store(url, Writer("benchmark", "0")) as store:
        begin, busy = time.perf_counter(), time.process_time()
        report = ingest_folder(store, source, jobs=1)
        taken = Taken(time.perf_counter() - begin, time.process_time() - busy)
    if report.impacts != IMPACTS:
        raise ValueError(f"{source}: {report.impacts} impacts; expected {IMPACTS}")
    return taken
