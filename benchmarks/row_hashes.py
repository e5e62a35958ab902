"""An ingest into PostgreSQL with the hash of every row beside the same ingest without hashes.

`python -m benchmarks row-hashes` measures it. The other side is a process of its own, in which no
column has the hash as its default, and who hashes rows before they are inserted gets none: the
product has no such switch. Keys are reserved in both.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from pyroshock.ingest.load import ingest_folder
from pyroshock.schema import series, session
from pyroshock.schema.impacts import Impact
from pyroshock.schema.row_hashes import ROW_SHA256
from pyroshock.schema.session import open_store
from pyroshock.schema.tables import metadata
from sqlalchemy import func, select
from sqlalchemy.engine import make_url

from .harness import Figure, Program, answer_requests, beside
from .shared_records import WRITER, fresh_database, kept_campaign, make_tables, running_server

LIMIT = 1.05
WITH, WITHOUT = "with", "without"
THEME = (
    "Hashes of rows: the ingest of {} recordings into PostgreSQL with and without them, one process"
)
CLOCKS = {
    "processor_s": "processor time of the ingest",
    "wall_s": "from call to end, the server's work included",
}


def measure_row_hashes(folder: Path, recordings: int = 30, repeats: int = 8) -> Iterator[Figure]:
    """Raises `RuntimeError` where rows of the side without hashes have one, or others lack
    theirs."""
    source = kept_campaign(folder, recordings, ".npz")
    answers: dict[str, list[dict[str, Any]]] = {WITH: [], WITHOUT: []}
    with ExitStack() as stack:
        server = stack.enter_context(running_server(durable=True))
        tables = stack.enter_context(fresh_database(server))
        make_tables(tables)
        template = str(make_url(tables).database)
        programs = {
            side: stack.enter_context(Program("-m", "benchmarks.row_hashes", source, side))
            for side in (WITH, WITHOUT)
        }
        for turn in range(repeats + 1):  # the first does not count
            for side in sorted(programs, reverse=turn % 2 == 0):
                with fresh_database(server, template) as url:
                    answer = programs[side].ask(address=url)
                if answer["hashed"] != (answer["impacts"] if side == WITH else 0):
                    raise RuntimeError(
                        f"{side} hashes: {answer['hashed']} of {answer['impacts']} impacts have one"
                    )
                answers[side] += [answer] if turn else []
    for clock, name in CLOCKS.items():
        seconds = {side: [float(answer[clock]) for answer in answers[side]] for side in answers}
        yield beside(
            THEME.format(recordings), name, {"ours": seconds[WITH], WITHOUT: seconds[WITHOUT]},
            WITHOUT, unit="s",
            limit=LIMIT, kind="growth", binding=clock == "processor_s", question="",
        )  # fmt: skip


def ingest(source: Path, address: str) -> dict[str, Any]:
    """Into a new store; its seconds, and how many impacts carry a hash."""
    with open_store(address, WRITER, create=True) as store:
        wall, processor = time.perf_counter(), time.process_time()
        ingest_folder(store, source, jobs=1)
        processor, wall = time.process_time() - processor, time.perf_counter() - wall
        with store.reading() as reading:
            impacts, hashed = reading.execute(
                select(func.count(Impact.id), func.count(Impact.row_sha256))
            ).one()
    return {"processor_s": processor, "wall_s": wall, "impacts": impacts, "hashed": hashed}


def without_hashes() -> None:
    """From now on no row that this process writes gets a hash."""
    for table in metadata.tables.values():
        if ROW_SHA256 in table.columns:
            table.columns[ROW_SHA256].default = table.columns[ROW_SHA256].onupdate = None
    # Each has the function under a name of its own, which it does not offer to others: the checker
    # of types is told so.
    for module in (session, series):
        module.hash_of_new = lambda *_: None  # type: ignore[attr-defined]


if __name__ == "__main__":
    if sys.argv[2] == WITHOUT:
        without_hashes()
    answer_requests(lambda request: ingest(Path(sys.argv[1]), request["address"]))
