"""What the inference says: which effects act, which sets of them, what remains, and how sure that
is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ...array_types import Floats
from ...parallel.phases import Progress
from ...twin.effects import Effect
from ..gap import GapMetric, GapTable
from ..observable_families import background_probability, family_columns
from ..observables.base import Stage
from ..verdict import Fitted
from .model_search import ModelLibrary, fit_sets, search
from .problem import InferenceProblem
from .shares import ends, reducible_square
from .subset_fit import DISCREPANCIES, SubsetFit, residual
from .unexplained_gap import RunOrderDrift, UnexplainedEvidence, unexplained_evidence

#: An effect with less of the squared gap than this is no major one of a set.
MAJOR = 0.1
#: Nor is one with less of it after all others; more, where another effect cancels part of it.
MAJOR_LAST = 0.2
#: Sets that are less likely than this are in no entry.
_RARE = 5e-3
#: Prior probability that something outside of the catalogue makes most of the gap.
UNKNOWN_PRIOR = 0.2
#: Draws of a set's parameters.
_DRAWS = 400
#: Sets beside which something unexplained is looked for.
_BESIDE = 3
_Z90 = 1.6449


@dataclass(frozen=True, eq=False)
class HypothesisPosterior:
    """Sets of effects with their probabilities; see `ModelLibrary`. `metric` says what the squared
    gap is made of."""

    gap: GapTable
    library: ModelLibrary
    metric: GapMetric
    weighted: tuple[tuple[SubsetFit, float], ...]
    unexplained: Mapping[tuple[str, ...], UnexplainedEvidence] = field(default_factory=dict)
    _rough_shares: dict[tuple[str, ...], dict[str, tuple[float, float]]] = field(
        default_factory=dict
    )
    _within: dict[tuple[str, ...], float] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        gap: GapTable,
        stages: Sequence[Stage],
        kinds: Sequence[type[Effect]],
        progress: Progress = lambda *_: None,
    ) -> HypothesisPosterior:
        """The sets of effects that may make a gap, searched and weighed.

        Parameters:
            gap: The gap of the campaign.
            stages: The stages whose gap it is.
            kinds: The classes of the effects that are looked for.
            progress: Receives the steps done, their number and what is searched; by default
                nothing is called.
        """
        problem = InferenceProblem.of(gap, stages, kinds)
        library = search(problem, progress)
        _fit_neighbours(problem, library)
        weighted = tuple(library.weights())
        drift = RunOrderDrift.of(gap)
        posterior = cls(gap, library, GapMetric.of(gap), weighted)
        beside = {fit.key: fit for fit in posterior.poor_sets}
        evidence = {
            key: unexplained_evidence(gap, problem.blocks, fit, drift)
            for key, fit in beside.items()
        }
        return cls(gap, library, posterior.metric, weighted, evidence)

    @property
    def problem(self) -> InferenceProblem:
        return self.library.problem

    @property
    def best(self) -> SubsetFit:
        return self.weighted[0][0]

    @property
    def effects(self) -> tuple[str, ...]:
        return self.problem.effects

    @property
    def _rare(self) -> float:
        """Sets with less weight are rare: of very many that are alike, those with a twentieth of
        the likeliest's."""
        return min(_RARE, self.weighted[0][1] / 20)

    def inclusion(self, effect: str) -> float:
        """Posterior probability that an effect acts.

        Parameters:
            effect: The id of the effect.
        """
        return sum(weight for fit, weight in self.weighted if effect in fit.effects)

    @cached_property
    def _before(self) -> float:
        return self._square([block.z for block in self.problem.blocks])

    @cached_property
    def floor(self) -> float:
        """What repetitions leave of the squared gap, in tolerances squared over the cells, by the
        metric's weights."""
        variance = self.gap.floor_variance / self.gap.tolerance**2
        return float(np.nansum(variance * self.weights))

    @cached_property
    def weights(self) -> Floats:
        """(D,): of the observables' squares in the metric."""
        return self.metric.weights(self.gap)

    def _square(self, cells: Sequence[Floats]) -> float:
        total = 0.0
        for block, own in zip(self.problem.blocks, cells, strict=True):
            total += float(own**2 @ self.weights[block.observable])
        return total

    def taken(self, fit: SubsetFit) -> float:
        """The fraction of the reducible gap (roots, as the report has it) that a set takes in the
        sample.

        Parameters:
            fit: The set as it was fitted.
        """
        remaining_square = self._square(
            [
                residual(block, own)
                for block, own in zip(self.problem.blocks, fit.change, strict=True)
            ]
        )
        room = np.sqrt(self._before) - np.sqrt(self.floor)
        return (
            float((np.sqrt(self._before) - np.sqrt(remaining_square)) / room) if room > 0 else 0.0
        )

    def rough_shares(self, fit: SubsetFit) -> dict[str, tuple[float, float]]:
        """By effect of a set, of the squared gap: the mean of what it takes alone and after all
        others, and the latter by itself.

        Parameters:
            fit: The set as it was fitted.
        """
        if fit.key not in self._rough_shares:
            points = [fit.point()]
            alone, last, _ = ends(self.problem, points, self.weights, self._before)
            room = reducible_square(self._before, self.floor)
            self._rough_shares[fit.key] = {
                law.id: (float(first + after) / 2 / room, float(after) / room)
                for law, first, after in zip(fit.laws, alone[0], last[0], strict=True)
            }
        return self._rough_shares[fit.key]

    def major(self, fit: SubsetFit) -> tuple[str, ...]:
        """The effects of a set that make much of the gap, largest first; the largest always.

        Parameters:
            fit: The set as it was fitted.
        """
        if not fit.laws:
            return ()
        shares = self.rough_shares(fit)
        order = sorted(shares, key=lambda name: -shares[name][0])
        return tuple(
            name
            for i, name in enumerate(order)
            if i == 0 or shares[name][0] >= MAJOR or shares[name][1] >= MAJOR_LAST
        )

    @cached_property
    def poor_sets(self) -> list[SubsetFit]:
        """No effects, and the likeliest sets that leave more than half of the gap."""
        ranked = sorted(self.library.fits.values(), key=lambda fit: -self.library.log_joint(fit))
        poor = [fit for fit in ranked if fit.laws and self.taken(fit) < 0.5][:_BESIDE]
        return [self.library.fits[()], *poor]

    @cached_property
    def log_odds_unknown(self) -> float:
        """Log odds that something outside of the catalogue makes most of the gap, against all sets
        of effects."""
        joint = [
            self.library.log_joint(self.library.fits[tuple(sorted(key))]) + evidence.gain
            for key, evidence in self.unexplained.items()
        ]
        catalogue_joint = [self.library.log_joint(fit) for fit, _ in self.weighted]
        prior = float(np.log(UNKNOWN_PRIOR / (1 - UNKNOWN_PRIOR)))
        return (
            prior + float(np.logaddexp.reduce(joint)) - float(np.logaddexp.reduce(catalogue_joint))
        )

    @cached_property
    def gain_beside_likeliest(self) -> float:
        """Log evidence with something unexplained beside the likeliest set of effects, less that
        without."""
        if self.best.key in self.unexplained:
            return self.unexplained[self.best.key].gain
        return unexplained_evidence(
            self.gap, self.problem.blocks, self.best, RunOrderDrift.of(self.gap)
        ).gain

    @cached_property
    def discrepancy(self) -> float:
        """Posterior mean of how far the laws of the effects are off in the stage where they are
        furthest off, as a share of what the effects do."""
        largest = [
            max(DISCREPANCIES[error.discrepancy] for error in fit.errors)
            for fit, _ in self.weighted
        ]
        return float(np.dot(largest, [weight for _, weight in self.weighted]))

    @property
    def likeliest_pattern(self) -> UnexplainedEvidence:
        """Of what is unexplained, beside the set where it is likeliest."""
        return max(
            self.unexplained.items(),
            key=lambda item: (
                self.library.log_joint(self.library.fits[tuple(sorted(item[0]))]) + item[1].gain
            ),
        )[1]

    @cached_property
    def none_probability(self) -> float:
        """That no family of observables shows an error beyond noise, background and its tolerance:
        the sets move none of them by a tolerance, and what is seen of each may be a simulator's
        background."""
        return self.background_probability * self.within_probability

    @cached_property
    def within_probability(self) -> float:
        """Of sets that together move no family of observables by a tolerance."""
        return sum(weight * self.within_tolerance(fit) for fit, weight in self.weighted)

    @cached_property
    def background_probability(self) -> float:
        """That a simulator's background makes the error of every family of observables."""
        return background_probability(self.gap)

    def within_tolerance(self, fit: SubsetFit) -> float:
        """The probability that a set moves no family of observables by a tolerance, over the
        posterior of its parameters, linear about the fit.

        Parameters:
            fit: The set as it was fitted.
        """
        if not fit.laws:
            return 1.0
        if fit.key not in self._within:
            normal = np.random.default_rng(0).standard_normal((len(fit.u), _DRAWS))
            draws = np.linalg.solve(np.linalg.cholesky(fit.precision).T, normal)  # (p, draws)
            within = np.ones(_DRAWS, dtype=bool)
            for block, own, slope in zip(
                self.problem.blocks, fit.change, fit.jacobian, strict=True
            ):
                for columns in family_columns(self.gap).values():
                    inside = np.isin(block.observable, columns)
                    if inside.any():
                        moved = (
                            np.nan_to_num(own[inside], nan=100.0)[:, None] + slope[inside] @ draws
                        )
                        within &= np.mean(moved**2, axis=0) <= 1.0
            self._within[fit.key] = float(within.mean())
        return self._within[fit.key]

    def set_probabilities(self) -> dict[tuple[str, ...], float]:
        """By set of major effects (largest first), of sets that are beyond tolerance; sums to one
        less that of none: what is neither within tolerance nor a background is one of them, unless
        it is unknown. Rare sets are left out, in proportion."""
        table: dict[frozenset[str], float] = {}
        order: dict[frozenset[str], tuple[str, ...]] = {}
        for fit, weight in self.weighted:
            beyond = 1 - self.within_tolerance(fit)
            if weight > self._rare and beyond > 0:
                names = self.major(fit)
                key = frozenset(names)
                order.setdefault(key, names)
                table[key] = table.get(key, 0.0) + weight * beyond
        ranked = sorted(table, key=lambda key: -table[key])
        scale = (1 - self.none_probability) / sum(table.values()) if table else 0.0
        return {order[key]: table[key] * scale for key in ranked}

    def set_scores(self) -> tuple[tuple[tuple[str, ...], float, float, float], ...]:
        """Of every set that is not rare: its major effects, log evidence, log prior, and the
        probability that it is within tolerance."""
        return tuple(
            (
                self.major(fit),
                fit.log_evidence,
                self.library.log_set_prior(fit),
                self.within_tolerance(fit),
            )
            for fit, weight in self.weighted
            if weight > self._rare
        )

    def representative(self, names: Sequence[str]) -> SubsetFit:
        """The likeliest fit whose major effects are given ones; the likeliest of all where no
        likely set has them.

        Parameters:
            names: Ids of the major effects, in any order; none for no effect.
        """
        wanted = frozenset(names)
        for fit, weight in self.weighted:
            if weight > self._rare and (
                frozenset(self.major(fit)) == wanted if fit.laws else not wanted
            ):
                return fit
        return self.best

    def _best_of_effects(self) -> list[SubsetFit]:
        """The likeliest laws of every set of effects, the least likely first."""
        return sorted(self.library.fits.values(), key=self.library.log_joint)

    def parameters(self, effect: str) -> tuple[Fitted, ...]:
        """Parameters of an effect in the likeliest set that has it, with 90 % intervals; () where
        no set has it.

        Parameters:
            effect: The id of the effect.
        """
        for fit, _ in [*self.weighted, *((fit, 0.0) for fit in reversed(self._best_of_effects()))]:
            if effect in fit.effects:
                return fitted_parameters(fit, effect)
        return ()


def _fit_neighbours(problem: InferenceProblem, library: ModelLibrary) -> None:
    """The best set without each of its effects; where one of them turns out to be better, that
    one's too."""
    best = None
    while best is not (best := library.best()):
        fit_sets(
            problem,
            library,
            [[name for name in best.effects if name != out] for out in best.effects],
        )


def fitted_parameters(fit: SubsetFit, effect: str, prefix: str = "") -> tuple[Fitted, ...]:
    """Parameters of one effect of a set, those of levels by their names, with 90 % intervals.

    Parameters:
        fit: The set as it was fitted.
        effect: The id of the effect.
        prefix: What stands before the names of the parameters; by default nothing.
    """
    covariance = np.linalg.inv(fit.precision)
    last, table = 0, []
    for law, part in zip(fit.laws, fit.parts, strict=True):
        first, last = last, last + law.size
        if law.id != effect:
            continue
        places = law.placing @ part
        spread = np.sqrt(np.diag(law.placing @ covariance[first:last, first:last] @ law.placing.T))
        labels = [
            (coordinate, name)
            for coordinate in law.coordinates
            for name in law.level_names or ("",)
        ]
        for (coordinate, name), place, width in zip(labels, places, spread, strict=True):
            low, middle, high = np.sort(
                coordinate.value(place + _Z90 * width * np.array([-1.0, 0.0, 1.0]))
            )
            label = f"{prefix}{coordinate.parameter.name}" + (f" ({name})" if name else "")
            table.append(
                Fitted(label, float(middle), coordinate.parameter.unit, (float(low), float(high)))
            )
    return tuple(table)


def fitted_effects(fit: SubsetFit) -> tuple[Effect, ...]:
    """The effects of a set as they were fitted; parameters that differ between levels are (C,) by
    configuration.

    Parameters:
        fit: The set as it was fitted.
    """
    return tuple(law.effect(own) for law, own in zip(fit.laws, fit.parts, strict=True))


def common_effects(fit: SubsetFit) -> tuple[Effect, ...]:
    """The same with one value for all levels: what a twin can take over for other configurations.

    Parameters:
        fit: The set as it was fitted.
    """
    return tuple(
        law.common.effect(law.common_part(own))
        for law, own in zip(fit.laws, fit.parts, strict=True)
    )


__all__ = ["HypothesisPosterior", "common_effects", "fitted_effects", "fitted_parameters"]
