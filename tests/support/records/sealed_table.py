"""Sealed figures in the tables of diagnosis.md: `PYTHONPATH=tests python -m support.records.sealed_table`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from pyroshock.validation.answer_sets import Rate
from pyroshock.validation.case_results import CaseResult
from pyroshock.validation.metrics import CaseMetrics, figures
from pyroshock.validation.report import pooled
from pyroshock.validation.tally import kinds

FOLDER = Path(__file__).resolve().parents[3] / "docs" / "blind-check"
#: Checks of one commit: those that the table is of.
CHECKS = "6112*.jsonl"
TIERS = ("strong", "middle", "two", "rough")


def rows_of_checks() -> list[CaseResult]:
    return pooled(sorted(FOLDER.glob(CHECKS)))[1]


def lines(rows: Sequence[CaseResult]) -> Iterator[str]:
    """Rows of the table without its head."""
    of = {name: figures(name, [row for row in rows if row.label.tier == name]) for name in TIERS}
    usual = figures("both", [row for row in rows if row.label.tier in ("strong", "middle")])
    strong, middle, two, rough = (of[name] for name in TIERS)

    yield _of_singles(of, "first", "0.88; middle 0.80", "first")
    yield _of_singles(of, "first group", "0.97", "first_group")
    yield _of_singles(of, "first two", "middle 0.90", "first_two")
    yield _of_singles(of, "first two groups", "-", "first_two_groups")
    yield _line("names in the first entry", "4 at most", *(f"{each.group_size:.1f}" for each in of.values()))
    alarms = [_count(each.false_alarms) for each in (strong, middle, rough)]
    both = f"{alarms[1]}; both tiers {_count(usual.false_alarms)}"
    yield _line("false alarms", "0.05", alarms[0], both, "-", alarms[2])
    areas = [f"{each.unknown.auroc:.2f}" for each in (strong, middle, rough)]
    both = f"{areas[1]}; both tiers {usual.unknown.auroc:.2f}"
    yield _line("unknown: AUROC", "0.95", areas[0], both, "-", areas[2])
    recall = [_rate(each.unknown.recall_at_5) for each in (strong, middle, rough)]
    yield _line("unknown: recall at 5 %", "0.70", *recall[:2], "-", recall[2])
    ece = [f"{each.reliability.ece:.3f}" for each in of.values()]
    both = f"{ece[1]}; both tiers {usual.reliability.ece:.3f}"
    yield _line("ECE of the first entry", "0.05; rough 0.10", ece[0], both, *ece[2:])
    yield _line("90 % sets", "-", *(f"{_share(each.covered)} of {each.set_size:.1f} labels" for each in of.values()))
    yield _line("both, one of two", "0.60, 0.90", "-", "-", f"{_rate(two.both)}, {_rate(two.at_least_one)}", "-")
    yield _of_singles(of, "stage", "0.97", "stage")
    yield _line("region F1 (cases)", "0.80", *(_region(each) for each in of.values()))


def _of_singles(of: Mapping[str, CaseMetrics], name: str, target: str, figure: str) -> str:
    cells = {tier: "-" if tier == "two" else _rate(getattr(each, figure)) for tier, each in of.items()}
    return _line(name, target, *cells.values())


def of_kinds(rows: Sequence[CaseResult]) -> Iterator[str]:
    """By kind of campaign, strong and middle together: first, first group, AUROC of unknown, false alarms, seconds."""
    for each in kinds([row for row in rows if row.label.tier in ("strong", "middle")]):
        yield _line(
            each.name,
            _rate(each.first),
            _rate(each.first_group),
            _count(each.false_alarms),
            f"{each.unknown.auroc:.2f}",
            f"{each.seconds[0]:.0f}",
        )


def _line(*cells: str) -> str:
    return "| " + " | ".join(cells) + " |"


def _rate(rate: Rate) -> str:
    low, high = rate.interval
    return "-" if rate.value is None else f"{rate.value:.2f} ({low:.2f}-{high:.2f}, {rate.n})"


def _share(rate: Rate) -> str:
    return "-" if rate.value is None else f"{rate.value:.2f}"


def _count(rate: Rate) -> str:
    return f"{rate.hits} of {rate.n}"


def _region(each: CaseMetrics) -> str:
    return f"{each.region_f1:.2f} ({each.regions})" if each.regions else "-"


if __name__ == "__main__":
    every = rows_of_checks()
    print("\n".join(lines(every)))
    print()
    print("\n".join(of_kinds(every)))
