"""What a report says of the facts that the laboratory measured (`[known]` of campaign.toml): which
of them were used as priors, and which of them the record contradicts.

A fact is never overruled: the probabilities rest on it. Hence each parameter is fitted once more
without the fact, beside the effects that were found and in the place of each; and where the fact
says that an effect acts, without that effect. Where the record is explained better so, and the
parameter then lies many standard uncertainties from the stated value, the report says both numbers.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial

from ..schema.known_facts import KnownFact
from ..twin.effects import catalogue
from .inference.effect_laws import laws_of
from .inference.model_search import fit_other_laws
from .inference.posterior import HypothesisPosterior, fitted_parameters
from .inference.subset_fit import SubsetFit
from .verdict import Fitted

#: So many standard uncertainties from its stated value a parameter contradicts it.
CONTRADICTION_U = 4.0
#: And the record has to be explained better by so many nats, 20 to 1: else neither is shown.
_NATS = 3.0


@dataclass(frozen=True)
class Contradiction:
    """A fact, what the record gives for its parameter without it, and by how many nats that
    explains the record better."""

    fact: KnownFact
    fitted: Fitted
    nats: float

    @property
    def uncertainties(self) -> float:
        """How many standard uncertainties of the fact the parameter lies from it."""
        return abs(self.fitted.value - self.fact.value) / self.fact.u


def known_fact_sentences(posterior: HypothesisPosterior) -> Iterator[str]:
    """Sentences on the measured facts, for the assumptions of the report.

    Parameters:
        posterior: The sets of effects with their probabilities.
    """
    for fact in posterior.gap.record.known_facts:
        if fact.effect in posterior.effects:
            yield f"known: {fact.name} = {fact.words}, taken as the prior of this parameter"
        else:
            yield (
                f"known: {fact.name} = {fact.words}, not used: {fact.effect} was "
                f"not looked for in this campaign"
            )
    for contradiction in contradictions(posterior):
        yield _sentence(contradiction)


def contradictions(posterior: HypothesisPosterior) -> Iterator[Contradiction]:
    """Facts that the record contradicts by more than `CONTRADICTION_U`.

    Parameters:
        posterior: The sets of effects with their probabilities.
    """
    for fact in posterior.gap.record.known_facts:
        if fact.effect not in posterior.effects:
            continue
        score = partial(_score, posterior, fact.effect)
        fits = list(posterior.library.fits.values())
        stated = score(posterior.library.best())
        free = max(_without_fact(posterior, fact), key=score, default=None)
        if _settles_effect(posterior, fact):
            stated = max(score(fit) for fit in fits if fact.effect in fit.effects)
            others = [
                *([] if free is None else [free]),
                *(fit for fit in fits if fact.effect not in fit.effects),
            ]
            free = max(others, key=score)
        if free is None:
            continue
        contradiction = Contradiction(fact, _fitted_value(free, fact), score(free) - stated)
        if contradiction.nats > _NATS and contradiction.uncertainties > CONTRADICTION_U:
            yield contradiction


def _score(posterior: HypothesisPosterior, effect: str, fit: SubsetFit) -> float:
    """Log evidence and log prior of a set, but for whether this effect acts: that is what the fact
    has settled."""
    own_prior = posterior.library.prior[effect][effect in fit.effects]
    return posterior.library.log_joint(fit) - own_prior


def _settles_effect(posterior: HypothesisPosterior, fact: KnownFact) -> bool:
    """Whether the effect acts by the fact, and no parameter is left by which it may come to
    nothing."""
    measured = {
        other.parameter for other in posterior.gap.record.known_facts if other.effect == fact.effect
    }
    laws = [law for law in posterior.problem.laws if law.id == fact.effect]
    names = ({coordinate.parameter.name for coordinate in law.coordinates} for law in laws)
    return all(law.surely_acts for law in laws) and all(own <= measured for own in names)


def _without_fact(posterior: HypothesisPosterior, fact: KnownFact) -> list[SubsetFit]:
    """The likeliest sets, with the likely range as the prior of the fact's parameter."""
    ranges = posterior.problem.ranges
    others = {key: other for key, other in ranges.known_facts.items() if other != fact}
    laws = [
        law
        for law in laws_of(catalogue()[fact.effect], replace(ranges, known_facts=others), {})
        if any(coordinate.parameter.name == fact.parameter for coordinate in law.coordinates)
    ]
    return fit_other_laws(posterior.problem, posterior.library.best(), laws)


def _fitted_value(fit: SubsetFit, fact: KnownFact) -> Fitted:
    """The fact's parameter in a set; where it does nothing, in one without the effect."""
    for item in fitted_parameters(fit, fact.effect):
        if item.parameter == fact.parameter:
            return item
    (own,) = (item for item in catalogue()[fact.effect].parameters() if item.name == fact.parameter)
    return Fitted(own.name, own.off, own.unit, (own.off, own.off))


def _sentence(contradiction: Contradiction) -> str:
    fact, fitted = contradiction.fact, contradiction.fitted
    low, high = fitted.ci90
    value = f"{fitted.value:.4g} {fitted.unit}".rstrip()
    interval = f" ({low:.4g} to {high:.4g})" if low < high else f", that is without {fact.effect}"
    return (
        f"{fact.name}: campaign.toml states {fact.words}, and the record is explained better by "
        f"{value}{interval}, {contradiction.uncertainties:.0f} standard uncertainties away; the "
        "causes of this report rest on the stated value, so check it, its unit and its source"
    )
