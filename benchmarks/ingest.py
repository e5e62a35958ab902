"""The ingest of a campaign against only reading its files and writing the series with h5py; and its memory."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Collection, Iterator
from functools import partial
from pathlib import Path

import numpy as np
from pyroshock.schema.series import encode_series

from .figures import Figure
from .measuring import Child, Spread, interleaved, ratio, run_child
from .recordings import hammer_record, write_campaign

RECORDINGS, LIMIT = 180, 1.5
THEME = "Ingest of {} recordings (10 s, two channels at 51.2 kHz, ten impacts each), extraction included"
QUESTION = "a campaign into the store"
MEMORY_THEME = "Peak memory of the ingest, all its processes together"
#: Imports what the command does, and stays long enough for its memory to be seen.
_LIBRARIES = "import pyroshock.app.ingest.cli, pyroshock.ingest.load, time; time.sleep(0.2)"
_COMMAND = ("-c", "from pyroshock.app.cli.main import main; main()")
_FORMATS = {".mat": "MATLAB 5, uncompressed", ".npz": "NumPy .npz"}


def campaign(folder: Path, recordings: int, suffix: str) -> Path:
    """A campaign in `folder`, made where it is not there yet."""
    made = folder / f"campaign-{recordings}{suffix}"
    if not (made / "complete").exists():
        shutil.rmtree(made, ignore_errors=True)
        write_campaign(made, recordings, suffix, np.random.default_rng(7))
        (made / "complete").touch()
    return made


def measure_ingest(
    folder: Path, recordings: int = RECORDINGS, repeats: int = 3, formats: Collection[str] = tuple(_FORMATS)
) -> Iterator[Figure]:
    """Time of the command, by its default of processes and by one, over the peer's."""
    for suffix in formats:
        what = _FORMATS[suffix]
        source = campaign(folder, recordings, suffix)
        runs: dict[str, list[Child]] = {"peer": [], "default": [], "one": []}
        for _ in range(repeats):
            runs["peer"].append(_peer(source, folder))
            runs["default"].append(ingest_once(source, folder))
            runs["one"].append(ingest_once(source, folder, jobs=1))
        floor = [recordings * seconds for seconds in _floor_s()]
        figure = partial(_time_figure, THEME.format(recordings), peer=runs["peer"], floor=floor)
        yield figure(what, runs["default"], limit=LIMIT, question=QUESTION)
        yield figure(f"{what}, --jobs 1", runs["one"])


def ingest_once(source: Path, folder: Path, *, jobs: int | None = None, watch_memory: bool = False) -> Child:
    """The command in a fresh process, into a new SQLite store."""
    for old in folder.glob("ingested.db*"):
        old.unlink()
    options = [] if jobs is None else ["--jobs", str(jobs)]
    command: list[str | Path] = [*_COMMAND, "ingest", source, "--db", f"sqlite:///{folder / 'ingested.db'}"]
    return run_child([*command, *options], watch_memory=watch_memory)


def _peer(source: Path, folder: Path) -> Child:
    return run_child(["-m", "benchmarks.peer", source, folder / "peer.h5"])


def _time_figure(
    theme: str,
    name: str,
    ours: list[Child],
    *,
    peer: list[Child],
    floor: list[float],
    limit: float | None = None,
    question: str = "",
) -> Figure:
    walls, peers = [run.wall_s for run in ours], [run.wall_s for run in peer]
    own, other = (Spread.of(values).text(" s") for values in (walls, peers))
    nature = f"hashing and compressing the same bytes on one processor: {Spread.of(floor).text(' s')}"
    near = Spread.of([wall / Spread.of(floor).median for wall in walls])
    return Figure(
        theme, name, own, other, ratio(walls, peers), "at most", limit, nature, near=near, question=question,
        rival="h5py, the series alone",
    )  # fmt: skip


def _floor_s() -> list[float]:
    """Seconds per recording for what no ingest can leave out: two hashes (file, series) and the compression."""
    channels = hammer_record(np.random.default_rng(7))
    content = b"".join(channel.tobytes() for channel in channels)

    def work() -> None:
        hashlib.sha256(content)
        for channel in channels:
            encode_series(channel)

    return interleaved({"floor": work}, 15)["floor"]


def measure_memory(folder: Path, recordings: int = RECORDINGS, repeats: int = 3) -> Iterator[Figure]:
    """Peak memory of larger and larger campaigns over that of the smallest, which is long enough for all to be busy."""
    libraries = [run_child(["-c", _LIBRARIES], watch_memory=True).peak_bytes for _ in range(repeats)]
    for jobs in (1, 2):
        sizes = (recordings // 4, recordings // 2, recordings)
        peaks = {count: [_peak(folder, count, jobs) for _ in range(repeats)] for count in sizes}
        for count in sizes[1:]:
            most, least = (Spread.of(peaks[size]).text(" MiB", 2.0**-20) for size in (count, sizes[0]))
            name = f"{count} recordings against {sizes[0]}, --jobs {jobs}"
            flight = f"at most {2 * jobs if jobs > 1 else 1} x 4 MiB of recordings in flight"
            nature = (
                f"one process that only loads the libraries, {Spread.of(libraries).text(' MiB', 2.0**-20)}; {flight}"
            )
            yield Figure(
                MEMORY_THEME, name, most, least, ratio(peaks[count], peaks[sizes[0]]), "at most", 1.1, nature,
                near=ratio(peaks[count], libraries), question="memory of an ingest as the campaign grows", of="growth",
                rival=f"ours with {sizes[0]} recordings",
            )  # fmt: skip


def _peak(folder: Path, recordings: int, jobs: int) -> int:
    return ingest_once(campaign(folder, recordings, ".mat"), folder, jobs=jobs, watch_memory=True).peak_bytes
