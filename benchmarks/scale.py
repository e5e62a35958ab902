"""`python -m benchmarks.scale`: a laboratory of a million impacts on PostgreSQL, and what ten
million would cost.

Two stores are filled on the server of $TEST_DATABASE_URL and kept there, or on one that is started
for it. The measured values go to scale.json in $PYROSHOCK_BENCH_FOLDER, and from there, also with
`--again`, below the mark in docs/measurements/scale.md.
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
from contextlib import ExitStack
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pyroshock.app.operations.impacts.export import export_table
from pyroshock.app.operations.impacts.impact import impact_page
from pyroshock.app.operations.impacts.overlays import pulse_overlay
from pyroshock.app.operations.impacts.signals import channel_window
from pyroshock.app.operations.ingest.campaign_overview import campaign_overview, list_campaigns_page
from pyroshock.dataset.selection import select_pulses
from pyroshock.ingest.load import ingest_folder
from pyroshock.schema.engine import make_engine
from pyroshock.schema.impacts import Impact
from pyroshock.schema.listings import Condition, iter_impacts, list_campaigns, list_impacts_page
from pyroshock.schema.migrate import upgrade
from pyroshock.schema.recordings import RecordedChannel, SeriesChunk
from pyroshock.schema.session import Store, open_store
from sqlalchemy import NullPool, create_engine, event, func, make_url, select, text
from sqlalchemy.orm import Session

from .harness import (
    PYROSHOCK,
    ROOT,
    Spread,
    ratio,
    run_python,
    table,
    table_row,
    take_turns,
    work_folder,
)
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
_SMALLEST = 200e6
#: A page that takes longer keeps a person waiting, seconds.
_SLOW_S = 1.0
#: Nodes of a plan that only pass rows on say nothing.
_SILENT = (
    "Gather",
    "Gather Merge",
    "Materialize",
    "Memoize",
    "Hash",
    "Result",
    "Subquery Scan",
    "Unique",
    "Limit",
)
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


class Question(NamedTuple):
    """What a laboratory asks of its store; `ask` gets a session of a store that was filled to the
    size."""

    name: str
    ask: Callable[[Session, StoreSize], object]


def _middle(size: StoreSize) -> str:
    return campaign_name(size.campaigns // 2)


def _page(*where: Condition, campaign: bool = False) -> Callable[[Session, StoreSize], object]:
    """The first page of what meets the conditions, of all impacts or of a campaign."""
    return lambda session, size: list_impacts_page(
        session, _middle(size) if campaign else None, where, None, PAGE
    )


def _impact_with_slice(session: Session, size: StoreSize) -> object:
    """The page of an impact whose recording has its series, and a tenth of a second of a
    channel."""
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
    Question(
        "the newest ten campaigns with their counts", lambda s, _: list_campaigns_page(s, limit=10)
    ),
    Question("all campaigns with their counts", lambda s, _: list_campaigns(s)),
    Question("a campaign's page", lambda s, size: campaign_overview(s, _middle(size))),
    Question(
        "all impacts of a campaign", lambda s, size: sum(1 for _ in iter_impacts(s, _middle(size)))
    ),
    Question("a campaign's impacts, first page", _page(campaign=True)),
    Question("all impacts, first page", _page()),
    Question(
        "all impacts, last page",
        lambda s, size: list_impacts_page(s, None, (), size.impacts - PAGE, PAGE),
    ),
    Question("tip_material=steel, first page", _page(_STEEL)),
    Question("tip_material!=steel, first page", _page(Condition("tip_material", "!=", "steel"))),
    Question("tip_material=steel and hammer_speed=low, first page", _page(_STEEL, _LOW)),
    Question("the same in one campaign", _page(_STEEL, _LOW, campaign=True)),
    Question("a level that ten impacts have", _page(Condition(RARE[0], "=", RARE[1]))),
    Question(
        "peak_force_n>2990 (one in a hundred), first page",
        _page(Condition("peak_force_n", ">", 2990.0)),
    ),
    Question("peak_force_n>1e9 (no match)", _page(_NONE)),
    Question("the same in one campaign", _page(_NONE, campaign=True)),
    Question("an impact's page, and 0.1 s of a channel", _impact_with_slice),
    Question(
        "overlaid pulses of a campaign",
        lambda s, n: pulse_overlay(s, _middle(n), (), "tip_material"),
    ),
    Question(
        "overlaid pulses of all impacts", lambda s, _: pulse_overlay(s, None, (), "tip_material")
    ),
    Question(
        "pulses for a dataset from one campaign",
        lambda s, n: select_pulses(s, [_middle(n)], None, "reject", None),
    ),
    Question("a campaign's pulses as Parquet", _export),
)


def measure(folder: Path) -> Measured:
    """All that the page shows, as plain data."""
    source = write_campaign(folder / "sample", 8, ".mat", np.random.default_rng(11))
    with open_store(f"sqlite:///{folder / 'sample.db'}", WRITER, create=True) as store:
        ingest_folder(store, source, jobs=1)
        sample = sample_of(store)
    sizes = [
        StoreSize(impacts, PER_CAMPAIGN, own_radii=True, sample=sample)
        for impacts in (SMALL, LARGE)
    ]
    with ExitStack() as stack:
        server = os.environ.get(SERVER_VARIABLE) or stack.enter_context(
            running_server(durable=True)
        )
        urls = [kept_store(server, size) for size in sizes]
        small, large = stores = [stack.enter_context(open_store(url, WRITER)) for url in urls]
        with large.reading() as session:
            version = str(session.scalars(select(func.current_setting("server_version"))).one())
        stores_json = [
            {name: getattr(size, name) for name in ("impacts", "campaigns", "recordings")}
            for size in sizes
        ]
        measured: Measured = {"machine": machine(), "server": version, "stores": stores_json}
        measured |= {"rooms": rooms(small, large), "frames_share": frames_share(large)}
        measured |= {"series": list(series_kinds(folder))}
        measured |= {
            "questions": [measured_question(question, stores, sizes) for question in QUESTIONS]
        }
        return measured | {"ingest": measured_ingest(server, urls[1], folder)}


def kept_store(server_url: str, size: StoreSize) -> str:
    """The store of this size on the server, filled where the server lacks it, at this software's
    revision; one that is half filled is filled anew."""
    server, name = (
        make_url(server_url).set(drivername="postgresql+psycopg"),
        f"pyroshock_scale_{size.impacts}",
    )
    unfinished = f"{name}_unfinished"
    with create_engine(
        server, isolation_level="AUTOCOMMIT", poolclass=NullPool
    ).connect() as connection:
        if not connection.scalar(
            text("SELECT count(*) FROM pg_database WHERE datname = :name"), {"name": name}
        ):
            connection.exec_driver_sql(f'DROP DATABASE IF EXISTS "{unfinished}" WITH (FORCE)')
            connection.exec_driver_sql(f'CREATE DATABASE "{unfinished}"')
            fill(server.set(database=unfinished).render_as_string(hide_password=False), size)
            connection.exec_driver_sql(f'ALTER DATABASE "{unfinished}" RENAME TO "{name}"')
    url = server.set(database=name).render_as_string(hide_password=False)
    engine = make_engine(url)
    upgrade(engine)
    engine.dispose()
    return url


def rooms(small: Store, large: Store) -> list[Measured]:
    """Bytes of every table (`index` None) and index in the two stores, the largest first."""
    sizes: list[dict[tuple[str, str | None], int]] = []
    for store in (small, large):
        with store.engine.connect() as connection:
            sizes.append(
                {(table, index): int(size) for table, index, size in connection.execute(_SIZES)}
            )
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
    """What raw series weigh, of made, measured and simulated campaigns, each in a store of its
    own."""
    made = write_campaign(folder / "made", 8, ".mat", np.random.default_rng(11))
    yield _series_row(
        "hammer: two channels, ten impacts in 10 s (`tests/support/records/hammer_recordings.py`)",
        made,
        folder,
    )
    measured = ROOT / "examples" / "modal-hammer-hit"
    yield _series_row(
        "hammer: two channels, one measured impact (`examples/modal-hammer-hit`)", measured, folder
    )
    plans = f"sqlite:///{folder / 'plans.db'}"
    for kind in ("hammer", "gun"):
        design = ("--kind", kind, "--runs", "6", "--repetitions", "5", "--seed", "1")
        run_python(*PYROSHOCK, "plan", "lhs", kind, *design, "--db", plans)
        run_python(*PYROSHOCK, "simulate", kind, "--out", folder / kind, "--db", plans)
        yield _series_row(f"{kind}: simulated by the virtual bench", folder / kind, folder)


def _series_row(kind: str, source: Path, folder: Path) -> Measured:
    channel = select(func.max(RecordedChannel.sampling_rate_hz), func.sum(RecordedChannel.samples))
    with open_store(f"sqlite:///{folder / source.name}.db", WRITER, create=True) as store:
        ingest_folder(store, source, jobs=1)
        with store.reading() as session:
            impacts = session.scalars(select(func.count()).select_from(Impact)).one()
            rate, samples = session.execute(channel).one()
            stored = session.scalars(select(func.sum(func.length(SeriesChunk.frame)))).one()
    per_impact = {
        "samples_per_impact": float(samples) / impacts,
        "bytes_per_impact": float(stored) / impacts,
    }
    return {"kind": kind, "rate_hz": float(rate), **per_impact}


def measured_question(
    question: Question, stores: Sequence[Store], sizes: Sequence[StoreSize]
) -> Measured:
    def ask(store: Store, size: StoreSize) -> None:
        with store.reading() as session:
            question.ask(session, size)

    pairs = zip(("small", "large"), stores, sizes, strict=True)
    seconds = take_turns(
        {name: partial(ask, store, size) for name, store, size in pairs}, QUESTION_REPEATS
    )
    print(f"{question.name}: {min(seconds['large']):.3g} s", flush=True)
    return {
        "name": question.name,
        **seconds,
        "plans": plans_of(stores[1], partial(ask, stores[1], sizes[1])),
    }


def plans_of(store: Store, ask: Callable[[], object]) -> Measured:
    """How many statements a question is, and the plan of the dearest: lines, from the last step to
    the first."""
    statements: list[tuple[str, Any]] = []

    def record(_connection: Any, _cursor: Any, statement: str, parameters: Any, *_: Any) -> None:
        if statement.lstrip().startswith("SELECT"):
            statements.append((statement, parameters))

    event.listen(store.engine, "before_cursor_execute", record)
    try:
        ask()
    finally:
        event.remove(store.engine, "before_cursor_execute", record)
    explain = "EXPLAIN (ANALYZE, BUFFERS, FORMAT JSON) "
    with store.engine.connect() as connection:
        plans = [
            connection.exec_driver_sql(explain + words, values).scalar_one()[0]
            for words, values in statements
        ]
    dearest = max(plans, key=lambda plan: float(plan["Execution Time"]))
    lines = list(_plan_lines(dearest["Plan"], 0))
    return {
        "statements": len(statements),
        "milliseconds": float(dearest["Execution Time"]),
        "lines": lines,
    }


def _plan_lines(node: Mapping[str, Any], depth: int) -> Iterator[str]:
    """`Index Scan on impacts by ix_impacts_campaign_id_id: 50 rows, 0.1 ms, 4 pages`."""
    silent = node["Node Type"] in _SILENT
    if not silent:
        names = (("on", "Relation Name"), ("by", "Index Name"))
        what = " ".join(
            [node["Node Type"], *(f"{word} {node[name]}" for word, name in names if name in node)]
        )
        loops = int(node["Actual Loops"])
        rows = f"{round(node['Actual Rows'] * loops):,} rows".replace(",", " ")
        pages = int(node.get("Shared Hit Blocks", 0)) + int(node.get("Shared Read Blocks", 0))
        times, spent = f" in {loops} turns" if loops > 1 else "", node["Actual Total Time"] * loops
        yield (
            f"{'  ' * depth}{what}: {rows}{times}, "
            f"{spent:{'.3g' if spent < 999 else '.0f'}} ms, {pages} pages"
        )
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


_PAGE = """## Set-up

PostgreSQL {server} with its default settings runs on the same machine as the client ({machine}). \
Times are the median (smallest to largest) of repeated questions in alternation, with warm caches.
The large store has {stores[1]}; the small store has {stores[0]}.
The columns of {target} are calculated for {campaigns:,} campaigns of the same size. Disk space, \
and times that grow more than twofold, follow the straight line through both stores; the other \
times grow once more by their measured factor.

## Questions

{questions}

These questions take more than {slow_s:g} s at {target} impacts:

{slow}

## Disk space

{rooms}

Raw series need additional space:

{series}

The table with its key takes {frames_extra:.2g} % more than its frames.

## Ingest

Each client ingests campaigns of {impacts} impacts (ten in a MATLAB recording of 10 s with two \
channels at 51.2 kHz) with `--jobs 1` and extracts the pulses:

{ingest}

The rate of the large store is {rate} times that of the new one.
One impact takes {processor} of the client's processor time,
and {target} impacts take {hours:.3g} hours, which several processors can share.

## Plans

For each question over {slow_s:g} s, this is the plan of its slowest statement in the large \
store, from the last step to the first. A page has 8 kB.
{plans}
"""


def page_of(measured: Measured) -> str:
    """Markdown: the stores, the questions with their growth, the plans, room, raw series,
    ingest."""
    small, large = measured["stores"]
    sizes = ("impacts", "campaigns", "recordings")
    ingest, processor_s = measured["ingest"], Spread.of(measured["ingest"]["full_processor_s"])
    return _PAGE.format(
        server=measured["server"], machine=measured["machine"], target=f"{TARGET:,}",
        slow_s=_SLOW_S,
        stores=[", ".join(f"{store[what]:,} {what}" for what in sizes) for store in (small, large)],
        campaigns=TARGET // (large["impacts"] // large["campaigns"]),
        **_questions(measured["questions"], small["impacts"], large["impacts"]),
        rooms=_rooms(measured["rooms"], small["impacts"], large["impacts"]),
        series=_series(measured["series"], float(measured["frames_share"])),
        frames_extra=100 * (float(measured["frames_share"]) - 1),
        impacts=ingest["impacts"], ingest=_ingest_rates(ingest), rate=ratio(ingest["full"],
        ingest["new"]).text(),
        processor=processor_s.text(" ms", 1e3), hours=TARGET * processor_s.median / 3600,
    )  # fmt: skip


def _questions(questions: Sequence[Measured], small: int, large: int) -> dict[str, str]:
    """The table, the slowest at the target, and the plans."""
    rows, slow, plans = [], [], []
    for question in questions:
        times = [Spread.of(question[store]) for store in ("small", "large")]
        growth, plan = ratio(question["large"], question["small"]), question["plans"]
        grows = growth.median > 2  # a tree that is a page deeper does not double a time
        on_line = times[1].median + (times[1].median - times[0].median) * (TARGET - LARGE) / (
            LARGE - SMALL
        )
        expected_s = on_line if grows else times[1].median * max(1.0, growth.median)
        cells = [_spread(t) for t in times]
        cells += [f"{growth.median:.2f}", _duration(expected_s), str(plan["statements"])]
        rows.append(table_row(question["name"], *cells))
        if expected_s <= _SLOW_S:
            continue
        growing = "grows with the store" if grows else "does not grow with the store"
        slow.append((expected_s, f"- {question['name']}: {_duration(expected_s)}; {growing}"))
        spent = f"{plan['milliseconds']:{'.3g' if plan['milliseconds'] < 999 else ',.0f'}}"
        plans += [
            f"\n{question['name']} (1 of {plan['statements']}, {spent} ms):\n",
            "```text",
            *plan["lines"],
            "```",
        ]
    head = ("question", f"{small:,}", f"{large:,}", "growth factor", f"{TARGET:,}", "statements")
    slowest = "\n".join(line for _, line in sorted(slow, key=lambda pair: -pair[0]))
    return {"questions": table(head, rows), "slow": slowest, "plans": "\n".join(plans)}


def _spread(spread: Spread) -> str:
    factor, unit, digits = (1e3, "ms", ".0f") if spread.high < 1 else (1.0, "s", ".2g")
    low, median, high = (
        f"{factor * each:{digits}}" for each in (spread.low, spread.median, spread.high)
    )
    return f"{median} {unit} ({low} to {high})"


def _duration(seconds: float) -> str:
    return f"{1e3 * seconds:.0f} ms" if seconds < 1 else f"{seconds:.2g} s"


def _rooms(rooms: Sequence[Measured], small: int, large: int) -> str:
    rows, total, total_bytes = [], 0.0, 0
    for room in rooms:
        if (
            room["table"] == "series_chunks"
        ):  # few recordings have series: their own table shows their room
            continue
        slope = float(room["large"] - room["small"]) / (large - small)
        at_target = float(room["large"]) + slope * (TARGET - large)
        total, total_bytes = total + at_target, total_bytes + room["large"]
        if at_target >= _SMALLEST:
            names = f"`{room['table']}`", f"`{room['index']}`" if room["index"] else ""
            rows.append(
                table_row(
                    *names, f"{room['large'] / 1e6:,.0f}", f"{slope:,.0f}", f"{at_target / 1e9:.3g}"
                )
            )
    sums = f"{total_bytes / 1e6:,.0f}", f"{total / TARGET:,.0f}", f"{total / 1e9:.3g}"
    head = ("table", "index", f"{large:,}: MB", "bytes per impact", f"{TARGET:,}: GB")
    return table(head, [*rows, table_row("all tables and indexes, without series", "", *sums)])


def _series(kinds: Sequence[Measured], share: float) -> str:
    rows = []
    for kind in kinds:
        nbytes = share * kind["bytes_per_impact"]
        room = f"{nbytes / 1e3:{'.3g' if nbytes < 999e3 else ',.0f'}}"
        rate, samples = f"{kind['rate_hz'] / 1e3:.3g}", f"{kind['samples_per_impact']:,.0f}"
        rows.append(table_row(kind["kind"], rate, samples, room, f"{nbytes * TARGET / 1e12:.3g}"))
    return table(
        ("recordings", "kHz", "samples per impact", "kB per impact", f"{TARGET:,}: TB"), rows
    )


def _ingest_rates(ingest: Measured) -> str:
    cases = (
        ("1", "new", "new"),
        ("1", "large", "full"),
        (str(ingest["clients"]), "large", "together"),
    )
    rates = [(clients, store, Spread.of(ingest[name])) for clients, store, name in cases]
    rows = (
        table_row(n, store, rate.text(), f"{TARGET / rate.median / 3600:.3g}")
        for n, store, rate in rates
    )
    return table(("clients", "store", "impacts per second", f"hours for {TARGET:,}"), rows)


def write(measured: Measured) -> None:
    """Everything below the mark of the document, anew."""
    above, mark, _ = DOCUMENT.read_text(encoding="utf-8").partition(MARK)
    if not mark:
        raise ValueError(f"{DOCUMENT} has no line {MARK!r} below which the figures go")
    DOCUMENT.write_text(above + MARK + "\n\n" + page_of(measured), encoding="utf-8")
    print(f"written: {DOCUMENT}")


def main(arguments: list[str]) -> int:
    with work_folder() as folder:
        values_file = folder / "scale.json"
        if arguments != ["--again"]:
            values_file.write_text(json.dumps(measure(folder), indent=1))
        write(json.loads(values_file.read_text()))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
