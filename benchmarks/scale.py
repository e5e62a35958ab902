"""`python -m benchmarks.scale`: a laboratory of a million impacts on PostgreSQL, and what ten million would cost.

Two stores are filled on the server of $TEST_DATABASE_URL and kept there, or on one that is started for it. What was
measured goes to scale.json in $PYROSHOCK_BENCH_FOLDER, and from there, also with `--again`, below the mark in
docs/measurements/scale.md.
"""

from __future__ import annotations

import json
import sys
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

from pyroshock.schema.engine import make_engine
from pyroshock.schema.migrate import upgrade
from pyroshock.schema.session import Store, Writer, open_store
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from . import scale_ingest
from .crowded import Crowd, fill
from .machine import machine
from .measuring import ROOT, interleaved
from .postgres import empty_databases, kept_database, server
from .sampled import ingested_sample
from .scale_page import LARGE, MARK, SMALL, page_of
from .scale_plans import plans_of
from .scale_questions import QUESTIONS, Question
from .scale_series import measure_series
from .scale_storage import frames_share, rooms
from .themes import work_folder

DOCUMENT = ROOT / "docs" / "measurements" / "scale.md"
PER_CAMPAIGN, CLIENTS = 10_000, 4
QUESTION_REPEATS, INGEST_REPEATS = 9, 7

Measured = dict[str, Any]


def main(arguments: list[str]) -> int:
    with work_folder() as folder:
        kept = folder / "scale.json"
        if arguments != ["--again"]:
            kept.write_text(json.dumps(measure(folder), indent=1))
        write(json.loads(kept.read_text()))
    return 0


def write(measured: Measured) -> None:
    """Everything below the mark of the document, anew."""
    written, found, _ = DOCUMENT.read_text(encoding="utf-8").partition(MARK)
    if not found:
        raise ValueError(f"{DOCUMENT} has no line {MARK!r} below which the figures go")
    DOCUMENT.write_text(written + MARK + "\n\n" + page_of(measured), encoding="utf-8")
    sys.stdout.write(f"written: {DOCUMENT}\n")


def measure(folder: Path) -> Measured:
    """All that the page shows, as plain data."""
    sample = ingested_sample(folder)
    crowds = [Crowd(impacts, PER_CAMPAIGN, own_radii=True, sample=sample) for impacts in (SMALL, LARGE)]
    with ExitStack() as open_ones:
        address = open_ones.enter_context(server())
        urls = [_filled(address, crowd) for crowd in crowds]
        small, large = (open_ones.enter_context(open_store(url, Writer("benchmark", "0"))) for url in urls)
        found: Measured = {
            "machine": machine(),
            "server": _version(large),
            "crowds": [_told(crowd) for crowd in crowds],
        }
        found |= {"rooms": [vars(room) for room in rooms(small, large)], "frames_share": frames_share(large)}
        found |= {"series": [vars(one) for one in measure_series(folder)]}
        found |= {"questions": [_asked(question, small, large, crowds) for question in QUESTIONS]}
        return found | {"ingest": _ingested(address, urls[1], folder)}


def _filled(address: str, crowd: Crowd) -> str:
    """The store of the crowd, filled where the server does not have it yet, at this software's revision."""
    url = kept_database(address, f"pyroshock_scale_{crowd.impacts}", lambda new: fill(new, crowd))
    engine = make_engine(url)
    upgrade(engine)
    engine.dispose()
    return url


def _told(crowd: Crowd) -> dict[str, int]:
    return {"impacts": crowd.impacts, "campaigns": crowd.campaigns, "recordings": crowd.recordings}


def _version(store: Store) -> str:
    with store.reading() as session:
        return str(session.scalars(select(func.current_setting("server_version"))).one())


def _asked(question: Question, small: Store, large: Store, crowds: list[Crowd]) -> Measured:
    def ask(store: Store, crowd: Crowd) -> None:
        with store.reading() as session:
            question.ask(session, crowd)

    sizes = {"small": partial(ask, small, crowds[0]), "large": partial(ask, large, crowds[1])}
    taken = interleaved(sizes, QUESTION_REPEATS)
    plans = plans_of(large, partial(_of_crowd, question, crowds[1]))
    sys.stdout.write(f"{question.name}: {min(taken['large']):.3g} s\n")
    sys.stdout.flush()
    return {"name": question.name, **taken, "plans": vars(plans)}


def _of_crowd(question: Question, crowd: Crowd, session: Session) -> object:
    return question.ask(session, crowd)


def _ingested(address: str, full: str, folder: Path) -> Measured:
    with empty_databases(address, 1) as (empty,):
        open_store(empty, Writer("benchmark", "0"), create=True).close()
        taken = scale_ingest.one_client({"new": empty, "full": full}, folder, INGEST_REPEATS)
        together = scale_ingest.clients(full, folder, CLIENTS, INGEST_REPEATS)
    found: Measured = {"clients": CLIENTS, "together": together, "impacts": scale_ingest.IMPACTS}
    for name, ours in taken.items():
        found[name] = [scale_ingest.IMPACTS / one.wall_s for one in ours]
        found[f"{name}_processor_s"] = [one.processor_s / scale_ingest.IMPACTS for one in ours]
    return found


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
