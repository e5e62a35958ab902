"""What a user waits for: commands from call to end, `import pyroshock` and its frames, and filtered
listings.

`python -m benchmarks start-up library listings` measures it.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pyroshock as ps
from pyroshock.schema.listings import Condition, iter_impacts
from pyroshock.schema.session import Store, open_store
from sqlalchemy import text

from .harness import (
    Figure,
    beside,
    interpreter_with,
    promised,
    run_program,
    run_python,
    take_turns,
)
from .ingest import ingest_once
from .shared_records import HITS, RARE, WRITER, campaign_name, filled, kept_campaign

COMMANDS = "Commands from call to end, in fresh processes"
LIBRARY = "The Python library: import, listings as DataFrames, slices of recordings"
LISTINGS = "Filtered listings with {:,} impacts against {:,}"
#: What `import pyroshock` may take beside Python's own start, and `store.impacts()` over
#: `pandas.read_sql`.
IMPORT_LIMIT_S, FRAME_LIMIT, LISTING_LIMIT = 0.15, 1.5, 2.0
SMALL, LARGE = 10_000, 1_000_000
_RECORDINGS, _SLICE = 4, 1000
_BIN = Path(sys.executable).parent
_PLAIN = "SELECT * FROM impacts AS i JOIN pulses AS p ON p.impact_id = i.id"
#: The columns of the listing that stand in tables; the library finds factors, quality and kind of
#: velocity as well.
_ROWS = """
    SELECT i.id, c.name AS campaign, i.run, i.repetition, i.configuration_id, i.recording_id,
           i.velocity_source, i.impact_velocity_m_s, p.contact_time_s, p.peak_force_n,
           p.impulse_n_s, p.compression_time_s, f.peak_acceleration_m_s2, f.pulse_duration_s,
           f.velocity_change_m_s
    FROM impacts AS i
    JOIN campaigns AS c ON c.id = i.campaign_id
    LEFT JOIN pulses AS p ON p.impact_id = i.id AND p.current
    LEFT JOIN channel_figures AS f ON f.impact_id = i.id AND f.largest
    ORDER BY i.id
"""

Run = Callable[[], object]


def measure_start_up(folder: Path, repeats: int = 5) -> Iterator[Figure]:
    """A command, its peers (None: not installed), and what bounds it."""
    (folder / "start-up").mkdir(exist_ok=True)
    ingest_once(kept_campaign(folder, _RECORDINGS, ".npz"), folder / "start-up", jobs=1)
    store = str(folder / "start-up" / "ingested.db")
    plain = f"import sqlite3; sqlite3.connect({store!r}).execute({_PLAIN!r}).fetchall()"
    frame = f"import sqlite3, pandas; pandas.read_sql({_PLAIN!r}, sqlite3.connect({store!r}))"

    def mlflow(option: str) -> dict[str, Run]:
        return {f"mlflow {option}": partial(run_program, [_BIN / "mlflow", option])}

    rows = f"Python that fetches the same {HITS * _RECORDINGS} rows with sqlite3"
    imports = {
        f"import {module}": _importing(module) for module in ("qcodes", "pyyeti.srs", "endaq.calc")
    }
    commands: tuple[tuple[list[str], Mapping[str, Run | None], str, str], ...] = (
        (["--version"], {**mlflow("--version"), **imports}, "Python that starts and ends", "pass"),
        (["--help"], mlflow("--help"), "Python that starts and ends", "pass"),
        (
            ["impacts", "--db", f"sqlite:///{store}"],
            {"pandas.read_sql": partial(run_python, "-c", frame)},
            rows,
            plain,
        ),
    )
    for words, peers, bound, limit in commands:
        runs = {
            "ours": partial(run_program, [_BIN / "pyroshock", *words]),
            "bound": partial(run_python, "-c", limit),
        }
        seconds = take_turns({**runs, **{peer: run for peer, run in peers.items() if run}}, repeats)
        for peer in peers:
            name = f"pyroshock {words[0]}"
            yield beside(
                COMMANDS, f"{name}; {peer}", seconds, peer, question=f"`{name}`", bound=bound
            )


def _importing(module: str) -> Run | None:
    python = interpreter_with(module.split(".")[0])
    return partial(run_program, [python, "-c", f"import {module}"]) if python else None


def measure_library(folder: Path, impacts: int = 100_000, repeats: int = 7) -> Iterator[Figure]:
    seconds = take_turns(
        {
            "import": partial(run_python, "-c", "import pyroshock"),
            "start": partial(run_python, "-c", "pass"),
        },
        repeats,
    )
    own = [max(a - b, 0.0) for a, b in zip(seconds["import"], seconds["start"], strict=True)]
    yield promised(
        LIBRARY, "import pyroshock, beyond Python's start", own, IMPORT_LIMIT_S,
        question="import of the library",
        bound="numpy, pandas, SQLAlchemy and torch are imported when they are used",
        peer_name="the promise",
    )  # fmt: skip
    with ps.open(filled(folder, impacts), create=False) as store:
        yield frame_figure(store, repeats)
    with ps.open(folder / "library.db") as store:
        store.ingest(kept_campaign(folder, 1, ".npz"), jobs=1, progress=False)
        recording = store.recording(int(store.impacts(limit=1)["id"].iloc[0]))
        channel = max(recording.values(), key=len)
        begin = len(channel) // 2
        whole = "the whole channel"
        seconds = take_turns(
            {"ours": lambda: channel[begin : begin + _SLICE], whole: lambda: channel[:]},
            3 * repeats,
        )
        yield beside(
            LIBRARY, f"recording[...][a:b], {_SLICE} of {len(channel):,} samples", seconds, whole,
            limit=1.0,
            bound="the chunks that the slice touches are fetched", question="slice of a recording",
        )  # fmt: skip


def frame_figure(store: Any, repeats: int) -> Figure:
    """`store.impacts()` of an `ExperimentStore` beside pandas. Raises `ValueError` where the two
    have other rows."""

    def read_sql() -> pd.DataFrame:
        with store.store.engine.connect() as connection:
            return pd.read_sql(text(_ROWS), connection)

    ours, peer = store.impacts(), read_sql()
    if not np.array_equal(ours["peak_force_n"], peer["peak_force_n"]):
        raise ValueError(
            "store.impacts() and read_sql have other rows; expected the same peak forces"
        )
    seconds = take_turns({"ours": store.impacts, "pandas.read_sql": read_sql}, repeats)
    return beside(
        LIBRARY, f"store.impacts(), {len(ours):,} of them, {store.store.engine.dialect.name}",
        seconds,
        "pandas.read_sql", limit=FRAME_LIMIT, question="listing as a DataFrame",
        bound="the fetch of the rows; ours adds factors, quality and kind of velocity, which "
        "pandas does not read",
    )  # fmt: skip


class Listing(NamedTuple):
    """A question whose answer has as many rows in the small store as in the large one."""

    name: str
    campaign: str | None
    where: tuple[Condition, ...]
    rows: int | None = None

    def keys(self, store: Store) -> list[int]:
        with store.reading() as session:
            return [
                row["id"]
                for row in islice(iter_impacts(session, self.campaign, self.where), self.rows)
            ]


_STEEL, _RARE = Condition("tip_material", "=", "steel"), Condition(RARE[0], "=", RARE[1])
_FAST, _SLOW = Condition("impact_velocity_m_s", ">", 1.4), Condition("hammer_speed", "=", "low")
_SMALL = Condition("tip_radius_m", "=", 0.03)
FILTERED = (
    Listing("one campaign and tip_material=steel", campaign_name(5), (_STEEL,)),
    Listing("one campaign and impact_velocity_m_s>1.4", campaign_name(3), (_FAST,)),
    Listing("hammer_speed=low, first 100 of a half", None, (_SLOW,), 100),
    Listing("tip_material=steel and tip_radius_m=0.03, first 100", None, (_STEEL, _SMALL), 100),
    Listing("a level that ten impacts have", None, (_RARE,)),
    Listing("one campaign and that level", campaign_name(1), (_RARE,)),
)


def measure_listings(folder: Path, large: int = LARGE, repeats: int = 15) -> Iterator[Figure]:
    """Every listing on two stores in `folder`. Raises `ValueError` when one gives another number of
    rows."""
    urls = filled(folder, SMALL), filled(folder, large)
    with open_store(urls[0], WRITER) as small, open_store(urls[1], WRITER) as many:
        for listing in FILTERED:
            counts = len(listing.keys(small)), len(keys := listing.keys(many))
            if counts[0] != counts[1] or not counts[0]:
                raise ValueError(
                    f"{listing.name}: {counts[0]} and {counts[1]} rows; expected the same, and some"
                )
            beside_small, by_key = f"ours with {SMALL:,} impacts", partial(_rows_by_key, many, keys)
            asked_of = {
                "ours": partial(listing.keys, many),
                beside_small: partial(listing.keys, small),
            }
            yield beside(
                LISTINGS.format(large, SMALL), listing.name, take_turns({**asked_of,
                "bound": by_key}, repeats),
                beside_small, limit=LISTING_LIMIT, question="a filtered listing as the store grows",
                kind="growth",
                bound=f"the driver's own fetch of the {counts[0]} rows by their keys",
            )  # fmt: skip


def _rows_by_key(store: Store, keys: list[int]) -> int:
    """The same impacts and pulses as tuples, whose keys are known already: neither searched, nor
    named, nor judged."""
    with store.reading() as session:
        statement = f"{_PLAIN} WHERE i.id IN ({','.join(map(str, keys))})"
        return len(session.connection().exec_driver_sql(statement).fetchall())
