"""What a deletion with a reason is asked with, and what it answers: the tombstone in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any
from urllib.parse import quote

from pydantic import AfterValidator, Field

from ..fields import request_field
from ..operation import Request, Result


def _stated(reason: str) -> str:
    words = " ".join(reason.split())
    if not words:
        raise ValueError('reason is empty; say why, such as "wrong sensor, repeated as spring-2"')
    return words


#: Why something leaves the store; its tombstone keeps it.
Reason = Annotated[str, Field(max_length=4000), AfterValidator(_stated)]


class DryRunnable(Request):
    """What can be tried without a change of the store."""

    dry_run: bool = request_field(
        False,
        help="Report what would be removed and what depends on it, and change nothing.",
    )


@dataclass(frozen=True)
class RemovedPart(Result):
    """A campaign or recording that went, or would go; `stone` as `removal.deletion_lines`."""

    stone: Mapping[str, Any]
    dry_run: bool = False

    def notes(self) -> Sequence[str]:
        """What went, and what stood on it."""
        stone = self.stone
        part = (
            stone["campaign"]
            if stone["recording"] is None
            else f"{stone['campaign']}, {stone['recording']}"
        )
        rows = ", ".join(
            f"{count} {name.replace('_', ' ')}" for name, count in stone["counts"].items()
        )
        start = "dry run, nothing is deleted; would delete" if self.dry_run else "deleted"
        return (
            f"{part}: {start} {rows}",
            f"  content hash {stone['content_hash']}",
            *(f"  stood on it: {line}" for line in standing_lines(stone)),
            *(
                f"  to do again: run {planned['run']} of plan {planned['plan']}"
                for planned in stone["stood_on"]["reopened"]
            ),
        )

    def to_json(self) -> dict[str, Any]:
        """The tombstone."""
        return dict(self.stone)

    def address(self) -> str:
        """The list of campaigns, or the campaign of the recording."""
        if self.stone["recording"] is None:
            return "/campaigns"
        return f"/campaigns/{quote(self.stone['campaign'], safe='')}"


def removal_row(stone: Mapping[str, Any]) -> dict[str, Any]:
    """A tombstone as a line of a table."""
    plain = {
        key: stone[key] for key in ("id", "kind", "campaign", "recording", "deleted_at", "reason")
    }
    return {
        **plain,
        "since_then": _since(stone),
        "content_hash": stone["content_hash"][:12],
        "stood_on": "; ".join(standing_lines(stone)),
    }


def standing_lines(stone: Mapping[str, Any]) -> list[str]:
    """What stood on a part, a line each: datasets, models, diagnoses, versions of the twin."""
    stood = stone["stood_on"]
    return [
        *(
            f"dataset {dataset['name']} ({dataset['pulses']} pulses, hash {dataset['hash'][:12]})"
            for dataset in stood["datasets"]
        ),
        *(f"model {model['model']} (of dataset {model['dataset']})" for model in stood["models"]),
        *(
            f"diagnosis {diagnosis['id']} of {diagnosis['diagnosed_at'][:19]} "
            f"({diagnosis['simulator']})"
            for diagnosis in stood["diagnoses"]
        ),
        *(
            f"version {version['version']} of the twin ({version['reason']})"
            for version in stood["adopted"]
        ),
    ]


def _since(stone: Mapping[str, Any]) -> str:
    """What became of it after the deletion."""
    if stone["restored_at"] is not None:
        return f"restored {stone['restored_at']}"
    if stone["replaced_by"] is not None:
        return f"replaced by {stone['replaced_by'][:12]}"
    return "-" if stone["archive_path"] is None else f"archived in {stone['archive_path']}"
