"""How many lines of the sources a run has reached: its corpus once more, under coverage.py."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

from fuzzing.campaign import slug
from fuzzing.target import Target, judge

_REPOSITORY = Path(__file__).resolve().parents[2]
_MOST_INPUTS = 1500


def reached(targets: Iterable[Target], folder: Path) -> dict[str, str]:
    """Share of the watched lines by target's name; "-" without coverage.py, or where a library
    crashes again."""
    return {target.name: _of(target, folder / slug(target.name)) for target in targets}


def _of(target: Target, folder: Path) -> str:
    path = os.pathsep.join(
        [str(Path(__file__).resolve().parents[1]), os.environ.get("PYTHONPATH", "")]
    )
    command = [sys.executable, "-m", "fuzzing.reached", target.name, str(folder)]
    done = subprocess.run(
        command, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": path}, check=False
    )
    return f"{json.loads(done.stdout.splitlines()[-1]):.0%}" if done.returncode == 0 else "-"


def _measure(name: str, folder: Path) -> float:
    import coverage

    watch = coverage.Coverage(data_file=None, include=[str(_REPOSITORY / "*")], messages=False)
    watch.start()
    from fuzzing.targets import TARGETS

    target = TARGETS[name]
    kept = sorted((folder / "corpus").glob("*"))[:_MOST_INPUTS]
    for data in (*target.seeds(), *(file.read_bytes() for file in kept)):
        judge(target, data, folder / "scratch")
    watch.stop()
    lines = missing = 0
    for module in target.watched:
        _, statements, _, missed, _ = watch.analysis2(str(_REPOSITORY / module))
        lines, missing = lines + len(statements), missing + len(missed)
    return 1 - missing / lines


if __name__ == "__main__":
    print(json.dumps(_measure(sys.argv[1], Path(sys.argv[2]))))
