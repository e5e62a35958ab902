"""A diagnosis in plain words: how large the model error is, where it arises, what causes it, what
remains.

Functions of a verdict alone. A verdict without shares of effects (an older one) is described by its
causes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from ....diagnosis.verdict import NONE, UNKNOWN, Cause, EffectShare, Verdict
from ...common.number_format import join_words, percent, percent_range, percent_with_range, times
from .wording import ALIKE, STAGE_NAMES, effect_subject, set_name, single_effects

#: A stage with this share of the error is where most of it arises; from _WHOLE on, all of it.
MOST, _WHOLE = 0.5, 0.995
#: From this probability on a cause is said to be the probable one; below, the likeliest of several.
_PROBABLE = 0.5
#: Shares below this are not worth words.
WORTH_SAYING = 0.005
#: A cause with a smaller share makes next to none of the error by itself, or hides a part of it.
_MAKES_ERROR = 0.02
#: So many effects are named under `unknown`.
NEAREST = 3


def summary(verdict: Verdict) -> str:
    """The diagnosis in two to four sentences: size and stage of the model error, its causes, what
    remains."""
    return " ".join(filter(None, _sentences(verdict)))


def is_agreement(verdict: Verdict) -> bool:
    """Whether the likeliest answer is that model and measurement agree."""
    return verdict.first.effects == (NONE,)


def is_unknown(verdict: Verdict) -> bool:
    """Whether the likeliest answer is that no effect of the catalogue explains the error."""
    return verdict.first.effects == (UNKNOWN,)


def _sentences(verdict: Verdict) -> Iterator[str]:
    yield _size_and_stage(verdict)
    if is_agreement(verdict):
        yield f"No effect is needed to explain it ({percent(verdict.first.probability)})."
        for own in verdict.cause_sets:
            acts = (
                f"acts with a probability of {percent(own.inclusion)}, and hardly "
                f"matters for this error"
            )
            yield f"{_capitalise(set_name(own.effects))} {acts}."
    elif is_unknown(verdict):
        yield _unknown(verdict)
        yield _shares(verdict)
    else:
        yield _shares(verdict) or _by_cause(verdict.first)
        yield from _hidden_parts(verdict)
        yield _hardly_matters(verdict)
        fraction = held_out_fraction(verdict)
        if fraction is not None:
            part = percent(fraction) if fraction >= WORTH_SAYING else "none"
            yield (
                f"On configurations that the fit has not seen, {part} of the "
                f"error above the noise disappears."
            )


def _size_and_stage(verdict: Verdict) -> str:
    gap = verdict.gap
    sizes = [
        f"{times(gap.before / scale)} times the {name}"
        for scale, name in ((gap.tolerance, "tolerance"), (gap.noise_floor, "measurement noise"))
        if scale > 0 and math.isfinite(gap.before / scale)
    ]
    size = f"the model error is {' and '.join(sizes) or 'of unknown size'}"
    if is_agreement(verdict):
        beyond = gap.beyond_noise or any(family.beyond_noise for family in gap.families)
        limits = " within the errors that a simulator has without any effect" if beyond else ""
        return f"Model and measurement agree{limits}: {size}."
    within = "" if gap.beyond_noise else ", which is within tolerance and noise together"
    return f"{_capitalise(size)}{within}{_stages(verdict)}.{_largest_stage(verdict)}"


def _largest_stage(verdict: Verdict) -> str:
    """A sentence on the stage that is off most given its measured input, where another makes most
    of the error at the end of the chain; or on several that are off alike, as far as these runs
    tell; else ""."""
    stages = verdict.where.stage[:1] + verdict.where.nearly_largest
    if len(stages) > 1:
        names = join_words([stage_name(stage.name) for stage in stages])
        sizes = join_words([times(stage.own) for stage in stages])
        return (
            f" {_capitalise(names)} are off by nearly the same ({sizes} times their tolerances): "
            "these runs cannot rank them."
        )
    if not stages or stages[0] == max(verdict.where.stage, key=lambda stage: stage.share):
        return ""
    return (
        f" Given its measured input, {stage_name(stages[0].name)} is off most "
        f"({times(stages[0].own)} tolerances)."
    )


def _hardly_matters(verdict: Verdict) -> str:
    """A sentence on a cause that is established although the size of the error is within tolerance;
    else ""."""
    families = [family for family in verdict.gap.families if family.beyond_noise]
    if verdict.gap.beyond_noise or not families:
        return ""
    places = [
        f"the {family.family} ({times(family.before / family.tolerance)} times its tolerance)"
        for family in families
    ]
    return (
        f"It hardly matters for the size of the error, which is within tolerance; "
        f"it shows in {join_words(places)}."
    )


def _capitalise(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}"


def _stages(verdict: Verdict) -> str:
    stages = sorted(verdict.where.stage, key=lambda stage: -stage.share)
    if not stages:
        return ""
    largest = stage_name(stages[0].name)
    if stages[0].share >= _WHOLE or len(stages) == 1:
        return f"; it arises in {largest}"
    if stages[0].share >= MOST:
        return f"; most of it arises in {largest} ({percent(stages[0].share)})"
    places = [
        f"{stage_name(stage.name)} ({percent(stage.share)})"
        for stage in stages
        if stage.share >= WORTH_SAYING
    ]
    return f"; it arises in {join_words(places)}"


def stage_name(name: str) -> str:
    return STAGE_NAMES.get(name, f"the stage {name}")


def _shares(verdict: Verdict) -> str:
    """Which effects cause how much, and what remains; "" where no effect is named."""
    sets = verdict.cause_sets
    causing_sets = [item for item in sets if item.share >= _MAKES_ERROR]
    if not causing_sets:
        return ""
    parts: list[str] = []
    for effect_set in causing_sets:
        share = percent(effect_set.share) if parts else f"causes {percent(effect_set.share)} of it"
        interval = (
            f" ({percent_range(*effect_set.ci90)})" if math.isfinite(sum(effect_set.ci90)) else ""
        )
        parts.append(f"{set_name(effect_set.effects)} {share}{interval}")
    members = {name for effect_set in sets for name in effect_set.effects}
    rest = sum(effect.share for effect in verdict.effects if effect.effect not in members)
    ends = []
    if rest >= 2 * WORTH_SAYING:
        ends.append(f"effects that the data do not establish account for {percent(rest)}")
    if verdict.unexplained is not None:
        unexplained = percent_with_range(verdict.unexplained.share, verdict.unexplained.ci90)
        ends.append(f"{unexplained} remains unexplained")
    return _capitalise("; ".join(filter(None, (join_words(parts), join_words(ends))))) + "."


def _hidden_parts(verdict: Verdict) -> Iterator[str]:
    """A sentence on each cause that makes the error no larger: why it is named all the same."""
    for effect_set in verdict.cause_sets:
        if effect_set.share < _MAKES_ERROR:
            size = (
                f"hides a part of it ({percent(effect_set.share)})"
                if effect_set.share <= -_MAKES_ERROR
                else "makes next to none of it by itself"
            )
            subject, gain = (
                _capitalise(set_name(effect_set.effects)),
                percent(effect_set.held_out_gain),
            )
            yield (
                f"{subject} acts, too, and {size}: with it {gain} more of the error disappears on "
                "configurations that the fit has not seen."
            )


def _by_cause(cause: Cause) -> str:
    """Of a verdict without shares."""
    probability = percent(cause.probability)
    if len(cause.effects) > 1:
        subjects = join_words([set_subject(name, "with") for name in cause.effects], "or")
        start = "Most probably it" if cause.probability >= _PROBABLE else "The likeliest cause"
        return f"{start} is {subjects}, {ALIKE} (together {probability})."
    subject = set_subject(cause.effects[0])
    if cause.probability < _PROBABLE:
        return f"No cause stands out; the likeliest is {subject} ({probability})."
    verb = "cause it together" if "+" in cause.effects[0] else "causes it"
    return f"Most probably {subject} {verb} ({probability})."


def set_subject(name: str, last: str = "and") -> str:
    """An effect or a set of effects ("a+b") as a sentence names it."""
    return join_words([effect_subject(part) for part in name.split("+")], last)


def _unknown(verdict: Verdict) -> str:
    probability = f"(unknown: {percent(verdict.first.probability)})"
    if verdict.cause_sets:
        return f"The effects of the catalogue explain only a part of it {probability}."
    rest = ""
    if verdict.unexplained is not None:
        unexplained = percent_with_range(verdict.unexplained.share, verdict.unexplained.ci90)
        rest = f": {unexplained} of it remains unexplained"
        rest += "".join(
            f"; {effect_subject(effect.effect)} comes nearest"
            for effect in nearest_effects(verdict)[:1]
        )
    return f"No effect of the catalogue explains it {probability}{rest}."


def held_out_fraction(verdict: Verdict) -> float | None:
    """The part of the reducible error that disappears on configurations that the fit has not seen;
    None: not known."""
    if verdict.path:  # it ends at the figure of the shrinkage
        return verdict.path[-1].fraction
    first = set(single_effects(verdict.first.effects))
    entries = [
        entry for entry in verdict.shrinkage if first.intersection(single_effects(entry.effects))
    ]
    return next((entry.fraction for entry in entries if entry.fraction is not None), None)


def nearest_effects(verdict: Verdict) -> tuple[EffectShare, ...]:
    """Up to three effects that take most away on configurations that they were not fitted to, the
    largest first."""
    helpful = [effect for effect in verdict.effects if effect.held_out_gain >= WORTH_SAYING]
    return tuple(sorted(helpful, key=lambda effect: -effect.held_out_gain)[:NEAREST])
