"""`import pyroshock` and what a notebook reads through it, beside pandas and beside what is read whole."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyroshock as ps
from pyroshock.app.experiment_store import ExperimentStore

from .figures import Figure
from .limits import starting
from .listings import filled
from .measuring import Spread, interleaved, ratio, run_child
from .recordings import write_campaign

THEME = "The Python library: import, listings as DataFrames, slices of recordings"
#: What `import pyroshock` may take, beside Python's own start.
IMPORT_LIMIT_S = 0.15
#: `store.impacts()` over `pandas.read_sql` of the same rows.
FRAME_LIMIT = 1.5
_SAMPLES = 1000
#: The columns of the listing that stand in tables; the library finds factors, quality and kind of velocity as well.
_ROWS = """
    SELECT i.id, c.name AS campaign, i.run, i.repetition, i.configuration_id, i.recording_id, i.velocity_source,
           i.impact_velocity_m_s, p.contact_time_s, p.peak_force_n, p.impulse_n_s, p.compression_time_s,
           f.peak_acceleration_m_s2, f.pulse_duration_s, f.velocity_change_m_s
    FROM impacts AS i
    JOIN campaigns AS c ON c.id = i.campaign_id
    LEFT JOIN pulses AS p ON p.impact_id = i.id AND p.current
    LEFT JOIN channel_figures AS f ON f.impact_id = i.id AND f.largest
    ORDER BY i.id
"""


def measure_library(folder: Path, impacts: int = 100_000, repeats: int = 7) -> Iterator[Figure]:
    """Stores are made in `folder` where they are not there yet."""
    yield _import(repeats)
    with ps.open(filled(folder, impacts), create=False) as store:
        yield frame_figure(store, repeats)
    yield _slice(folder, repeats)


def _import(repeats: int) -> Figure:
    taken = interleaved({"import": partial(run_child, ["-c", "import pyroshock"]), "start": starting}, repeats)
    own = [max(a - b, 0.0) for a, b in zip(taken["import"], taken["start"], strict=True)]
    return Figure(
        THEME, "import pyroshock, beyond Python's start", Spread.of(own).text(" ms", 1e3),
        f"{IMPORT_LIMIT_S * 1e3:.0f} ms", Spread.of([seconds / IMPORT_LIMIT_S for seconds in own]), "at most", 1.0,
        "no numpy, pandas, SQLAlchemy or torch is imported before it is used", question="import of the library",
        of="bound", rival="the promise",
    )  # fmt: skip


def frame_figure(store: ExperimentStore, repeats: int) -> Figure:
    """`store.impacts()` beside pandas. Raises `ValueError` where the two have other rows."""
    ours, peer = store.impacts(), _read_sql(store)
    if not np.array_equal(ours["peak_force_n"], peer["peak_force_n"]):
        raise ValueError("store.impacts() and read_sql have other rows; expected the same peak forces")
    taken = interleaved({"ours": store.impacts, "peer": partial(_read_sql, store)}, repeats)
    return Figure(
        THEME, f"store.impacts(), {len(ours):,} of them, {store.store.engine.dialect.name}",
        Spread.of(taken["ours"]).text(" ms", 1e3), Spread.of(taken["peer"]).text(" ms", 1e3),
        ratio(taken["ours"], taken["peer"]), "at most", FRAME_LIMIT,
        "the fetch of the rows; factors, quality and kind of velocity, which pandas does not read, come on top",
        question="listing as a DataFrame", rival="pandas.read_sql",
    )  # fmt: skip


def _read_sql(store: ExperimentStore) -> pd.DataFrame:
    with store.store.engine.connect() as connection:
        from sqlalchemy import text

        return pd.read_sql(text(_ROWS), connection)


def _slice(folder: Path, repeats: int) -> Figure:
    source = folder / "library"
    if not (source / "complete").exists():
        write_campaign(source, 1, ".npz", np.random.default_rng(3))
        (source / "complete").touch()
    with ps.open(folder / "library.db") as store:
        store.ingest(source, jobs=1, progress=False)
        recording = store.recording(int(store.impacts(limit=1)["id"].iloc[0]))
        channel = max(recording.values(), key=len)
        middle = len(channel) // 2
        slices: dict[str, Any] = {
            "slice": lambda: channel[middle : middle + _SAMPLES],
            "whole": lambda: channel[:],
        }
        taken = interleaved(slices, 3 * repeats)
        return Figure(
            THEME, f"recording[...][a:b], {_SAMPLES} of {len(channel):,} samples",
            Spread.of(taken["slice"]).text(" ms", 1e3), Spread.of(taken["whole"]).text(" ms", 1e3),
            ratio(taken["slice"], taken["whole"]), "at most", 1.0, "the chunks that the slice touches are fetched",
            question="slice of a recording", rival="the whole channel",
        )  # fmt: skip
