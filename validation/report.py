"""What a blind check tells: tables for a person, and the same as JSON.

Scored rows of a check as a file, so that checks of several nights or machines make one table.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from ..files.atomic_write import write_text
from .answer_sets import Rate
from .bench_figures import BenchFigures, bench_text, markdown_table
from .case_results import CaseAnswer, CaseResult, RankedAnswer, WithheldTruth
from .cause_figures import CauseFigures, cause_text
from .metrics import CaseMetrics
from .tally import ExcludedEffect

#: The diagnosis itself among ways of answering.
DIAGNOSIS = "diagnosis"


@dataclass(frozen=True)
class Report:
    """`tiers` of the diagnosis and `baselines` by their name, the same tiers each, "all" the last.

    `kinds`: the diagnosis by kind of campaign, over all tiers. `benches`: the tiers in which kinds
    take turns; `causes`: of the same, what a reader acts on. `published` are the salted hashes of
    the labels, in the order of the cases, as they were before any diagnosis.
    """

    cases: int
    seed: int
    tiers: tuple[CaseMetrics, ...]
    baselines: Mapping[str, tuple[CaseMetrics, ...]]
    left_out: ExcludedEffect | None = None
    kinds: tuple[CaseMetrics, ...] = ()
    published: tuple[str, ...] = ()
    benches: tuple[BenchFigures, ...] = ()
    causes: tuple[CauseFigures, ...] = ()

    def as_json(self) -> dict[str, Any]:
        return {
            "cases": self.cases,
            "seed": self.seed,
            "tiers": _rows_json(self.tiers, "tier"),
            "baselines": [
                {"name": name, "tiers": _rows_json(tables, "tier")}
                for name, tables in self.baselines.items()
            ],
            "kinds": _rows_json(self.kinds, "kind"),
            "benches": [bench.as_json() for bench in self.benches],
            "causes": [cause.as_json() for cause in self.causes],
            "left_out": self.left_out.as_json() if self.left_out else None,
            "published": list(self.published),
        }

    def text(self) -> str:
        """Tables: the diagnosis by tier, then every way of answering over all tiers, then errors
        and crashes."""
        if not self.tiers:
            return _left_out(self.left_out)
        parts = [table(self.tiers, "tier"), *([table(self.kinds, "kind")] if self.kinds else [])]
        if self.baselines:
            last = {
                DIAGNOSIS: self.tiers[-1],
                **{name: tables[-1] for name, tables in self.baselines.items()},
            }
            parts.append(table(list(last.values()), "answers by", list(last)))
        parts += [
            bench_text(self.benches),
            cause_text(self.causes),
            _reliability(self.tiers[-1]),
            _errors(self.tiers[-1]),
            _left_out(self.left_out),
        ]
        return "\n\n".join(part for part in parts if part)


@dataclass(frozen=True)
class Pool:
    """Several finished checks as one: what each was asked for, and the tables over the campaigns of
    all."""

    checks: tuple[Mapping[str, Any], ...]
    tiers: tuple[CaseMetrics, ...]
    kinds: tuple[CaseMetrics, ...]
    benches: tuple[BenchFigures, ...] = ()
    causes: tuple[CauseFigures, ...] = ()

    def as_json(self) -> dict[str, Any]:
        return {
            "pooled": [dict(check) for check in self.checks],
            "tiers": _rows_json(self.tiers, "tier"),
            "kinds": _rows_json(self.kinds, "kind"),
            "benches": [bench.as_json() for bench in self.benches],
            "causes": [cause.as_json() for cause in self.causes],
        }

    def text(self) -> str:
        sections = [
            f"{len(self.checks)} checks: seeds "
            f"{', '.join(str(check['seed']) for check in self.checks)}"
        ]
        if self.tiers:
            sections += [
                table(self.tiers, "tier"),
                table(self.kinds, "kind"),
                bench_text(self.benches),
            ]
            sections.append(cause_text(self.causes))
            sections.append(_errors(self.tiers[-1]))
        return "\n\n".join(part for part in sections if part)


#: A column each: its name, and how its cell is made.
COLUMNS: Mapping[str, Callable[[CaseMetrics], str]] = {
    "cases": lambda f: str(f.n),
    "first": lambda f: _rate(f.first),
    "first group": lambda f: _rate(f.first_group),
    "names in it": lambda f: _number(f.group_size),
    "first two": lambda f: _rate(f.first_two),
    "first two groups": lambda f: _rate(f.first_two_groups),
    "false alarms": lambda f: _rate(f.false_alarms),
    "unknown AUROC": lambda f: _number(f.unknown.auroc),
    "recall at 5 %": lambda f: _rate(f.unknown.recall_at_5),
    "ECE": lambda f: _number(f.reliability.ece),
    "NLL": lambda f: _number(f.reliability.nll),
    "Brier": lambda f: _number(f.reliability.brier),
    "90 % sets": lambda f: _rate(f.covered),
    "set size": lambda f: _number(f.set_size),
    "both": lambda f: _rate(f.both),
    "one of two": lambda f: _rate(f.at_least_one),
    "stage": lambda f: _rate(f.stage),
    "region F1": lambda f: _number(f.region_f1),
    "shrinkage / oracle": lambda f: (
        f"{_number(f.shrinkage.ratio_median)} ({_number(f.shrinkage.ratio_10)})"
    ),
    "90 % intervals": lambda f: _rate(f.shrinkage.covered),
    "seconds": lambda f: f"{f.seconds[0]:.1f}" if math.isfinite(f.seconds[0]) else "-",
}


def table(tables: Sequence[CaseMetrics], heading: str, names: Sequence[str] | None = None) -> str:
    """A Markdown table of figures; columns that no row fills are left out.

    Parameters:
        tables: The figures of each row.
        heading: The heading of the first column, which has the names of the rows.
        names: The names of the rows; by default those that the figures have themselves.
    """
    cells = {name: [cell(figures) for figures in tables] for name, cell in COLUMNS.items()}
    kept = {
        name: column for name, column in cells.items() if any(cell.strip("-() ") for cell in column)
    }
    row_names = names or [figures.name for figures in tables]
    return markdown_table([[heading, *kept], *zip(row_names, *kept.values(), strict=True)])


def _rows_json(tables: Sequence[CaseMetrics], key: str) -> list[dict[str, Any]]:
    """Figures, each with its name under `key` at first."""
    rows = [figures.as_json() for figures in tables]
    return [{key: row.pop("name"), **row} for row in rows]


def _rate(rate: Rate) -> str:
    if rate.value is None:
        return "-"
    low, high = rate.interval
    return f"{rate.value:.3f} ({low:.2f}-{high:.2f}, {rate.n})"


def _number(value: float) -> str:
    return f"{value:.3f}" if math.isfinite(value) else "-"


def _reliability(metrics: CaseMetrics) -> str:
    rows = [f"| {b.probability:.2f} | {_rate(b.right)} |" for b in metrics.reliability.curve]
    return "\n".join(["| said | right |", "| --- | --- |", *rows]) if rows else ""


def _errors(metrics: CaseMetrics) -> str:
    lines = [f"{n} times {answer} for {truth}" for truth, answer, n in metrics.mistaken]
    lines += [f"no answer: {error}" for error in metrics.errors]
    return "\n".join(["Most frequent errors:", *lines]) if lines else ""


def _left_out(excluded: ExcludedEffect | None) -> str:
    if excluded is None:
        return ""
    lines = [
        f"An effect left out of the catalogue, {excluded.n} cases:",
        f"unknown {_rate(excluded.unknown)}, another effect "
        f"{_rate(excluded.others)}, stage {_rate(excluded.stage)}",
        f"put back: first, or in the first group {_rate(excluded.found)}; "
        f"the gap shrinks by {_number(excluded.fraction)}",
    ]
    for effect, counts in excluded.instead.items():
        lines.append(f"{effect}: " + ", ".join(f"{answer} {n}" for answer, n in counts.items()))
    return "\n".join(lines)


#: In a check's folder, written when the last answer is scored.
SCORED = "scored.jsonl"


def write_rows(file: Path, request: Mapping[str, Any], rows: Sequence[CaseResult]) -> None:
    """Write the scored rows of a check: what was asked for on the first line, then a row each with
    the truth, what was said, and the oracle's shrinkage.

    Parameters:
        file: Where the rows are written, as lines of JSON.
        request: What the check was asked for: number of cases, seed, tiers and split.
        rows: The scored cases.
    """
    lines = [json.dumps(dict(request)), *(json.dumps(asdict(row)) for row in rows)]
    write_text(file, "\n".join(lines) + "\n")


def read_rows(file: Path) -> tuple[dict[str, Any], list[CaseResult]]:
    """What a check was asked for, and its scored rows: the inverse of `write_rows`.

    Parameters:
        file: The file `SCORED` in the folder of the check.

    Raises:
        ValueError: Where a check was not finished, and for a file that has no scored rows.
    """
    if not file.is_file():
        raise ValueError(
            f"{file.parent}: no {file.name} there; finish this check with "
            f"blind-check --folder first"
        )
    try:
        request, *lines = [
            json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()
        ]
        return request, [_row(line) for line in lines]
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(
            f"{file}: not the scored rows of a blind check ({error}); score it again"
        ) from error


def pooled(files: Sequence[Path]) -> tuple[list[dict[str, Any]], list[CaseResult]]:
    """What each check was asked for, and the rows of all.

    Parameters:
        files: The scored rows of each check.

    Raises:
        ValueError: For a case that is there twice, and for a file that `read_rows` refuses.
    """
    checks: list[dict[str, Any]] = []
    rows: list[CaseResult] = []
    seen: dict[tuple[int, str], Path] = {}
    for file in files:
        request, own = read_rows(file)
        for row in own:
            if (before := seen.setdefault((request["seed"], row.label.case), file)) is not file:
                raise ValueError(
                    f"{file}: {row.label.case} of seed {request['seed']} is "
                    f"in {before} as well; pool it once"
                )
        checks.append(request)
        rows += own
    return checks, rows


def _row(table: Mapping[str, Any]) -> CaseResult:
    label, answer = dict(table["label"]), dict(table["said"])
    for name in ("effects", "stages"):
        label[name] = tuple(label[name])
    label["shown"] = tuple(label.get("shown", ()))
    label["inside"] = None if label["inside"] is None else tuple(label["inside"])
    answer["entries"] = tuple(
        RankedAnswer(tuple(entry["labels"]), entry["probability"], tuple(entry["shares"]))
        for entry in answer["entries"]
    )
    answer["stages"], answer["inside"] = (
        tuple(answer["stages"]),
        tuple(tuple(indices) for indices in answer["inside"]),
    )
    sets = answer.get("sets")
    answer["sets"] = None if sets is None else tuple(tuple(members) for members in sets)
    answer["shares"] = {name: tuple(values) for name, values in answer.get("shares", {}).items()}
    return CaseResult(WithheldTruth(**label), CaseAnswer(**answer), table["oracle"])
