"""Figures of benches on the page of the blind check: `PYTHONPATH=tests python -m support.records.blind_check_table`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from pyroshock.validation.answer_sets import Rate
from pyroshock.validation.bench_figures import BenchFigures, Quantile, bench_tables
from pyroshock.validation.case_plan import BENCHES
from pyroshock.validation.report import pooled

FOLDER = Path(__file__).resolve().parents[3] / "docs" / "blind-check" / "now"


def lines(folder: Path = FOLDER) -> Iterator[str]:
    """Rows of the table without its head: every tier, each followed by its kinds."""
    rows = pooled(sorted(folder.glob("*.jsonl")))[1]
    for each in bench_tables(rows, tuple(BENCHES)):
        yield _line(each)


def _line(each: BenchFigures) -> str:
    cells = [
        each.name, str(each.n), _quantile(each.fraction), _quantile(each.true_fraction), _quantile(each.naive),
        _rate(each.at_least_naive), _rate(each.largest_named), _rate(each.large_named), _rate(each.off_named),
        _rate(each.unknown_first),
    ]  # fmt: skip
    return f"| {' | '.join(cells)} |"


def _quantile(value: Quantile) -> str:
    return f"{value.value:.2f} ({value.low:.2f}-{value.high:.2f})"


def _rate(rate: Rate) -> str:
    if rate.value is None:
        return "-"
    return f"{rate.value:.2f} ({rate.interval[0]:.2f}-{rate.interval[1]:.2f}, {rate.n})"


if __name__ == "__main__":
    print("\n".join(lines()))
