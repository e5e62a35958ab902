"""A plan played on the virtual bench: a campaign folder as a real bench would leave it, and a
sealed envelope.

A simulated campaign has its folder's name when all of it is there: it grows beside its place.
"""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..parallel.executor import ExecutorConfig, usual_jobs
from ..parallel.map_tasks import run_all_tasks
from ..parallel.task import one_thread
from .campaigns.base import RecordingTask, Row, Truth, VirtualBench
from .campaigns.gun import VirtualGunBench
from .campaigns.gun import set_up as set_up_gun
from .campaigns.hammer import set_up as set_up_hammer
from .effects import Effects
from .gun.fire import Trigger
from .recorder import (
    RECORDING_FORMATS,
    CampaignCard,
    Seal,
    folder_hash,
    seal_path,
    write_card,
    write_recording,
    write_runs,
    write_seal,
)


@contextmanager
def whole_folder(out: Path) -> Iterator[Path]:
    """A context that gives the folder to write to, and its seal beside it; after the block both are
    at `out`.

    What an error leaves goes at once, so that a repeat may begin; what a kill left goes with the
    next folder of that name. The campaign takes its place before its seal does: the two cannot in
    one step.

    Parameters:
        out: The folder of the finished campaign, new or empty before.
    """
    place = out.resolve()  # of a link, the folder that it stands for
    place.parent.mkdir(parents=True, exist_ok=True)
    for abandoned_path in _left_by_the_dead(place):
        _remove(abandoned_path)
    partial = place.with_name(f".{place.name}.{os.getpid()}.part")
    partial.mkdir()
    try:
        yield partial
        partial.replace(place)
        seal_path(partial).replace(seal_path(out))
    finally:
        _remove(partial)


def _left_by_the_dead(place: Path) -> Iterator[Path]:
    form = re.compile(rf"\.{re.escape(place.name)}\.(\d+)\.part")
    for path in list(place.parent.iterdir()):
        name_match = form.fullmatch(path.name)
        if name_match is not None and not _lives(int(name_match[1])):
            yield path


def _lives(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:  # somebody else's
        pass
    return True


def _remove(partial: Path) -> None:
    shutil.rmtree(partial, ignore_errors=True)
    seal_path(partial).unlink(missing_ok=True)


#: Called with (done, total, what) after each recording.
Progress = Callable[[int, int, str], None]

#: Kind of campaign to what sets its bench up for a plan.
KINDS: Mapping[str, Callable[..., VirtualBench]] = {
    "hammer": set_up_hammer,
    "gun": set_up_gun,
}

_DESCRIPTION = "Recorded on the virtual bench."
#: A fixed day: the same arguments give the same bytes.
_DATE = "2026-01-01"


@dataclass(frozen=True)
class SimulatedCampaign:
    """What was written where; `hits` are impacts or shots."""

    folder: Path
    seal: Path
    recordings: int
    hits: int


def simulate(
    plan_rows: Sequence[Row],
    kind: str,
    out: Path,
    *,
    seed: int,
    effects: Effects,
    repetitions: int = 10,
    jobs: int | None = None,
    progress: Progress | None = None,
    name: str | None = None,
    date: str = _DATE,
    suffix: str = ".npz",
    trigger: Trigger | None = None,
    echoes: bool = False,
    runs: Collection[int] | None = None,
) -> SimulatedCampaign:
    """Play every row of a plan into a campaign folder, and seal the truth beside it.

    The files depend on the arguments other than `jobs` and on nothing else. The folder is there
    when all of it is: after a kill a repeat begins anew.

    Parameters:
        plan_rows: Column to text for each run of the plan; `run` is a whole number, each once.
        kind: The bench of the campaign, "hammer" or "gun".
        out: The campaign folder, new or empty.
        seed: Seed of all that is random, 0 or more.
        effects: Which effects act, and how strongly.
        repetitions: How often each row is played; 10 by default. A hammer's row gives one recording
            with that many hits, a gun's row that many recordings.
        jobs: The number of processes; by default one per processor, four at most.
        progress: Called with (done, total, what) after each recording, where the last is the path
            of the recording in the folder; by default nothing is called.
        name: What the campaign is called; by default as its folder.
        date: The day that campaign.toml states; "2026-01-01" by default, so that the same arguments
            give the same files.
        suffix: The format of the recordings, ".npz" by default or ".mat".
        trigger: When the recordings of a gun begin; by default 0.3 s before the tank has lost 5 %
            of its pressure.
        echoes: Whether the edges of the plate act on what strikes it; by default the plate has none
            while it is struck.
        runs: Numbers of the runs to play, of those in the plan; by default all. Their recordings
            are those of the whole campaign.

    Returns:
        What was written, and where.

    Raises:
        ValueError: For what cannot be played, and for a folder that is not empty, before anything
            is written.
    """
    _check(plan_rows, kind, out, seed, repetitions, suffix)
    _check_runs(plan_rows, runs)
    if trigger is not None and kind != "gun":
        raise ValueError(
            f"a trigger on the tank's pressure for a {kind} campaign: expected a plan of kind 'gun'"
        )
    # One thread of linear algebra for each process: more get into each other's way, and change the
    # last bits.
    with one_thread(), whole_folder(out) as partial:
        sequence = np.random.SeedSequence(seed)
        bench = KINDS[kind](
            plan_rows, effects, np.random.default_rng(sequence.spawn(1)[0]), echoes=echoes
        )
        if trigger is not None:
            assert isinstance(bench, VirtualGunBench)  # _check
            bench = replace(bench, trigger=trigger)
        all_tasks = bench.tasks(plan_rows, repetitions)
        seeded = [
            (task, task_seed)
            for task, task_seed in zip(all_tasks, sequence.spawn(len(all_tasks)), strict=True)
            if runs is None or int(task.cells["run"]) in runs
        ]
        tasks = [task for task, _ in seeded]
        executor = ExecutorConfig(jobs=min(jobs or usual_jobs(), len(tasks)))
        truths_by_recording: dict[str, list[Truth]] = {}
        shared = (bench, partial, suffix)
        with closing(run_all_tasks(executor, _make, seeded, shared=shared)) as made:
            for (task, _), truth in made:
                truths_by_recording[task.name] = truth
                if progress:
                    progress(len(truths_by_recording), len(tasks), _path(task, suffix))
        truths = [truths_by_recording[task.name] for task in tasks]
        write_runs(partial, [{**task.cells, "recording": _path(task, suffix)} for task in tasks])
        write_card(
            partial,
            CampaignCard(name or out.name, kind, date, bench.sensors, _DESCRIPTION, bench.stages()),
        )
        truth_rows = [
            {
                "run": int(task.cells["run"]),
                "repetition": int(task.cells["repetition"]),  # of the first hit
                "recording": _path(task, suffix),
                "hits": hits,
            }
            for task, hits in zip(tasks, truths, strict=True)
        ]
        write_seal(
            partial,
            Seal(kind, seed, effects.as_json(), truth_rows, folder_hash(partial), echoes=echoes),
        )
    return SimulatedCampaign(out, seal_path(out), len(tasks), sum(len(hits) for hits in truths))


def _check(
    rows: Sequence[Row], kind: str, out: Path, seed: int, repetitions: int, suffix: str
) -> None:
    if kind not in KINDS:
        raise ValueError(f"kind of campaign {kind!r}; expected one of {', '.join(KINDS)}")
    if suffix not in RECORDING_FORMATS:
        raise ValueError(f"format {suffix!r}; expected one of {', '.join(RECORDING_FORMATS)}")
    if not rows:
        raise ValueError("plan: no rows; expected at least one run")
    if repetitions < 1 or seed < 0:
        raise ValueError(
            f"repetitions = {repetitions!r}, seed = {seed!r}; expected 1 or more, and 0 or more"
        )
    runs = [str(row.get("run", "")) for row in rows]
    wrong = next((run for run in runs if not run.isdigit() or runs.count(run) > 1), None)
    if wrong is not None:
        raise ValueError(f"plan: run {wrong!r}; expected whole numbers, each once")
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise ValueError(f"{out}: there is something already; expected a new or empty folder")
    if seal_path(out).exists():
        raise ValueError(
            f"{seal_path(out)}: there is a seal already; expected a new name for the folder"
        )


def _check_runs(rows: Sequence[Row], runs: Collection[int] | None) -> None:
    if runs is None:
        return
    planned = {int(row["run"]) for row in rows}
    if not runs or not planned.issuperset(runs):
        raise ValueError(f"runs {sorted(runs)}; expected one or more of the plan's {len(planned)}")


def _path(task: RecordingTask, suffix: str) -> str:
    return f"recordings/{task.name}{suffix}"


def _make(
    item: tuple[RecordingTask, np.random.SeedSequence], bench: VirtualBench, out: Path, suffix: str
) -> list[Truth]:
    """What was played; its recording is written."""
    task, seed = item
    try:
        taken = bench.take(task, np.random.default_rng(seed))
    except ValueError as error:
        raise ValueError(f"recording {task.name}: {error}") from error
    write_recording(out / _path(task, suffix), taken.channels, bench.sampling_rate_hz)
    return list(taken.truths)
