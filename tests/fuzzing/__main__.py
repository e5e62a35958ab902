"""`python -m fuzzing --inputs 100000`: the long run, its table, and exit code 1 where something was
found."""

from __future__ import annotations

import argparse
import shutil
import sys
from dataclasses import replace
from pathlib import Path

from fuzzing import worker


def main() -> int:
    options = argparse.ArgumentParser(prog="fuzzing", description=__doc__)
    options.add_argument("--inputs", type=int, default=100_000)
    options.add_argument("--only", default="", help="targets whose name contains this")
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--jobs", type=int, default=2)
    options.add_argument("--folder", type=Path, default=Path("results/fuzz"))
    given = options.parse_args()
    worker.prepare()  # before anything of ours is imported
    from fuzzing import campaign
    from fuzzing.reached import reached
    from fuzzing.targets import TARGETS

    chosen = [target for name, target in TARGETS.items() if given.only in name]
    for target in chosen:
        shutil.rmtree(given.folder / campaign.slug(target.name), ignore_errors=True)
    rows = campaign.run(chosen, given.inputs, given.folder, given.seed, given.jobs)
    lines = reached(chosen, given.folder)
    table = campaign.markdown([replace(row, coverage=lines[row.target]) for row in rows])
    (given.folder / "table.md").write_text(table + "\n")
    print(table)
    for row in rows:
        for finding in row.findings:
            print(f"{row.target}: {finding}")
    return 1 if any(row.findings for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
