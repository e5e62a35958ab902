"""Changes one thing at a time in the physics and the diagnosis, and looks whether a test notices:
`make mutants`.

python -m tools.mutation                        # what plan.toml says and the rows lack
python -m tools.mutation 'twin/gun/*' --jobs 2  # of these modules
python -m tools.mutation --again survived       # what survived, once more
python -m tools.mutation --page                 # only the table of docs/measurements/mutation.md,
                                                # of the kept rows
"""

from __future__ import annotations

import argparse
import signal
import sys
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

from . import page, plan, session, verdicts
from .mutants import Mutant, holds, mutants_of, on_lines, sample, spots
from .rows import Row, Rows
from .trial import Outcome

ROOT = Path(__file__).resolve().parents[2]
#: What became of each mutant on this machine, and the list of survivors; not part of the
#: repository.
KEPT = ROOT / ".cache" / "mutation"
VERDICTS = Path(__file__).with_name("verdicts.toml")
PAGE = ROOT / "docs" / "measurements" / "mutation.md"
#: Trials between two writings of the rows.
_OFTEN = 20


def main(words: list[str]) -> int:
    """0: every trial was made, whatever came of it."""
    signal.signal(
        signal.SIGTERM, lambda *_: sys.exit(1)
    )  # so that the workers end as well, and their copies go
    asked = _asked(words)
    rows = Rows(KEPT / "rows.csv")
    if not asked.page:
        _run(asked, rows)
    reasons = verdicts.read(VERDICTS)
    kept = list(rows)
    page.write_table(PAGE, kept, reasons)
    KEPT.mkdir(parents=True, exist_ok=True)
    (KEPT / "survivors.md").write_text(page.survivors(kept, reasons) + "\n", encoding="utf-8")
    print(
        f"{PAGE}: {len({row.module for row in kept})} modules; survivors: {KEPT / 'survivors.md'}"
    )
    return 0


def _asked(words: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m tools.mutation", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("modules", nargs="*", help="patterns of paths; all of plan.toml without")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument(
        "--again",
        choices=("survived", "killed", "timed out", "all"),
        help="of the rows that are kept",
    )
    parser.add_argument("--whole", action="store_true", help="every mutant, not a sample")
    parser.add_argument("--page", action="store_true", help="only write the page's table")
    return parser.parse_args(words)


def _run(asked: argparse.Namespace, rows: Rows) -> None:
    planned = plan.read(ROOT)
    targets = planned.chosen(tuple(asked.modules))
    todo: list[tuple[Mutant, plan.Target]] = []
    of: dict[str, int] = {}
    for target in targets:
        source = (ROOT / target.module).read_text(encoding="utf-8")
        every = spots(source, planned.operators, planned.chosen_arguments)
        of[target.module] = len(every)
        size = None if asked.whole or asked.again else target.sample
        places = sample(every, size, f"{planned.seed} {target.module}")
        if asked.again:
            again = [
                row.before
                for row in rows
                if row.module == target.module and asked.again in ("all", row.now)
            ]
            places = on_lines(source, places, again)
        drawn = mutants_of(target.module, source, places)
        rows.keep_only(target.module, partial(holds, source), len(every))
        todo += [(each, target) for each in drawn if _due(rows.find(each.key), asked.again)]
    needed = list({target.module: target for _, target in todo}.values())
    print(f"{len(todo)} mutants of {len(needed)} modules", flush=True)
    if not todo:
        return
    with session.workers(ROOT, planned.warm, planned.warm_own, asked.jobs) as pool:
        limit = session.limits(pool, needed)
        trials = [session.Trial(mutant, target, limit[target.module]) for mutant, target in todo]
        for count, (mutant, outcome) in enumerate(session.outcomes(pool, trials), 1):
            rows.add(_row(mutant, outcome, of[mutant.module]))
            print(
                f"{count} {outcome.what} {outcome.seconds:.1f} s "
                f"{mutant.module}:{mutant.line} {mutant.after}",
                flush=True,
            )
            if count % _OFTEN == 0 or count == len(trials):
                rows.write()


def _due(row: Row | None, again: str | None) -> bool:
    if again is None:
        return row is None
    return row is not None and again in ("all", row.now)


def _row(mutant: Mutant, outcome: Outcome, of: int) -> Row:
    today = datetime.now(tz=UTC).date().isoformat()
    what = outcome.what
    return Row(*mutant.key, mutant.line, mutant.operator, what, what, outcome.by, today, of)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
