"""What is scored: what was really wrong with a campaign, and what was said of it.

In which stage an effect shows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Self

from ..diagnosis.verdict import NONE, UNKNOWN

#: The stages whose own gap shows an effect of the sensors between them.
_SEEN_IN = {
    "sensor.pressure_offset": ("gun",),
    "sensor.pressure_gain": ("gun",),
    "sensor.velocity_gain": ("gun", "contact"),
    "sensor.force_gain": ("contact", "plate"),
    "sensor.force_bandwidth": ("contact", "plate"),
}


def stages_of(effect: str) -> tuple[str, ...]:
    """Where an effect of the catalogue may be named: its own stage, or either side of an interface
    that is misread."""
    place = effect.split(".")[0]
    return _SEEN_IN.get(effect, ("plate",) if place == "sensor" else (place,))


@dataclass(frozen=True)
class WithheldTruth:
    """The withheld truth of one case.

    `effects` are ids of the catalogue: none of them for a campaign without effect and for one whose
    effect lies outside the catalogue, which has a `family` instead. `gap_in_floors` and
    `gap_in_tolerances` are of the effect alone, without background. `stages` are those in whose
    observables it shows; `inside` names the configurations (by their place in the record) where it
    acts, where it does not act in all of them. `shares` of the squared gap by effect, by leaving
    one out, and `shapley`; `shown` are the effects that such a campaign could show, acting or not.
    `traces`: whether tank pressure and laser were recorded.
    """

    case: str
    tier: str
    kind: str
    effects: tuple[str, ...] = ()
    family: str = ""
    gap_in_floors: float = 0.0
    gap_in_tolerances: float = 0.0
    stages: tuple[str, ...] = ()
    inside: tuple[int, ...] | None = None
    rough: bool = False
    shares: Mapping[str, float] = field(default_factory=dict)
    shapley: Mapping[str, float] = field(default_factory=dict)
    shown: tuple[str, ...] = ()
    traces: bool = False

    @property
    def key(self) -> str:
        """As a diagnosis would say it: "none", "unknown", an id, or "a+b" in the order of the
        alphabet."""
        return UNKNOWN if self.family else "+".join(sorted(self.effects)) or NONE

    @property
    def within_tolerance(self) -> bool:
        """Then "none" is a right answer, too."""
        return self.key == NONE or self.gap_in_tolerances < 1.0

    @property
    def accepted(self) -> frozenset[str]:
        return frozenset({self.key, NONE}) if self.within_tolerance else frozenset({self.key})


@dataclass(frozen=True)
class RankedAnswer:
    """One entry of an answer: labels by falling share of its probability."""

    labels: tuple[str, ...]
    probability: float
    shares: tuple[float, ...]


@dataclass(frozen=True)
class CaseAnswer:
    """An answer as it is scored. `error` is the reason where there is none: it counts as wrong
    wherever it can.

    `stages` in the order named; `inside` the configurations of each named region; `shrinkage` the
    report's entry that is held out by configuration. `shares` by effect: of the squared gap, with
    its interval's ends. `naive` is the fraction of the gap that the naive joint fit takes away,
    held out. `corner` is the shrinkage that is held out by a corner, `sets` the effects of each set
    that the report names (None: the report knows no sets).
    """

    case: str
    entries: tuple[RankedAnswer, ...] = ()
    stages: tuple[str, ...] = ()
    inside: tuple[tuple[int, ...], ...] = ()
    shrinkage: Mapping[str, Any] | None = None
    seconds: float = float("nan")
    error: str = ""
    shares: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    naive: float | None = None
    memory_mb: float | None = None
    cpu_s: float | None = None
    corner: Mapping[str, Any] | None = None
    sets: tuple[tuple[str, ...], ...] | None = None

    @classmethod
    def of(
        cls, case: str, verdict: Mapping[str, Any], inside: Sequence[Sequence[int]] = ()
    ) -> Self:
        """From a verdict's JSON."""
        where = verdict.get("where", {})
        shrinkage = verdict.get("shrinkage", ())
        held = [entry for entry in shrinkage if entry["held_out_by"] == "configuration"]
        corners = [entry for entry in shrinkage if entry["held_out_by"].startswith("corner")]
        sets = verdict.get("sets")
        return cls(
            case,
            tuple(
                sorted((_entry(cause) for cause in verdict["causes"]), key=lambda e: -e.probability)
            ),
            tuple(stage["name"] for stage in where.get("stage", ())),
            tuple(tuple(int(i) for i in indices) for indices in inside),
            held[0] if held else None,
            float(verdict.get("seconds", float("nan"))),
            shares={
                row["effect"]: (row["share"], *row["ci90"]) for row in verdict.get("effects") or ()
            },
            naive=verdict.get("naive"),
            memory_mb=verdict.get("memory_mb"),
            cpu_s=verdict.get("cpu_s"),
            corner=corners[0] if corners else None,
            sets=None if sets is None else tuple(tuple(members["effects"]) for members in sets),
        )

    @classmethod
    def from_probabilities(
        cls, case: str, probabilities: Mapping[str, float], seconds: float = float("nan")
    ) -> Self:
        """An answer that is a probability for each label: its stage is that of the likeliest
        effect."""
        falling = sorted(probabilities.items(), key=lambda item: -item[1])
        entries = tuple(RankedAnswer((_key(k),), float(p), (1.0,)) for k, p in falling)
        named = [name for name in (falling[0][0] if falling else "").split("+") if "." in name]
        return cls(
            case, entries, tuple(s for name in named for s in stages_of(name)), seconds=seconds
        )

    @property
    def labels(self) -> tuple[str, ...]:
        """In the order in which the report is read: the first entry's, then the second's."""
        return tuple(label for entry in self.entries for label in entry.labels)

    @property
    def named(self) -> tuple[frozenset[str], ...]:
        """Effects that the first entry names, a set for each of its alternatives, the likeliest
        first; empty sets for "none" and "unknown"."""
        first = self.entries[0].labels if self.entries else ()
        return tuple(frozenset(name for name in label.split("+") if "." in name) for label in first)

    @property
    def probabilities(self) -> dict[str, float]:
        """Of each label; they sum to what the entries do."""
        probability_by_label: dict[str, float] = {}
        for entry in self.entries:
            for label, share in zip(entry.labels, entry.shares, strict=True):
                probability_by_label[label] = (
                    probability_by_label.get(label, 0.0) + entry.probability * share
                )
        return probability_by_label

    def probability(self, accepted: frozenset[str]) -> float:
        return sum(p for label, p in self.probabilities.items() if label in accepted)


@dataclass(frozen=True)
class CaseResult:
    """One case: the truth, and what was said. `oracle` is the shrinkage of the right effect, where
    it was asked for."""

    label: WithheldTruth
    said: CaseAnswer
    oracle: Mapping[str, Any] | None = field(default=None)


def fraction_of(entry: Mapping[str, Any] | None, name: str = "fraction") -> float | None:
    """Of a shrinkage or an oracle's answer; None where it has none."""
    value = (entry or {}).get(name)
    return None if value is None else float(value)


def _entry(cause: Mapping[str, Any]) -> RankedAnswer:
    labels = tuple(_key(effect) for effect in cause["effects"])
    split = cause.get("split") or [1.0 / len(labels)] * len(labels)
    order = sorted(range(len(labels)), key=lambda i: -split[i])
    total = sum(split) or 1.0
    return RankedAnswer(
        tuple(labels[i] for i in order),
        float(cause["probability"]),
        tuple(float(split[i]) / total for i in order),
    )


def _key(label: str) -> str:
    """Two effects that act together are the same pair in either order."""
    return "+".join(sorted(label.split("+")))
