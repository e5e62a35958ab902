"""`python -m benchmarks.scale`: a laboratory of a million impacts on PostgreSQL, and what ten million would cost.

Two stores are filled on the server of $TEST_DATABASE_URL and kept there, or on one that is started for it. The measured
values go to scale.json in $PYROSHOCK_BENCH_FOLDER, and from there, also with `--again`, below the mark in
docs/measurements/scale.md.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
import time
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from pyroshock.app.impacts.export import export_table
from pyroshock.app.impacts.impact import impact_page
from pyroshock.app.impacts.overlays import pulse_overlay
from pyroshock.app.impacts.signals import channel_window
from pyroshock.app.ingest.campaign_overview import campaign_overview, list_campaigns_page
from pyroshock.dataset.selection import select_pulses
from pyroshock.ingest.load import ingest_folder
from pyroshock.schema.engine import make_engine
from pyroshock.schema.impacts import Impact
from pyroshock.schema.listings import Condition, iter_impacts, list_campaigns, list_impacts_page
from pyroshock.schema.migrate import upgrade
from pyroshock.schema.recordings import RecordedChannel, SeriesChunk
from pyroshock.schema.session import Store, open_store
from sqlalchemy import URL, Engine, event, func, make_url, select, text
from sqlalchemy.orm import Session

from .harness import PYROSHOCK, ROOT, Spread, ratio, run_python, take_turns, work_folder
from .page import machine
from .shared_records import (
    HITS,
    HITS_PER_RECORDING,
    RARE,
    WRITER,
    StoreSize,
    campaign_name,
    fill,
    fresh_database,
    running_server,
    sample_of,
    write_campaign,
)

Measured = dict[str, Any]

DOCUMENT = ROOT / "docs" / "measurements" / "scale.md"
MARK = "<!-- below: written by `make bench-scale` -->"
SERVER_VARIABLE = "TEST_DATABASE_URL"
SMALL, LARGE, TARGET = 100_000, 1_000_000, 10_000_000
PER_CAMPAIGN, CLIENTS, PAGE = 10_000, 4, 50
QUESTION_REPEATS, INGEST_REPEATS = 9, 7
RECORDINGS = 20
IMPACTS = RECORDINGS * HITS
#: A table or index that is smaller than this at the target is not shown, bytes.
_SMALLEST = 50e6
#: A page that takes longer keeps a person waiting, seconds.
_SLOW_S = 1.0
#: Nodes of a plan that only pass rows on say nothing.
_SILENT = ("Gather", "Gather Merge", "Materialize", "Memoize", "Hash", "Result", "Subquery Scan", "Unique", "Limit")
#: Of every ordinary table of the store with its TOAST, and of every index of it.
_SIZES = text(
    """
    SELECT c.relname AS "table", NULL AS "index", pg_table_size(c.oid) AS bytes
    FROM pg_class c WHERE c.relkind = 'r' AND c.relnamespace = 'public'::regnamespace
    UNION ALL
    SELECT t.relname, i.relname, pg_relation_size(i.oid)
    FROM pg_index x JOIN pg_class i ON i.oid = x.indexrelid JOIN pg_class t ON t.oid = x.indrelid
    WHERE t.relnamespace = 'public'::regnamespace
    """
)


@dataclass(frozen=True)
class Question:
    """What a laboratory asks of its store; `ask` gets a session of a store that was filled to the size."""

    name: str
    ask: Callable[[Session, StoreSize], object]


def _middle(size: StoreSize) -> str:
    return campaign_name(size.campaigns // 2)


def _page(*where: Condition, campaign: bool = False) -> Callable[[Session, StoreSize], object]:
    """The first page of what meets the conditions, of all impacts or of a campaign."""
    return lambda session, size: list_impacts_page(session, _middle(size) if campaign else None, where, None, PAGE)


def _impact_with_slice(session: Session, size: StoreSize) -> object:
    """The page of an impact whose recording has its series, and a tenth of a second of a channel."""
    recording = size.recordings // 2 // size.series_every * size.series_every
    page = impact_page(session, recording * HITS_PER_RECORDING)
    first = select(func.min(RecordedChannel.id)).where(RecordedChannel.recording_id == recording)
    return page, channel_window(session, session.scalars(first).one(), 0.2, 0.3)


def _export(session: Session, size: StoreSize) -> object:
    with tempfile.TemporaryDirectory() as folder:
        return export_table(session, "pulses", Path(folder) / "pulses.parquet", _middle(size))


_STEEL, _LOW = Condition("tip_material", "=", "steel"), Condition("hammer_speed", "=", "low")
_NONE = Condition("peak_force_n", ">", 1e9)
QUESTIONS = (
    Question("the newest ten campaigns with their counts", lambda s, _: list_campaigns_page(s, limit=10)),
    Question("all campaigns with their counts", lambda s, _: list_campaigns(s)),
    Question("a campaign's page", lambda s, size: campaign_overview(s, _middle(size))),
    Question("all impacts of a campaign", lambda s, size: sum(1 for _ in iter_impacts(s, _middle(size)))),
    Question("a campaign's impacts, first page", _page(campaign=True)),
    Question("all impacts, first page", _page()),
    Question("all impacts, last page", lambda s, size: list_impacts_page(s, None, (), size.impacts - PAGE, PAGE)),
    Question("tip_material=steel, first page", _page(_STEEL)),
    Question("tip_material!=steel, first page", _page(Condition("tip_material", "!=", "steel"))),
    Question("tip_material=steel and hammer_speed=low, first page", _page(_STEEL, _LOW)),
    Question("the same in one campaign", _page(_STEEL, _LOW, campaign=True)),
    Question("a level that ten impacts have", _page(Condition(RARE[0], "=", RARE[1]))),
    Question("peak_force_n>2990 (one in a hundred), first page", _page(Condition("peak_force_n", ">", 2990.0))),
    Question("peak_force_n>1e9 (no match)", _page(_NONE)),
    Question("the same in one campaign", _page(_NONE, campaign=True)),
    Question("an impact's page, and 0.1 s of a channel", _impact_with_slice),
    Question("overlaid pulses of a campaign", lambda s, n: pulse_overlay(s, _middle(n), (), "tip_material")),
    Question("overlaid pulses of all impacts", lambda s, _: pulse_overlay(s, None, (), "tip_material")),
    Question(
        "pulses for a dataset from one campaign", lambda s, n: select_pulses(s, [_middle(n)], None, "reject", None)
    ),
    Question("a campaign's pulses as Parquet", _export),
)


def measure(folder: Path) -> Measured:
    """All that the page shows, as plain data."""
    source = write_campaign(folder / "sample", 8, ".mat", np.random.default_rng(11))
    with open_store(f"sqlite:///{folder / 'sample.db'}", WRITER, create=True) as store:
        ingest_folder(store, source, jobs=1)
        sample = sample_of(store)
    sizes = [StoreSize(impacts, PER_CAMPAIGN, own_radii=True, sample=sample) for impacts in (SMALL, LARGE)]
    with ExitStack() as stack:
        server = os.environ.get(SERVER_VARIABLE) or stack.enter_context(running_server(durable=True))
        urls = [kept_store(server, size) for size in sizes]
        small, large = stores = [stack.enter_context(open_store(url, WRITER)) for url in urls]
        with large.reading() as session:
            version = str(session.scalars(select(func.current_setting("server_version"))).one())
        stores_json = [{name: getattr(size, name) for name in ("impacts", "campaigns", "recordings")} for size in sizes]
        measured: Measured = {"machine": machine(), "server": version, "stores": stores_json}
        measured |= {"rooms": rooms(small, large), "frames_share": frames_share(large)}
        measured |= {"series": list(series_kinds(folder))}
        measured |= {"questions": [measured_question(question, stores, sizes) for question in QUESTIONS]}
        return measured | {"ingest": measured_ingest(server, urls[1], folder)}


def kept_store(server_url: str, size: StoreSize) -> str:
    """The store of this size on the server, filled where the server lacks it, at this software's revision; one that is
    half filled is filled anew."""
    server, name = make_url(server_url).set(drivername="postgresql+psycopg"), f"pyroshock_scale_{size.impacts}"
    url, unfinished = (_address(server, database) for database in (name, f"{name}_unfinished"))
    if not _execute(server, "SELECT FROM pg_database WHERE datname = %s", name):
        _execute(server, f'DROP DATABASE IF EXISTS "{name}_unfinished" WITH (FORCE)')
        _execute(server, f'CREATE DATABASE "{name}_unfinished"')
        fill(unfinished, size)
        _execute(server, f'ALTER DATABASE "{name}_unfinished" RENAME TO "{name}"')
    engine = make_engine(url)
    upgrade(engine)
    engine.dispose()
    return url


def _address(server: URL, database: str) -> str:
    return server.set(database=database).render_as_string(hide_password=False)


def _execute(server: URL, statement: str, *values: str) -> int:
    """Rows that the statement found or changed."""
    import psycopg

    address = server.set(drivername="postgresql").render_as_string(hide_password=False)
    with psycopg.connect(address, autocommit=True) as connection:
        return connection.execute(statement.encode(), values).rowcount


def rooms(small: Store, large: Store) -> list[Measured]:
    """Bytes of every table (`index` None) and index in the two stores, the largest first."""
    sizes: list[dict[tuple[str, str | None], int]] = []
    for store in (small, large):
        with store.engine.connect() as connection:
            sizes.append({(table, index): int(size) for table, index, size in connection.execute(_SIZES)})
    rows = [
        {"table": table, "index": index, "small": sizes[0].get((table, index), 0), "large": size}
        for (table, index), size in sizes[1].items()
    ]
    return sorted(rows, key=lambda row: -row["large"])


def frames_share(store: Store) -> float:
    """Room of the table of series over the bytes of the frames in it."""
    with store.reading() as session:
        frames = session.scalars(select(func.sum(func.length(SeriesChunk.frame)))).one()
        room = session.scalars(select(func.pg_total_relation_size(SeriesChunk.__tablename__))).one()
        return float(room) / float(frames)


def series_kinds(folder: Path) -> Iterator[Measured]:
    """What raw series weigh, of made, measured and simulated campaigns, each in a store of its own."""
    made = write_campaign(folder / "made", 8, ".mat", np.random.default_rng(11))
    yield _series_row(
        "hammer: two channels, ten hits in 10 s (`tests/support/records/hammer_recordings.py`)", made, folder
    )
    measured = ROOT / "examples" / "modal-hammer-hit"
    yield _series_row("hammer: two channels, one measured hit (`examples/modal-hammer-hit`)", measured, folder)
    plans = f"sqlite:///{folder / 'plans.db'}"
    for kind in ("hammer", "gun"):
        design = ("--kind", kind, "--runs", "6", "--repetitions", "5", "--seed", "1")
        run_python(*PYROSHOCK, "plan", "lhs", kind, *design, "--db", plans)
        run_python(*PYROSHOCK, "simulate", kind, "--out", folder / kind, "--db", plans)
        yield _series_row(f"{kind}: as the virtual bench records it", folder / kind, folder)


def _series_row(kind: str, source: Path, folder: Path) -> Measured:
    channel = select(func.max(RecordedChannel.sampling_rate_hz), func.sum(RecordedChannel.samples))
    with open_store(f"sqlite:///{folder / source.name}.db", WRITER, create=True) as store:
        ingest_folder(store, source, jobs=1)
        with store.reading() as session:
            impacts = session.scalars(select(func.count()).select_from(Impact)).one()
            rate, samples = session.execute(channel).one()
            stored = session.scalars(select(func.sum(func.length(SeriesChunk.frame)))).one()
    per_impact = {"samples_per_impact": float(samples) / impacts, "bytes_per_impact": float(stored) / impacts}
    return {"kind": kind, "rate_hz": float(rate), **per_impact}


def measured_question(question: Question, stores: Sequence[Store], sizes: Sequence[StoreSize]) -> Measured:
    def ask(store: Store, size: StoreSize) -> None:
        with store.reading() as session:
            question.ask(session, size)

    pairs = zip(("small", "large"), stores, sizes, strict=True)
    seconds = take_turns({name: partial(ask, store, size) for name, store, size in pairs}, QUESTION_REPEATS)
    print(f"{question.name}: {min(seconds['large']):.3g} s", flush=True)
    return {"name": question.name, **seconds, "plans": plans_of(stores[1], partial(ask, stores[1], sizes[1]))}


def plans_of(store: Store, ask: Callable[[], object]) -> Measured:
    """How many statements a question is, and the plan of the dearest: lines, from the last step to the first."""
    with _recorded_statements(store.engine) as statements:
        ask()
    with store.engine.connect() as connection:
        explain = "EXPLAIN (ANALYZE, BUFFERS, FORMAT JSON) "
        plans: list[Any] = [
            connection.exec_driver_sql(explain + statement, parameters).scalar_one()[0]
            for statement, parameters in statements
        ]
    dearest = max(plans, key=lambda plan: float(plan["Execution Time"]))
    lines = list(_plan_lines(dearest["Plan"], 0))
    return {"statements": len(statements), "milliseconds": float(dearest["Execution Time"]), "lines": lines}


@contextmanager
def _recorded_statements(engine: Engine) -> Iterator[list[tuple[str, Any]]]:
    statements: list[tuple[str, Any]] = []

    def record(_connection: Any, _cursor: Any, statement: str, parameters: Any, *_: Any) -> None:
        if statement.lstrip().startswith("SELECT"):
            statements.append((statement, parameters))

    event.listen(engine, "before_cursor_execute", record)
    try:
        yield statements
    finally:
        event.remove(engine, "before_cursor_execute", record)


def _plan_lines(node: Mapping[str, Any], depth: int) -> Iterator[str]:
    """`Index Scan on impacts by ix_impacts_campaign_id_id: 50 rows, 0.1 ms, 4 pages`."""
    silent = node["Node Type"] in _SILENT
    if not silent:
        names = (("on", "Relation Name"), ("by", "Index Name"))
        what = " ".join([node["Node Type"], *(f"{word} {node[name]}" for word, name in names if name in node)])
        loops = int(node["Actual Loops"])
        rows = f"{round(node['Actual Rows'] * loops):,} rows".replace(",", " ")
        pages = int(node.get("Shared Hit Blocks", 0)) + int(node.get("Shared Read Blocks", 0))
        times, spent = f" in {loops} turns" if loops > 1 else "", node["Actual Total Time"] * loops
        yield f"{'  ' * depth}{what}: {rows}{times}, {spent:{'.3g' if spent < 999 else '.0f'}} ms, {pages} pages"
    for child in node.get("Plans", []):
        yield from _plan_lines(child, depth if silent else depth + 1)


def measured_ingest(server: str, full: str, folder: Path) -> Measured:
    """Impacts a second into a new store and the full one, by one client and by several, in turn."""
    costs: dict[str, list[tuple[float, float]]] = {"new": [], "full": []}
    together = []
    with fresh_database(server) as empty:
        open_store(empty, WRITER, create=True).close()
        for _ in range(INGEST_REPEATS + 1):
            source = _new_campaign(folder)
            for name, url in (("new", empty), ("full", full)):
                costs[name].append(_ingest(url, source))
        with ProcessPoolExecutor(CLIENTS, mp_context=get_context("spawn")) as pool:
            for _ in range(INGEST_REPEATS + 1):
                sources = [_new_campaign(folder) for _ in range(CLIENTS)]
                begin = time.perf_counter()
                list(pool.map(partial(_ingest, full), sources))
                together.append(CLIENTS * IMPACTS / (time.perf_counter() - begin))
    measured: Measured = {"clients": CLIENTS, "together": together[1:], "impacts": IMPACTS}
    for name, cost_of in costs.items():  # the first of each finds nothing warm
        measured[name] = [IMPACTS / wall_s for wall_s, _ in cost_of[1:]]
        measured[f"{name}_processor_s"] = [processor_s / IMPACTS for _, processor_s in cost_of[1:]]
    return measured


def _new_campaign(folder: Path) -> Path:
    """A folder of a campaign that no store has."""
    key = uuid.uuid4()
    made = write_campaign(folder / key.hex, RECORDINGS, ".mat", np.random.default_rng(key.int))
    description = made / "campaign.toml"
    description.write_text(description.read_text().replace('"measured"', f'"more-{key.hex}"'))
    return made


def _ingest(url: str, source: Path) -> tuple[float, float]:
    """Seconds, and those of the client's processor in it, into a store that is open already."""
    with open_store(url, WRITER) as store:
        begin, busy = time.perf_counter(), time.process_time()
        impacts = ingest_folder(store, source, jobs=1).impacts
        seconds = time.perf_counter() - begin, time.process_time() - busy
    if impacts != IMPACTS:
        raise ValueError(f"{source}: {impacts} impacts; expected {IMPACTS}")
    return seconds


def page_of(measured: Measured) -> str:
    """Markdown: the stores, the questions with their growth, the plans, room, raw series, ingest."""
    parts = (_stores, _questions, _slowest, _room, _series, _ingest_part, _plans)
    return "\n\n".join("\n".join(part(measured)) for part in parts) + "\n"


def _table(head: Sequence[str], rows: Iterator[Sequence[str]]) -> list[str]:
    return ["| " + " | ".join(line) + " |" for line in (head, ["---"] * len(head), *rows)]


def _stores(measured: Measured) -> Iterator[str]:
    small, large = measured["stores"]
    sizes = [", ".join(f"{store[what]:,} {what}" for what in ("impacts", "campaigns", "recordings"))
             for store in (small, large)]  # fmt: skip
    yield "## What was measured\n"
    yield (
        f"PostgreSQL {measured['server']} runs with its own settings, and the client runs on the same machine "
        f"({measured['machine']}). A time is the median (least to largest) of repeats in turn, all of them warm."
    )
    yield f"The large store has {sizes[1]}; the small one has {sizes[0]}."
    yield (
        f"The columns under {TARGET:,} are extrapolated to {TARGET // (large['impacts'] // large['campaigns']):,} "
        "campaigns of the same size. Room, and times that grow with the store (growth over 2), follow the straight "
        "line through both stores. Other times grow by the same factor once more."
    )


def _questions(measured: Measured) -> Iterator[str]:
    yield "## Questions\n"
    small, large = (f"{store['impacts']:,}" for store in measured["stores"])
    head = ("question", small, large, "growth", f"{TARGET:,}", "statements")
    rows = (
        (question["name"], *(_times(Spread.of(question[store])) for store in ("small", "large")),
         f"{_growth(question).text()} times", _duration(_extrapolated_s(question)),
         str(question["plans"]["statements"]))
        for question in measured["questions"]
    )  # fmt: skip
    yield from _table(head, rows)


def _growth(question: Measured) -> Spread:
    return ratio(question["large"], question["small"])


def _extrapolated_s(question: Measured) -> float:
    """On the straight line where times grow with the store, else by the same factor again."""
    small, large = (Spread.of(question[store]).median for store in ("small", "large"))
    if _grows(question):
        return large + (large - small) * (TARGET - LARGE) / (LARGE - SMALL)
    return large * max(1.0, _growth(question).median)


def _grows(question: Measured) -> bool:
    """A tree that is a page deeper does not double a time."""
    return _growth(question).median > 2


def _times(spread: Spread) -> str:
    return f"{_duration(spread.median)} ({_duration(spread.low)} to {_duration(spread.high)})"


def _duration(seconds: float) -> str:
    return f"{1e3 * seconds:.0f} ms" if seconds < 1 else f"{seconds:.2g} s"


def _slowest(measured: Measured) -> Iterator[str]:
    yield f"These questions take more than {_SLOW_S:g} s there:\n"
    slow = [(_extrapolated_s(question), question) for question in measured["questions"]]
    for seconds, question in sorted(slow, key=lambda pair: -pair[0]):
        if seconds > _SLOW_S:
            grows = "grows with the store" if _grows(question) else "does not grow with it"
            yield f"- {question['name']}: {_duration(seconds)}; {grows}"


def _room(measured: Measured) -> Iterator[str]:
    small, large = (int(store["impacts"]) for store in measured["stores"])

    def slope(room: Measured) -> float:
        return float(room["large"] - room["small"]) / (large - small)

    def at_target(room: Measured) -> float:
        return float(room["large"]) + slope(room) * (TARGET - large)

    # Series of a few recordings only are in the stores: their own table shows their room.
    tables = [room for room in measured["rooms"] if room["table"] != "series_chunks"]
    rows = [
        (f"`{room['table']}`", f"`{room['index']}`" if room["index"] else "", f"{room['large'] / 1e6:,.0f}",
         f"{slope(room):,.0f}", f"{at_target(room) / 1e9:.3g}")
        for room in tables if at_target(room) >= _SMALLEST
    ]  # fmt: skip
    total, megabytes = sum(map(at_target, tables)), sum(room["large"] for room in tables) / 1e6
    rows.append(("all, without series", "", f"{megabytes:,.0f}", f"{total / TARGET:,.0f}", f"{total / 1e9:.3g}"))
    yield "## Room\n"
    yield from _table(("table", "index", f"{large:,}: MB", "bytes an impact", f"{TARGET:,}: GB"), iter(rows))


def _series(measured: Measured) -> Iterator[str]:
    share = float(measured["frames_share"])
    rows = []
    for kind in measured["series"]:
        nbytes = share * kind["bytes_per_impact"]
        room = f"{nbytes / 1e3:.3g}" if nbytes < 999e3 else f"{nbytes / 1e3:,.0f}"
        rate, samples = f"{kind['rate_hz'] / 1e3:.3g}", f"{kind['samples_per_impact']:,.0f}"
        rows.append((kind["kind"], rate, samples, room, f"{nbytes * TARGET / 1e12:.3g}"))
    yield "Raw series come on top:\n"
    yield from _table(("recordings", "kHz", "samples an impact", "kB an impact", f"{TARGET:,}: TB"), iter(rows))
    yield f"\nThe table takes {100 * (share - 1):.2g} % more than the frames in it, its key included."


def _ingest_part(measured: Measured) -> Iterator[str]:
    ingest = measured["ingest"]
    yield "## Ingest\n"
    yield (
        f"A campaign has {ingest['impacts']} impacts: ten in a MATLAB recording of 10 s with two channels at 51.2 kHz. "
        "Each client extracts the pulses with `--jobs 1`:\n"
    )
    cases = (("1", "new", "new"), ("1", "large", "full"), (str(ingest["clients"]), "large", "together"))
    rates = [(clients, store, Spread.of(ingest[name])) for clients, store, name in cases]
    rows = ((c, store, rate.text(), f"{TARGET / rate.median / 3600:.3g}") for c, store, rate in rates)
    yield from _table(("clients", "store", "impacts a second", f"hours for {TARGET:,}"), rows)
    spent = Spread.of(ingest["full_processor_s"])
    rate = ratio(ingest["full"], ingest["new"]).text()
    yield f"\nThe large store takes {rate} times as many a second as the new one."
    yield f"An impact costs {spent.text(' ms', 1e3)} of the client's processor."
    yield f"{TARGET:,} impacts cost {TARGET * spent.median / 3600:.3g} hours of one processor, which several can share."


def _plans(measured: Measured) -> Iterator[str]:
    yield "## Plans\n"
    yield "Each plan is that of a question's dearest statement in the large store, from the last step to the first."
    yield "A page has 8 kB."
    for question in measured["questions"]:
        plans, milliseconds = question["plans"], question["plans"]["milliseconds"]
        spent = f"{milliseconds:.3g}" if milliseconds < 999 else f"{milliseconds:,.0f}"
        yield f"\n{question['name']} (1 of {plans['statements']}, {spent} ms):\n"
        yield from ("```text", *plans["lines"], "```")


def write(measured: Measured) -> None:
    """Everything below the mark of the document, anew."""
    above, mark, _ = DOCUMENT.read_text(encoding="utf-8").partition(MARK)
    if not mark:
        raise ValueError(f"{DOCUMENT} has no line {MARK!r} below which the figures go")
    DOCUMENT.write_text(above + MARK + "\n\n" + page_of(measured), encoding="utf-8")
    print(f"written: {DOCUMENT}")


def main(arguments: list[str]) -> int:
    with work_folder() as folder:
        kept = folder / "scale.json"
        if arguments != ["--again"]:
            kept.write_text(json.dumps(measure(folder), indent=1))
        write(json.loads(kept.read_text()))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
