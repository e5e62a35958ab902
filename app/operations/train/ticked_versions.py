"""Rows that are ticked in a list of models, by the pulses on which they were judged.

Versions are compared on held-out pulses that they have in common. A person who ticks every row of a
list ticks rows of several splits, which have none; each split is then a comparison of its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from .wording import UNSEEN_SPLITS

#: A comparison needs so many.
_FEWEST = 2


@dataclass(frozen=True)
class TickedGroup:
    """Ticked versions that were judged on one split of one dataset."""

    dataset: str
    split: str
    labels: tuple[str, ...]

    @property
    def rows(self) -> list[str]:
        """As the list of models sends them."""
        return [f"{label} {self.split}" for label in self.labels]

    @property
    def words(self) -> str:
        """`svr@1 and tree@1 (split configurations of pulses)`."""
        return f"{' and '.join(self.labels)} (split {self.split} of {self.dataset})"


def ticked_groups(
    ticked: Sequence[str], choices: Sequence[Mapping[str, Any]]
) -> tuple[TickedGroup, ...]:
    """The rows by dataset and split, those that decide a promotion first.

    `ticked` are texts such as "svr@1 configurations", `choices` the rows of the list
    (`figures.version_row`). Rows that name no split, or that are not in the list, are left out:
    `compare` says what is wrong with them.
    """
    datasets = {(row["label"], row["split"]): row["dataset"] for row in choices}
    labels: dict[tuple[str, str], list[str]] = {}
    for text in dict.fromkeys(ticked):
        label, _, split = text.partition(" ")
        if dataset := datasets.get((label, split.strip())):
            labels.setdefault((dataset, split.strip()), []).append(label)
    groups = [TickedGroup(*key, tuple(of_group)) for key, of_group in labels.items()]
    return tuple(sorted(groups, key=lambda group: group.split not in UNSEEN_SPLITS))


def comparable_group(groups: Sequence[TickedGroup]) -> TickedGroup | None:
    """Of several groups the first that can be compared; None where one group alone is ticked, and
    where none has enough versions."""
    if len(groups) < _FEWEST:
        return None
    return next((group for group in groups if len(group.labels) >= _FEWEST), None)
