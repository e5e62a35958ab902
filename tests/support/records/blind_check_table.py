"""Figures of benches on the page of the blind check: `PYTHONPATH=tests python -m
support.records.blind_check_table`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from pyroshock.validation.answer_sets import Rate
from pyroshock.validation.bench_figures import BenchFigures, Quantile, bench_tables
from pyroshock.validation.case_plan import BENCHES, GROUPS
from pyroshock.validation.cause_figures import CauseFigures, cause_tables
from pyroshock.validation.report import pooled

FOLDER = Path(__file__).resolve().parents[3] / "docs" / "blind-check" / "now"
#: Answers on the tiers that score what a reader acts on.
CAUSES = FOLDER.parent / "development" / "26110-causes.jsonl"
#: The same of the sealed split, and full scale, one and two effects by foreign laws beside.
SEALED = FOLDER.parent / "sealed"
_FULL_SCALE = ("realistic full scale", "foreign full scale")


def lines(folder: Path = FOLDER) -> Iterator[str]:
    """Rows of the table without its head: every tier, each followed by its kinds."""
    rows = pooled(sorted(folder.glob("*.jsonl")))[1]
    for each in bench_tables(rows, tuple(BENCHES)):
        yield _line(each)


def _line(each: BenchFigures) -> str:
    cells = [
        each.name, str(each.n), _quantile(each.fraction), _quantile(each.true_fraction),
        _quantile(each.naive),
        _rate(each.at_least_naive), _rate(each.largest_named), _rate(each.large_named),
        _rate(each.off_named),
        _rate(each.unknown_first),
    ]  # fmt: skip
    return f"| {' | '.join(cells)} |"


def _quantile(value: Quantile) -> str:
    return f"{value.value:.2f} ({value.low:.2f}-{value.high:.2f})"


def _rate(rate: Rate) -> str:
    if rate.value is None:
        return "-"
    return f"{rate.value:.2f} ({rate.interval[0]:.2f}-{rate.interval[1]:.2f}, {rate.n})"


def cause_lines(
    *files: Path, tiers: Sequence[str] = GROUPS["causes"]
) -> tuple[list[str], list[str]]:
    """Rows of the two tables of what a reader acts on without their heads: every tier, and each
    followed by its kinds.

    The first has what is named and how true the shares are, the second first answers, what goes of
    the gap, and costs.
    """
    tables = cause_tables(pooled(files or (CAUSES,))[1], tiers)
    return [_named_line(figures) for figures in tables], [
        _first_line(figures) for figures in tables
    ]


def sealed_lines() -> tuple[list[str], list[str]]:
    """The same of the sealed split."""
    return cause_lines(
        *sorted(SEALED.glob("*.jsonl")),
        tiers=(*_FULL_SCALE, "foreign one", "foreign two", *GROUPS["causes"]),
    )


def _named_line(figures: CauseFigures) -> str:
    rates = (
        figures.largest_leads, figures.other_leads, figures.largest_named, figures.idle_named,
        figures.both_named,
        figures.wrong_alone,
    )  # fmt: skip
    error = f"{figures.shares_error:.2f}" if np.isfinite(figures.shares_error) else "-"
    return _row(figures, *map(_counted, rates), error, _counted(figures.shares_held))


def _first_line(figures: CauseFigures) -> str:
    rates = (
        figures.none_first, figures.unknown_first, figures.outside_unknown, figures.outside_none,
        figures.false_smooth,
        figures.false_rough, figures.stage, figures.at_least_naive,
    )  # fmt: skip
    quantiles = [
        f"{value.value:.2f}" if value.n else "-" for value in (figures.fraction, figures.corner)
    ]
    return _row(
        figures, *map(_counted, rates), *quantiles, f"{figures.ece:.2f}", f"{figures.cpu_s[0]:.0f}"
    )


def _row(figures: CauseFigures, *cells: str) -> str:
    return f"| {' | '.join([figures.name, str(figures.n), *cells])} |"


def _counted(rate: Rate) -> str:
    """With its interval, of few."""
    low, high = rate.interval
    return f"{rate.hits} of {rate.n} ({low:.2f}-{high:.2f})" if rate.n else "-"


if __name__ == "__main__":
    print("\n".join(lines()))
    for part in (*cause_lines(), *sealed_lines()):
        print("\n".join(part))
