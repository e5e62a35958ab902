"""One process of the campaign: inputs for one target, until there were enough or one of them ends
the process.

With atheris (libFuzzer), inputs that reach new lines are kept and damaged further; the plain engine
damages the seeds. It is forked from a process that has imported everything (`prepare`), because one
damaged file may end it early.
"""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import json
import os
import resource
import signal
import sys
import tempfile
import time
from pathlib import Path
from random import Random

from fuzzing.target import ACCEPTED, FINDING, REFUSED, SET_ASIDE, Outcome, Target, judge

#: Of one input: processor time, time on the clock (the machine may have other work), memory above
#: the libraries'.
MOST_CPU_S, MOST_WALL_S, MOST_BYTES = 5.0, 60.0, 2**30
#: Of a file that the ingest reads in a process of its own, which ends after 3 s
#: (`ingest.readers.patience`).
HANGING_CPU_S = 1.0
_LIBRARIES = [
    "h5py", "nptdms", "pyuff", "lvm_read", "pyarrow.parquet", "scipy.io", "pandas", "pint",
    "tomllib", "zipfile",
    "fuzzing.targets",
]  # fmt: skip
_LONGEST_INPUT, _MOST_KEPT = 1 << 17, 500


def engine() -> str:
    return "plain" if importlib.util.find_spec("atheris") is None else "atheris"


def prepare() -> None:
    """Import everything, with counters in the branches that guide atheris."""
    if engine() == "atheris":
        import atheris

        with atheris.instrument_imports(include=list(PACKAGES)):
            _import_all()
    _import_all()


def _import_all() -> None:
    for library in (*_LIBRARIES, "fuzzing.targets"):
        importlib.import_module(library)


def work(name: str, inputs: int, seed: int, folder: Path) -> None:
    """Ends this process: exit code 0 after `inputs`, a signal's where one took too long or crashed
    a library."""
    from fuzzing.targets import TARGETS

    os.setpgid(0, 0)
    with (folder / "log.txt").open("ab") as log:
        os.dup2(log.fileno(), 1)
        os.dup2(log.fileno(), 2)
    run = _Run(TARGETS[name], inputs, folder)
    if engine() == "atheris" and not TARGETS[name].may_crash:  # libhdf5 has no counters to guide by
        run.guided(seed)
    else:
        run.plain(seed)
    os._exit(0)  # past what libraries do at an exit, under limits that are not meant for it


class _Run:
    def __init__(self, target: Target, inputs: int, folder: Path) -> None:
        self.target, self.inputs, self.folder = target, inputs, folder
        self.seeds = list(target.seeds())
        memory = Path("/dev/shm")
        self.scratch = (
            Path(
                tempfile.mkdtemp(prefix="pyroshock-fuzz-", dir=memory if memory.is_dir() else None)
            )
            / "x"
        )
        self._warm_up()
        self.tally = Tally(folder)
        self.fresh = True  # whether the input is a new one, and none of the corpus
        _limit_memory()

    def _warm_up(self) -> None:
        """What the first input of a process costs (imports, compiled loops) is not the input's."""
        for data in self.seeds:
            judge(self.target, data, self.scratch)

    def plain(self, seed: int) -> None:
        """Inputs that were accepted are damaged further."""
        rng, pool = Random(seed), list(self.seeds)
        while self.tally.counts["inputs"] < self.inputs:
            data = self.target.mutate(rng.choice(pool), rng, self.seeds)
            if self.one(data) == ACCEPTED and len(pool) < _MOST_KEPT:
                pool.append(data)
                self._keep(data)

    def _keep(self, data: bytes) -> None:
        (self.folder / "corpus").mkdir(exist_ok=True)
        (self.folder / "corpus" / hashlib.sha256(data).hexdigest()).write_bytes(data)

    def guided(self, seed: int) -> None:
        """What is kept lies in `corpus`, and is where the next process begins."""
        import atheris

        corpus = self.folder / "corpus"
        corpus.mkdir(exist_ok=True)
        for number, data in enumerate(self.seeds):
            (corpus / f"seed-{number}").write_bytes(data)
        self.fresh = False
        given = [
            "-runs=1000000000",
            f"-seed={seed}",
            "-timeout=0",
            "-rss_limit_mb=0",
            f"-max_len={_LONGEST_INPUT}",
        ]
        given += [f"-handle_{name}=0" for name in ("segv", "bus", "abrt", "ill", "fpe")]
        atheris.Setup(
            [sys.argv[0], *given, str(corpus)], self._guided_one, custom_mutator=self._mutated
        )
        atheris.Fuzz()

    def _guided_one(self, data: bytes) -> None:
        self.one(data)
        self.fresh = False
        if self.tally.counts["inputs"] >= self.inputs:
            os._exit(0)  # libFuzzer counts the corpus too, and would go on

    def _mutated(self, data: bytes, max_size: int, seed: int) -> bytes:
        import atheris

        self.fresh = True
        rng = Random(seed)
        if rng.random() < 0.1:
            return bytes(atheris.Mutate(data, max_size))
        # What is kept is mostly what was refused at a line of its own: every other input starts
        # from a good file.
        start = bytes(data) if len(data) > 1 and rng.random() < 0.5 else rng.choice(self.seeds)
        return self.target.mutate(start, rng, self.seeds)[:max_size]

    def one(self, data: bytes) -> str:
        """What came of an input. Those of the corpus, which each process reads again, are not
        counted anew."""
        self.tally.begin(data)
        _watch(HANGING_CPU_S if self.target.may_crash else MOST_CPU_S, MOST_WALL_S)
        before = time.process_time()
        outcome = judge(self.target, data, self.scratch)
        used = time.process_time() - before
        _watch(0, 0)
        if self.fresh:
            self.tally.end(data, outcome, used)
        return outcome.kind


def _watch(cpu_s: float, wall_s: float) -> None:
    """The process dies of the signals, also inside a C library."""
    signal.setitimer(signal.ITIMER_PROF, cpu_s)
    signal.setitimer(signal.ITIMER_REAL, wall_s)


def _limit_memory() -> None:
    """What asks for more gets a MemoryError, or crashes."""
    status = Path("/proc/self/status").read_text()
    now = 1024 * int(
        next(line for line in status.splitlines() if line.startswith("VmData")).split()[1]
    )
    resource.setrlimit(resource.RLIMIT_DATA, (now + MOST_BYTES, resource.RLIM_INFINITY))


Counts = dict[str, float]
_EMPTY: Counts = {
    "inputs": 0,
    ACCEPTED: 0,
    REFUSED: 0,
    SET_ASIDE: 0,
    FINDING: 0,
    "slowest_s": 0.0,
    "peak_mb": 0.0,
}


class Tally:
    """Counts of one target in `folder`, the input that is in use, and one file per cause of a
    finding."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        self.counts = read_counts(folder)
        self.before_mb = peak_mb()

    def begin(self, data: bytes) -> None:
        (self.folder / "current").write_bytes(data)

    def end(self, data: bytes, outcome: Outcome, cpu_s: float) -> None:
        """`peak_mb` is above what the libraries themselves take."""
        self.counts["inputs"] += 1
        self.counts[outcome.kind] += 1
        if cpu_s > self.counts["slowest_s"]:
            self.counts["slowest_s"] = cpu_s
            (self.folder / "slowest").write_bytes(data)
        self.counts["peak_mb"] = max(self.counts["peak_mb"], peak_mb() - self.before_mb)
        if outcome.kind == FINDING:
            keep(self.folder, data, outcome.where, outcome.detail)
        self._write()

    def _write(self) -> None:
        new = self.folder / "counts.new"
        new.write_text(json.dumps(self.counts))
        new.replace(self.folder / "counts.json")


def keep(folder: Path, data: bytes, where: str, detail: str) -> None:
    """The smallest input of each cause, for reproduction."""
    name = f"finding-{hashlib.sha256(where.encode()).hexdigest()[:10]}"
    file = folder / name
    if not file.exists() or file.stat().st_size > len(data):
        file.write_bytes(data)
        (folder / f"{name}.txt").write_text(
            f"{where}\n\n{detail}", encoding="utf-8", errors="backslashreplace"
        )


def read_counts(folder: Path) -> Counts:
    file = folder / "counts.json"
    return dict(_EMPTY) | (json.loads(file.read_text()) if file.exists() else {})


def peak_mb() -> float:
    """ru_maxrss is in KiB on Linux."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


PACKAGES = (
    *(
        "pyroshock.ingest",
        "pyroshock.doe.toml_space",
        "pyroshock.doe.space",
        "pyroshock.doe.factors",
    ),
    *(
        "pyroshock.doe.designs.imported",
        "pyroshock.dataset.predictors",
        "pyroshock.schema.known_factors",
    ),
    *(
        "pyroshock.files.delimited_text",
        "pyroshock.signals.modal_table",
        "pyroshock.twin.plate.table",
        "pyroshock.twin.srs.target_csv",
        "pyroshock.twin.srs.target",
    ),
    *(
        "pyroshock.app.operations.impacts.spectra",
        "pyroshock.app.twins.benches",
        "pyroshock.app.web.uploads",
    ),
    *("nptdms", "pyuff", "lvm_read", "zipfile", "tomllib"),
)
