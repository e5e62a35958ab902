"""How true the remaining time is that long commands tell.

`python -m benchmarks.estimates DB [COMMAND…]` runs commands of a store with the campaign
"rehearsal", as `pyroshock demo` leaves it, and prints for each the time until the first estimate
and the error of the estimate at half time. The clock is the command's own: what else the machine
does lengthens both. The store is copied first and stays as it is.
"""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from .harness import run_python, table, table_row

#: Aim: the error at half time, over the time that really remained.
MOST_ERROR = 0.3
#: {db} is the copy of the store, {out} an empty folder beside it.
COMMANDS = {
    "simulate": "simulate rehearsal --out {out}/again --name again --db {db}",
    "ingest": "ingest {out}/again --jobs 1 --db {db}",
    "train": "train guns --models linear,pls,tree,svr,hann --split configurations --db {db}",
    "predict": "predict --plan rehearsal --db {db}",
    "tune": "tune --target {out}/component.csv --measured rehearsal --db {db}",
    "validate": "validate rehearsal --folds 4 --draws 20 --db {db}",
    "diagnose": "diagnose rehearsal --db {db}",
    "blind-check": "blind-check --cases 1 --seed 7 --db {db}",
    "db copy": "db copy {db} sqlite:///{out}/copied.db",
    "db check": "db check --db {db}",
}
#: Runs a command and writes its seconds, and the estimate twenty times a second.
_CHILD = """
import json, sys, threading, time
from pyroshock.app.common import progress
samples, begin = [], time.monotonic()
enter = progress.WorkProgress.__enter__
def watched(bar):
    step = enter(bar)
    def watch():
        while not bar._end.wait(0.05):
            samples.append((time.monotonic() - begin, bar._remaining.estimate_s()))
    threading.Thread(target=watch, daemon=True).start()
    return step
progress.WorkProgress.__enter__ = watched
from pyroshock.app.doors.command_line.main import main
if __name__ == "__main__":
    file, *words = sys.argv[1:]
    main(words, standalone_mode=False)
    with open(file, "w") as report:
        json.dump([time.monotonic() - begin, samples], report)
"""


@dataclass(frozen=True)
class Estimates:
    """Of one command: its seconds, and (seconds, estimate in seconds or None) while it worked."""

    total_s: float
    samples: Sequence[tuple[float, float | None]]

    @property
    def first_share(self) -> float | None:
        """The share of the time at which the first estimate was told; None where none was."""
        return next((now / self.total_s for now, told in self.samples if told is not None), None)

    @property
    def half_error(self) -> float | None:
        """The error of the estimate at half time, over the time that remained; None where nothing
        was told then."""
        now, estimate_s = next(
            (sample for sample in self.samples if sample[0] >= self.total_s / 2), (0.0, None)
        )
        return None if estimate_s is None else estimate_s / (self.total_s - now) - 1.0

    def row(self, name: str) -> str:
        first, error = self.first_share, self.half_error
        return table_row(
            name,
            f"{self.total_s:.0f} s",
            "never" if first is None else f"{first:.0%}",
            "nothing told" if error is None else f"{error:+.0%}",
        )


def estimates_of(words: Sequence[str], folder: Path) -> Estimates:
    """A command in a process of its own. Raises `CalledProcessError` where it fails."""
    script, report = folder / "watched_command.py", folder / "estimates.json"
    script.write_text(_CHILD, encoding="utf-8")
    run_python(script, report, *words)
    total_s, samples = json.loads(report.read_text(encoding="utf-8"))
    return Estimates(total_s, samples)


def main(store: Path, names: Sequence[str]) -> int:
    """Prints a row for each command; 1 where an estimate at half time is further off than
    `MOST_ERROR`."""
    errors = []
    rows = []
    with TemporaryDirectory() as name:
        folder = Path(name)
        copied = folder / store.name
        shutil.copy(store, copied)
        examples = Path(__file__).resolve().parents[1] / "examples"
        shutil.copy(examples / "specifications" / "component.csv", folder)
        for command in names or COMMANDS:
            text = COMMANDS[command].format(db=f"sqlite:///{copied}", out=folder)
            if command == "train":
                dataset = "dataset build guns --from rehearsal --db"
                run_python("-m", "pyroshock", *dataset.split(), f"sqlite:///{copied}")
            estimates = estimates_of(text.split(), folder)
            rows.append(estimates.row(command))
            errors.append(estimates.half_error or 0.0)
    head = ("command", "time", "first estimate after", "error at half time")
    sys.stdout.write(table(head, rows) + "\n")
    return 1 if max(map(abs, errors)) > MOST_ERROR else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), sys.argv[2:]))
