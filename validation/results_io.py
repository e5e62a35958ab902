"""Scored rows of a check as a file, so that checks of several nights or machines make one table."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ..schema.atomic_write import write_text
from .case_results import CaseResult, RankedAnswer, Said, WithheldTruth

#: In a check's folder, written when the last answer is scored.
SCORED = "scored.jsonl"


def write_rows(file: Path, asked: Mapping[str, Any], rows: Sequence[CaseResult]) -> None:
    """What was asked for on the first line, then a row each: the truth, what was said, and the oracle's shrinkage."""
    lines = [json.dumps(dict(asked)), *(json.dumps(asdict(row)) for row in rows)]
    write_text(file, "\n".join(lines) + "\n")


def read_rows(file: Path) -> tuple[dict[str, Any], list[CaseResult]]:
    """The inverse. Raises `ValueError` where a check was not finished, and for a file that is none of these."""
    if not file.is_file():
        raise ValueError(f"{file.parent}: no {file.name} there; finish this check with blind-check --folder first")
    try:
        request, *lines = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]
        return request, [_row(line) for line in lines]
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(f"{file}: not the scored rows of a blind check ({error}); score it again") from error


def pooled(files: Sequence[Path]) -> tuple[list[dict[str, Any]], list[CaseResult]]:
    """What each check was asked for, and the rows of all. Raises `ValueError` for one that is there twice."""
    checks: list[dict[str, Any]] = []
    rows: list[CaseResult] = []
    seen: dict[tuple[int, str], Path] = {}
    for file in files:
        request, own = read_rows(file)
        for row in own:
            if (before := seen.setdefault((request["seed"], row.label.case), file)) is not file:
                raise ValueError(
                    f"{file}: {row.label.case} of seed {request['seed']} is in {before} as well; pool it once"
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
    answer["stages"], answer["inside"] = tuple(answer["stages"]), tuple(tuple(indices) for indices in answer["inside"])
    answer["shares"] = {name: tuple(values) for name, values in answer.get("shares", {}).items()}
    return CaseResult(WithheldTruth(**label), Said(**answer), table["oracle"])
