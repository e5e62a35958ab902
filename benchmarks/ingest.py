"""The ingest of a campaign beside a program that reads its files and writes the series with h5py;
and its memory.

`python -m benchmarks.ingest FOLDER FILE.h5` is that peer.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Collection, Iterator
from functools import partial
from pathlib import Path

import numpy as np

from .harness import PYROSHOCK, Figure, beside, run_python, take_turns
from .shared_records import hammer_record, kept_campaign

RECORDINGS, LIMIT, MEMORY_LIMIT = 180, 1.5, 1.1
THEME = (
    "Ingest of {} recordings (10 s, two channels at 51.2 kHz, ten impacts each), "
    "extraction included"
)
MEMORY_THEME = "Peak memory of the ingest, all its processes together"
_LIBRARIES = (
    "import pyroshock.app.operations.ingest.folder, pyroshock.ingest.load, time; time.sleep(0.2)"
)
_FORMATS = {".mat": "MATLAB 5, uncompressed", ".npz": "NumPy .npz"}


def measure_ingest(
    folder: Path,
    recordings: int = RECORDINGS,
    repeats: int = 3,
    formats: Collection[str] = tuple(_FORMATS),
) -> Iterator[Figure]:
    """Time of the command over the peer's."""
    for suffix in formats:
        source = kept_campaign(folder, recordings, suffix)
        peer, copy = (
            "h5py, the series alone",
            ("-m", "benchmarks.ingest", source, folder / "peer.h5"),
        )
        commands = {peer: partial(run_python, *copy), "ours": partial(ingest_once, source, folder)}
        seconds = take_turns(commands, repeats, warm=False) | {
            "bound": _hash_and_compress_s(recordings, repeats)
        }
        yield beside(
            THEME.format(recordings), _FORMATS[suffix], seconds, peer, unit="s", limit=LIMIT,
            bound="hashing and compressing the same bytes on one processor",
            question="a campaign into the store",
        )  # fmt: skip


def ingest_once(
    source: Path, folder: Path, *, jobs: int | None = None, watch_memory: bool = False
) -> int:
    """The command in a fresh process, into a new SQLite store; its peak memory as `run_program`."""
    for old in folder.glob("ingested.db*"):
        old.unlink()
    options = [] if jobs is None else ["--jobs", str(jobs)]
    database = f"sqlite:///{folder / 'ingested.db'}"
    return run_python(
        *PYROSHOCK, "ingest", source, "--db", database, *options, watch_memory=watch_memory
    )


def copy_recordings(folder: Path, target: Path) -> None:
    """The peer: every recording of a campaign, its channels with gzip and shuffle in one HDF5
    file."""
    import h5py
    from scipy.io import loadmat

    with h5py.File(target, "w") as out:
        for path in sorted((folder / "recordings").iterdir()):
            group, recording = (
                out.create_group(path.name),
                np.load(path) if path.suffix == ".npz" else loadmat(path),
            )
            for name in ("force", "acceleration"):
                group.create_dataset(
                    name, data=recording[name].reshape(-1), compression="gzip", shuffle=True
                )


def _hash_and_compress_s(recordings: int, repeats: int) -> list[float]:
    """What no ingest can leave out: two hashes (file, series) and the compression."""
    from pyroshock.schema.series import encode_series

    channels = hammer_record(np.random.default_rng(7))
    content = b"".join(channel.tobytes() for channel in channels)

    def work() -> None:
        hashlib.sha256(content)
        for channel in channels:
            encode_series(channel)

    return [recordings * seconds for seconds in take_turns({"work": work}, repeats)["work"]]


def measure_memory(
    folder: Path, recordings: int = RECORDINGS, repeats: int = 3
) -> Iterator[Figure]:
    """Peak memory of larger and larger campaigns over that of the smallest, which is long enough
    for all to be busy."""

    def peaks(count: int, jobs: int) -> list[float]:
        source = kept_campaign(folder, count, ".mat")
        return [
            float(ingest_once(source, folder, jobs=jobs, watch_memory=True)) for _ in range(repeats)
        ]

    libraries = [float(run_python("-c", _LIBRARIES, watch_memory=True)) for _ in range(repeats)]
    for jobs, in_flight in ((1, 1), (2, 4)):
        smallest = peaks(recordings // 4, jobs)
        for count in (recordings // 2, recordings):
            peer = f"ours with {recordings // 4} recordings"
            yield beside(
                MEMORY_THEME, f"{count} recordings against {recordings // 4}, --jobs {jobs}",
                {"ours": peaks(count, jobs), peer: smallest, "bound": libraries}, peer, unit="MiB",
                limit=MEMORY_LIMIT,
                bound=f"{in_flight} x 4 MiB of recordings in flight at most, and one process that "
                "only loads the libraries",
                question="memory of an ingest as the campaign grows", kind="growth",
            )  # fmt: skip


if __name__ == "__main__":
    copy_recordings(Path(sys.argv[1]), Path(sys.argv[2]))
