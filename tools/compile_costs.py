"""What each compiled function costs a new installation: `make compile-costs`.

The commands of `COMMANDS` run one after the other in this process, in an empty folder and with an
empty cache, so that each function is compiled where it is first called. Times are of the processor.
"""

from __future__ import annotations

import contextlib
import io
import os
import sys
import tempfile
import time
from collections import defaultdict
from typing import Any

import click

#: Short ones that call every compiled function of the daily jobs.
COMMANDS = (
    "predict --tank-pressure 5bar --bullet-mass 0.5kg",
    "predict --velocity 8m/s --tip steel --effect contact.plate_compliance --draws 2",
    "predict --velocity 8m/s --anvil aluminium --draws 2",
    "plan lhs small --runs 12 --seed 1",
    "simulate small --out shots --repetitions 1 --jobs 1",
    "ingest shots --jobs 1",
    "diagnose small",
)


def compile_times() -> tuple[dict[str, list[float]], list[str]]:
    """Seconds of the processor for each variant of each function that is called from Python, with
    what it calls; and the commands that failed."""
    from numba.core import event

    seconds: dict[str, list[float]] = defaultdict(list)
    begun: list[float] = []

    class Listener(event.Listener):
        def on_start(self, _event: Any) -> None:
            begun.append(time.process_time())

        def on_end(self, compiled: Any) -> None:
            elapsed = time.process_time() - begun.pop()
            function = compiled.data["dispatcher"].py_func
            if not begun:
                name = f"{function.__module__}.{function.__qualname__}"
                seconds[name.removeprefix("pyroshock.")].append(elapsed)

    event.register("numba:compile", Listener())  # type: ignore[no-untyped-call]
    from pyroshock.app.doors.command_line.main import main

    failures = []
    for command in COMMANDS:
        screen = io.StringIO()
        with contextlib.redirect_stdout(screen), contextlib.redirect_stderr(screen):
            try:
                main(command.split(), standalone_mode=False)
            except (click.ClickException, SystemExit) as exc:
                failures.append(f"{command}: {exc}")
    return seconds, failures


def main() -> int:
    """The table on standard output."""
    with tempfile.TemporaryDirectory() as folder:
        os.environ["NUMBA_CACHE_DIR"] = folder
        os.chdir(folder)
        seconds, failures = compile_times()
        os.chdir("/")
    print("| compiled function | variants | CPU s, with what it calls |\n| --- | --- | --- |")
    for name, times in sorted(seconds.items(), key=lambda item: -sum(item[1])):
        print(f"| `{name}` | {len(times)} | {sum(times):.2f} |")
    print(f"| all | {sum(map(len, seconds.values()))} | {sum(map(sum, seconds.values())):.2f} |")
    for failure in failures:
        print(failure, file=sys.stderr)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
