"""What a withheld case is, and the label that tells its truth.

What acts in a case, as the stages take it.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from ...array_types import Floats
from .designs import CaseSetting
from .unknown_effects import UnknownEffect

KINDS = ("gun", "hammer", "plate", "chain")
#: A gun and what its bullet strikes, without accelerometers: of the tiers that name it alone.
GUN_AND_CONTACT = "gun-contact"
#: Kinds whose campaign is a gun's.
GUN_KINDS = ("gun", "chain", GUN_AND_CONTACT)
#: Tier to the range of gap over floor. "any" leaves it to the cause's physical range.
TIERS: Mapping[str, tuple[float, float]] = {
    "weak": (0.5, 1.5),
    "middle": (1.5, 3.0),
    "strong": (3.0, 6.0),
    "very strong": (6.0, 20.0),
    "any": (0.5, 20.0),
}
#: Tolerance of each stage's metric: ln velocity, ln peak, impulse and width, dB of a response
#: spectrum.
TOLERANCES: Mapping[str, float] = {"gun": 0.01, "contact": 0.03, "plate": 0.5}
#: Stages that a kind's campaign shows.
STAGES: Mapping[str, tuple[str, ...]] = {
    "gun": ("gun",),
    "hammer": ("contact",),
    "plate": ("plate",),
    "chain": ("gun", "contact", "plate"),
    GUN_AND_CONTACT: ("gun", "contact"),
}
#: `KINDS` and those that only some tiers have; the order is part of seeds.
ALL_KINDS = tuple(STAGES)


@dataclass(frozen=True)
class BackgroundGap:
    """What no effect explains, in tolerances (rms over configurations): a smooth function of the
    factors over `length` (scaled factors) and `white`, drawn for each configuration."""

    smooth: float
    white: float
    length: float
    rough: bool
    seed: int


@dataclass(frozen=True)
class Case:
    """A drawn case. `design` is the number of its plan, `floor` the standard error of a
    configuration's mean from repetitions, in tolerances.

    `strengths` by effect id, in the unit of `strength.RANGES`; `unknown` is a family outside the
    catalogue with its `amount`. `laws`: by which second laws the effects act, a split's name;
    empty: by the bench's own (see `virtualbench.second_laws`). `decoys`: nominal figures of
    campaign.toml by name, times a factor within tolerance. `blocked`: a configuration's repetitions
    follow one another; else runs are shuffled. `traces`: a gun's tank pressure and laser are
    recorded, and the plan's pressure is what a regulator was set to instead of what the transducer
    read.
    """

    kind: str
    tier: str
    design: int
    repetitions: int
    floor: float
    background: BackgroundGap
    strengths: Mapping[str, float] = field(default_factory=dict)
    unknown: str | None = None
    amount: float = 0.0
    laws: str = ""
    decoys: Mapping[str, float] = field(default_factory=dict)
    blocked: bool = False
    sampling_rate_hz: float = 102_400.0
    traces: bool = False

    @property
    def cause(self) -> tuple[str, ...]:
        """Ids of the catalogue, or ("unknown",), or ("none",)."""
        if self.unknown:
            return ("unknown",)
        return tuple(sorted(self.strengths)) or ("none",)


@dataclass(frozen=True)
class Label:
    """The truth of a recorded case.

    By stage, over configurations and observables: `gap` (rms of the effect's true change) and
    `floor`, in tolerances. `ratio` is the largest gap over floor of a stage, `tier` where it falls
    (`tier_of`); `stage` where that is. `changes` by stage: (C, d) true change of each
    configuration, in `TOLERANCES`' units; its configurations are `configurations`, factors by name.
    `left_out` and `shapley` by stage: what each effect makes of the squared gap
    (`attribution.Attribution`); `shown`: the effects that such a campaign can show; `laws`: as in
    `Case`. `alone` has the ratio of each effect by itself. `background`: rms in tolerances as
    drawn. `region`: the factor and value in which alone the effect acts. `traces`: as in `Case`.
    """

    kind: str
    cause: tuple[str, ...]
    tier: str
    ratio: float
    stage: str | None
    gap: Mapping[str, float]
    floor: Mapping[str, float]
    alone: Mapping[str, float]
    strengths: Mapping[str, float]
    family: str | None
    background: Mapping[str, Any]
    decoys: Mapping[str, float]
    region: Mapping[str, str]
    configurations: tuple[Mapping[str, Any], ...]
    changes: Mapping[str, list[list[float]]]
    seed: int
    folder_sha256: str = ""
    left_out: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    shapley: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    shown: tuple[str, ...] = ()
    laws: str = ""
    traces: bool = False

    @property
    def within_tolerance(self) -> bool:
        """Whether the contract calls this gap `none`."""
        return max(self.gap.values(), default=0.0) <= 1.0

    def as_json(self) -> dict[str, Any]:
        # tuples as lists
        return json.loads(json.dumps(asdict(self)))  # type: ignore[no-any-return]

    def sha256(self, salt: bytes) -> str:
        """Hash of salt and label in hexadecimal digits, without the folder's hash, which is known
        only after the recording.

        Parameters:
            salt: The key of the sealed labels. Without it, nobody can guess the label from its
                hash.
        """
        table = {key: value for key, value in self.as_json().items() if key != "folder_sha256"}
        return hashlib.sha256(salt + json.dumps(table, sort_keys=True).encode()).hexdigest()

    @classmethod
    def from_json(cls, table: Mapping[str, Any]) -> Label:
        """The inverse of `as_json`.

        Parameters:
            table: A label as `as_json` gives it.
        """
        tuples = {name: tuple(table[name]) for name in ("cause", "configurations", "shown")}
        return cls(**{**table, **tuples})


def tier_of(ratio: float) -> str:
    """The tier of a gap over floor: "none" where there is no gap, "weak" below 1.5, "beyond" from
    20 on.

    Parameters:
        ratio: The largest gap over floor of a stage.
    """
    if not ratio > 0:
        return "none"
    named = (name for name, (_, high) in TIERS.items() if name != "any" and ratio < high)
    return next(named, "beyond") if math.isfinite(ratio) else "beyond"


@dataclass(frozen=True)
class ActingCause:
    """What acts: effects of the catalogue, by strength, and a family outside of it.

    `order` (C,): places of the configurations in the order of runs, 0 to 1; evenly spread where it
    is empty. `laws`: the split of the second laws by which the effects act, empty for the bench's
    own.
    """

    strengths: tuple[tuple[str, float], ...] = ()
    family: str = ""
    amount: float = 0.0
    order: tuple[float, ...] = ()
    laws: str = ""

    def restricted(self, names: Collection[str]) -> ActingCause:
        """The same cause with some of its effects alone.

        Parameters:
            names: Ids of the effects that are kept.
        """
        return replace(
            self, strengths=tuple((name, value) for name, value in self.strengths if name in names)
        )

    @property
    def table(self) -> dict[str, float]:
        return dict(self.strengths)

    def places(self, count: int) -> Floats:
        """The place (C,) of each configuration in the order of runs, from 0 to 1.

        Parameters:
            count: The number C of configurations, over which the places are spread evenly where the
                cause has no `order`.
        """
        return np.array(self.order) if self.order else np.linspace(0, 1, count)

    def outside(self, plan: tuple[CaseSetting, ...]) -> UnknownEffect:
        """What the family outside of the catalogue does to a campaign.

        Parameters:
            plan: The configurations of the campaign.
        """
        return UnknownEffect(self.family, self.amount, plan)

    def touches(self, *beginnings: str) -> bool:
        """Whether the name of something that acts begins with one of these.

        Parameters:
            beginnings: Beginnings of the names of effects and families, such as "plate.".
        """
        return any(name.startswith(beginnings) for name in (*self.table, self.family))
