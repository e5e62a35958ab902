"""What every stage gives to a diagnosis. R runs and C configurations of the record; d observables
of the stage.

Sets of effects of the same kinds as one set with arrays, so that one call simulates them all.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats, Rows
from ...twin.effects import Effect, catalogue
from ...twin.sensors.chain import SensorChain
from ...twin.sensors.effect import SensorEffect
from ..record import CampaignRecord, Series

#: What one stage hands to the next, a value for each run of the record: true velocities in m/s (NaN
#: where there is none), or true forces on the plate in N (None where there is none).
Upstream = Sequence[float] | Sequence[Series | None]


@dataclass(frozen=True)
class Observable:
    """One number that is compared: measured less simulated.

    `unit` is "1" for natural logarithms and shares, "dB" for levels. `tolerance`, in the unit: a
    gap up to which measurement and simulator are said to agree. `floor`, in the unit: the scatter
    of one run that its sensors' data sheets allow, for campaigns without repetitions.
    `frequency_hz` and `window_s` say what part of a record it is of. `detail`: a shape or a timing,
    which a simulator may meet far better than the amplitudes beside it. `parts` say what its errors
    are made of: an impulse is a height times a length.
    """

    name: str  # within its stage: "ln_peak", "acceleration_1 at 400 Hz"
    stage: str
    channel: str  # "velocity", "force", "acceleration_1"
    unit: str
    tolerance: float
    floor: float
    frequency_hz: float | None = None
    window_s: tuple[float, float] | None = None
    detail: bool = False
    parts: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class PossibleObservables:
    """What a channel that a campaign lacks would show of its C configurations, under k sets of
    effects: `predicted` (k, C, d), NaN where there is no answer, and `noise` (d, d), the covariance
    of one run."""

    predicted: Floats
    noise: Floats


class Stage(ABC):
    """One stage of the bench with its nominal simulator, on one campaign's record.

    A stage is asked what it does given what was *measured* at its entrance (tank pressure and mass;
    velocity; force), so that its gap is its own. Effects of `sensor` that act on the entrance are
    undone before, those on the exit act after. Everything is in SI; observables are smooth in the
    parameters of effects.
    """

    #: gun, contact or plate.
    name: ClassVar[str]
    #: Base of the stage's own effects, and the hooks of `SensorEffect` for what is read at its
    #: entrance and exit.
    effect_kind: ClassVar[type[Effect]]
    sensor_hooks: ClassVar[tuple[str, ...]]
    #: Sentences for the report: what was taken for granted.
    assumptions: tuple[str, ...] = ()

    def __init__(self, record: CampaignRecord) -> None:
        self.record = record
        self._residuals: Floats | None = None
        self._nuisances: dict[str, Floats] = {}

    @property
    @abstractmethod
    def simulator(self) -> str:
        """As the report names it: "gun:adiabatic"."""

    @property
    @abstractmethod
    def observables(self) -> tuple[Observable, ...]:
        """The d columns."""

    @property
    def shows(self) -> tuple[str, ...]:
        """Ids of the catalogue's effects that can change these observables on this campaign, in the
        catalogue's order.

        (A layer's compliance only where there is a layer.)
        """
        return tuple(identity for identity, kind in catalogue().items() if self.applies(kind))

    def applies(self, kind: type[Effect]) -> bool:
        """Whether an effect is one of the stage, or of the sensors on either side of it.

        Parameters:
            kind: The class of the effect.
        """
        return issubclass(kind, self.effect_kind) or changes_reading(kind, *self.sensor_hooks)

    def acting(self, effects: Sequence[Effect]) -> list[Effect]:
        """Those effects that apply to the stage.

        Parameters:
            effects: Effects of any stage.
        """
        return [effect for effect in effects if self.applies(type(effect))]

    @abstractmethod
    def measured(self) -> Floats:
        """(R, d): observables of what was measured; NaN where a run has none."""

    @abstractmethod
    def simulated(self, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> Floats:
        """Observables (R, d) that the records would show; NaN where there is no answer.

        Parameters:
            effects: Effects that act, by default none. A parameter is one value or one for each run
                (R,).
            upstream: What the stage before gives to each run, which is true and passes no sensor.
                By default what was measured at the entrance.
        """

    def output(self, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> Upstream:  # noqa: ARG002
        """What it hands to the next stage, for each run.

        Parameters:
            effects: Effects that act, by default none. A parameter is one value or one for each run
                (R,).
            upstream: What the stage before gives to each run; by default what was measured at the
                entrance.

        Raises:
            ValueError: For the last stage.
        """
        raise ValueError(f"the {self.name} is the last stage: nothing takes what it gives")

    @abstractmethod
    def changes(self, sets: Sequence[Sequence[Effect]]) -> Floats:
        """(k, C, d): by how much each of k sets of effects moves the nominal observables in each
        configuration.

        NaN where there is no answer: a shot that stops. At one representative run for each
        configuration; the cost grows with configurations, not with runs.

        Parameters:
            sets: The k sets of effects; effects of other stages in a set do nothing here. A
                parameter is one value or one for each configuration (C,), or, of the plate, one for
                each mode or sensor.
        """

    def parts(self, kind: type[Effect]) -> dict[str, tuple[tuple[int, ...], tuple[str, ...]]]:  # noqa: ARG002
        """Parts of the structure from whose one to the next a parameter of an effect may differ, by
        what its owner is called: the level of each value of the parameter's array, and the names of
        the levels.

        Parameters:
            kind: The class of the effect.
        """
        return {}

    def part_of_observables(self, owner: str, names: Sequence[str]) -> NDArray[np.intp]:  # noqa: ARG002
        """(d,): which of an owner's parts each observable tells of; -1 for none.

        Parameters:
            owner: What the parts belong to, as `parts` names it.
            names: The names of its parts.

        Raises:
            LookupError: For a stage without such parts.
        """
        raise LookupError(f"the {self.name} has no parts that are called {owner!r}")

    @property
    def possible_channels(self) -> tuple[str, ...]:
        """Channels that this campaign did not record and `possible_observables` knows."""
        return ()

    def possible_observables(
        self,
        channel: str,
        sets: Sequence[Sequence[Effect]],  # noqa: ARG002
    ) -> PossibleObservables:
        """What a channel that was not recorded would have shown under each of k sets of effects.

        Parameters:
            channel: One of `possible_channels`.
            sets: The k sets of effects. A parameter is one value for all configurations or one for
                each (C,).

        Raises:
            LookupError: For another channel.
        """
        raise LookupError(f"the {self.name} cannot say what {channel!r} would show")

    def nuisances(self) -> dict[str, Floats]:
        """(C, d) by name: what one standard deviation of a nominal parameter that is declared
        uncertain does."""
        return dict(self._nuisances)

    def residuals(self) -> Floats:
        """(R, d): measured less simulated. Reckoned once, and not to be written to."""
        if self._residuals is None:
            self._residuals = np.asarray(self.measured() - self.simulated())
            self._residuals.flags.writeable = False
        return self._residuals

    def median_runs(self, values: Floats) -> NDArray[np.intp]:
        """(C,): the run of each configuration with the lower median of a quantity; -1 where all are
        NaN.

        Parameters:
            values: The quantity (R,) of each run, NaN where it has none.
        """
        rows = np.full(len(self.record.configurations), -1)
        for configuration in range(len(rows)):
            runs = np.flatnonzero(
                (self.record.configuration_of == configuration) & np.isfinite(values)
            )
            if runs.size:
                rows[configuration] = runs[
                    np.argsort(values[runs], kind="stable")[(runs.size - 1) // 2]
                ]
        return rows


def sensor_chain(effects: Iterable[Effect], *hooks: str) -> SensorChain:
    """The effects of the sensors as a chain, of other stages none.

    Parameters:
        effects: Effects of any stage.
        hooks: Names of methods of `SensorEffect`: only effects that change what one of them gives
            are taken; without any name all effects of sensors.
    """
    sensors = (effect for effect in effects if isinstance(effect, SensorEffect))
    return SensorChain.of(
        effect for effect in sensors if not hooks or changes_reading(type(effect), *hooks)
    )


def changes_reading(kind: type[Effect], *hooks: str) -> bool:
    """Whether an effect is one of a sensor and changes what one of its methods gives.

    Parameters:
        kind: The class of the effect.
        hooks: Names of methods of `SensorEffect`.
    """
    return issubclass(kind, SensorEffect) and any(
        getattr(kind, hook) is not getattr(SensorEffect, hook) for hook in hooks
    )


E = TypeVar("E", bound=Effect)


def batched_changes(
    nominal: Floats,
    sets: Sequence[Sequence[Effect]],
    observed: Callable[[Sequence[Effect], int], Floats],
) -> Floats:
    """(k, C, d): by how much each of k sets of effects moves what is observed; nothing for an empty
    set.

    Parameters:
        nominal: The observables (C, d) of the C cases without effects.
        sets: The k sets of effects. A parameter is one value or one for each of the C cases.
        observed: A function that gives the observables (n C, d) of effects whose parameters are one
            value or go with n x C cases, set by set, and of n.
    """
    changes = np.zeros((len(sets), *nominal.shape))
    groups: dict[tuple[str, ...], list[int]] = {}
    for row, effects in enumerate(sets):
        if effects:
            groups.setdefault(tuple(sorted(effect.id for effect in effects)), []).append(row)
    for rows in groups.values():
        together = stacked([sets[row] for row in rows], len(nominal))
        changes[rows] = observed(together, len(rows)).reshape(len(rows), *nominal.shape) - nominal
    return changes


def stacked(sets: Sequence[Sequence[Effect]], count: int) -> list[Effect]:
    """Effects for k x `count` cases, set by set, in the place of k sets.

    Parameters:
        sets: The k sets, all of effects of the same kinds. A parameter is one value or one for each
            case (`count`,).
        count: The number of cases of a set.
    """
    ordered = [sorted(effects, key=lambda effect: effect.id) for effects in sets]
    return [
        replace(
            same[0],
            **{
                item.name: _for_each_case([getattr(effect, item.name) for effect in same], count)
                for item in same[0].parameters()
            },
        )
        for same in zip(*ordered, strict=True)
    ]


def _for_each_case(values: Sequence[float | Floats], count: int) -> Floats:
    """(k x `count`,) of k values of a parameter, each a number or one for each case (`count`,)."""
    if any(np.ndim(value) for value in values):
        return np.concatenate([np.broadcast_to(value, (count,)) for value in values])
    return np.repeat(np.array(values, dtype=np.float64), count)


def at_rows(effects: Sequence[E], rows: Rows) -> tuple[E, ...]:
    """The same effects for some of the cases. (Cases are impacts, shots, or configurations of which
    runs are wanted.)

    Parameters:
        effects: Effects whose parameters are one value or one for each case (n,).
        rows: The places (k,) of the wanted cases; a case may be named several times.
    """

    def of_rows(effect: E) -> E:
        values = {item.name: getattr(effect, item.name) for item in effect.parameters()}
        of_cases = {name: np.asarray(at)[rows] for name, at in values.items() if np.ndim(at)}
        return replace(effect, **of_cases) if of_cases else effect

    return tuple(map(of_rows, effects))
