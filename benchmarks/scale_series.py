"""What raw series weigh, of several kinds of recordings: bytes of stored frames for each impact."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pyroshock.ingest.load import ingest_folder
from pyroshock.schema.impacts import Impact
from pyroshock.schema.recordings import RecordedChannel, SeriesChunk
from pyroshock.schema.session import Store, Writer, open_store
from sqlalchemy import func, select

from .measuring import ROOT, run_child
from .recordings import write_campaign

_COMMAND = ("-c", "from pyroshock.app.cli.main import main; main()")


@dataclass(frozen=True)
class Series:
    """Recordings of one kind: how fast they were sampled, and what an impact has of them on the average."""

    kind: str
    rate_hz: float
    samples_per_impact: float
    bytes_per_impact: float


def measure_series(folder: Path) -> Iterator[Series]:
    """Made, measured and simulated campaigns, each in a store of its own."""
    made = write_campaign(folder / "made", 8, ".mat", np.random.default_rng(11))
    measured = ROOT / "examples" / "modal-hammer-hit"
    yield _series("hammer: two channels, ten impacts in 10 s (`benchmarks/recordings.py`)", made, folder)
    yield _series("hammer: two channels, one measured impact (`examples/modal-hammer-hit`)", measured, folder)
    for kind in ("hammer", "gun"):
        yield _series(f"{kind}: simulated by the virtual bench", _simulated(folder, kind), folder)


def _simulated(folder: Path, kind: str) -> Path:
    """A small plan of the kind, played on the virtual bench."""
    plans = f"sqlite:///{folder / 'plans.db'}"
    design = ("--kind", kind, "--runs", "6", "--repetitions", "5", "--seed", "1")
    run_child([*_COMMAND, "plan", "lhs", kind, *design, "--db", plans])
    run_child([*_COMMAND, "simulate", kind, "--out", folder / kind, "--db", plans])
    return folder / kind


def _series(kind: str, source: Path, folder: Path) -> Series:
    with open_store(f"sqlite:///{folder / source.name}.db", Writer("benchmark", "0"), create=True) as store:
        ingest_folder(store, source, jobs=1)
        return _weighed(store, kind)


def _weighed(store: Store, kind: str) -> Series:
    with store.reading() as session:
        impacts = session.scalars(select(func.count()).select_from(Impact)).one()
        rate, samples = session.execute(
            select(func.max(RecordedChannel.sampling_rate_hz), func.sum(RecordedChannel.samples))
        ).one()
        stored = session.scalars(select(func.sum(func.length(SeriesChunk.frame)))).one()
        return Series(kind, float(rate), float(samples) / impacts, float(stored) / impacts)
