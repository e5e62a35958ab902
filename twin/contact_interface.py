"""What the contact stage is asked, and what it gives: strikes to pulses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from ..array_types import Floats
from .setting import Setting


@dataclass(frozen=True, eq=False)
class ImpactBatch:
    """n impacts: the settings (of which some may be the same object) and the velocity (n,) of
    each."""

    settings: Sequence[Setting]
    impact_velocity_m_s: Floats

    def __len__(self) -> int:
        return len(self.impact_velocity_m_s)


@dataclass(frozen=True)
class OutOfDomain:
    """One thing that lies outside of what a model has learned from: as the JSON of `predict` shows
    it."""

    predictor: str
    value: float | str
    range: str
    #: What a registered model says of the value, such as "was never recorded"; of laws none.
    reason: str = ""
    #: The two ends of what was recorded, SI; none of words and of laws.
    ends: tuple[float, ...] = ()


@dataclass(frozen=True)
class Extrapolation:
    """A quantity that is asked for beyond what was recorded: the value asked, and the range of what
    was learned, SI."""

    quantity: str
    asked: float
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class ForcePulses:
    """Force on the target of n impacts: `force_n` (n, p) at equidistant phases of the contact, both
    ends 0.

    `contact_time_s` (n,), `compression_time_s` (n,): until the deepest indentation, or the peak
    where the model knows no indentation.
    """

    contact_time_s: Floats
    force_n: Floats
    compression_time_s: Floats

    @property
    def peak_force_n(self) -> Floats:
        return np.asarray(self.force_n.max(axis=1))

    @property
    def impulse_n_s(self) -> Floats:
        """Trapezoid rule over the contact, (n,)."""
        return np.asarray(
            np.trapezoid(self.force_n, axis=1) * self.contact_time_s / (self.force_n.shape[1] - 1)
        )


class ContactStage(Protocol):
    """A law of contact, or a registered model. Picklable, and without state that changes."""

    @property
    def label(self) -> str:
        """What answered: "hertz", "models:/coregional-gp@champion"."""
        ...

    @property
    def normals(self) -> int:
        """How many standard normal numbers one random pulse takes; 0 for a law that knows no
        spread."""
        ...

    def pulses(self, strikes: ImpactBatch, z: Floats | None = None) -> ForcePulses:
        """The force pulses of n strikes.

        Parameters:
            strikes: n impacts.
            z: Standard normal numbers (n, normals), which a random pulse for each strike is a
                function of; by default None, for the mean pulses.
        """
        ...

    def outside(self, strikes: ImpactBatch) -> list[tuple[OutOfDomain, ...]]:
        """For each strike, what of it lies outside of what the stage was made for; empty inside.

        Parameters:
            strikes: n impacts.
        """
        ...


@runtime_checkable
class ExtrapolationPolicy(Protocol):
    """A contact stage that has learned from shots, and knows their range."""

    def extrapolation(self, strikes: ImpactBatch) -> list[tuple[Extrapolation, ...]]:
        """For each strike, which of its quantities lie beyond those of the shots; empty where
        nothing was learned.

        Parameters:
            strikes: n impacts.
        """
        ...


@runtime_checkable
class AboveAnvil(Protocol):
    """A contact stage whose pulses are those at the tip, where a hammer feels them."""

    def plate_pulses(
        self, strikes: ImpactBatch, z: Floats | None, pulses: ForcePulses
    ) -> ForcePulses:
        """What of the pulses at the tip acts on the plate.

        Parameters:
            strikes: n impacts.
            z: Standard normal numbers (n, normals) of random pulses; None for the mean ones.
            pulses: The pulses at the tip, those of the same strikes and `z`.
        """
        ...
