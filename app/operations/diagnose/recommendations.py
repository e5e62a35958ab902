"""What to do next after a diagnosis: adopt, fire, measure, repeat. Sentences of a verdict alone."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterable, Iterator

from ....diagnosis.parameter_limits import exceeded_limit
from ....diagnosis.verdict import LEAST_FRACTION, NONE, UNKNOWN, Fitted, NextRun, Verdict
from ....twin.effects import catalogue
from ...common.number_format import format_interval, join_words, number
from ...common.quantities import display_of, shown_unit
from ...twins.adopted_effects import Adoption, offered
from ..sentence import EXCEEDS, NOT_ENOUGH, REACHES, Number, Rule, Sentence
from .statements import (
    ALIKE,
    FIRST,
    MOST,
    NEAREST,
    is_agreement,
    is_unknown,
    nearest_effects,
)
from .wording import (
    effect_check,
    effect_subject,
    owned_parameters,
    parameter_label,
    set_name,
    set_subject,
    single_effects,
    span_label,
    stage_name,
    with_labels,
)

#: From this held-out fraction on an effect is worth adopting.
_WORTH_ADOPTING = 0.5
#: From this unexplained share on the reader is told where the rest lies.
_LARGE_REST = 0.15
#: So many sentences at most.
_MOST_STEPS = 5

#: What would show the cause of an error of a stage that no effect explains, and which runs.
_STAGE_EXPERIMENTS = {
    "gun": (
        "the pressure behind the projectile and the velocity at two places along the barrel",
        "the lowest and at the highest tank pressure with one projectile",
    ),
    "contact": (
        "the indentation after the hit and the force with a second sensor",
        "the lowest and at the highest impact velocity with one tip",
    ),
    "plate": (
        "the acceleration at more places, and the supports' motion",
        "two impact points with one tip",
    ),
}
#: Of other channels: the plate, for those are accelerations.
_STAGE_OF_CHANNEL = {"velocity": "gun", "force": "contact"}


#: A fit that parts can have is there to be adopted.
OFFERED = Rule(
    "offered", "a fit has parameters that the parts can have", lambda fit: fit is not None
)
_NOT_OFFERED = Rule("not offered", "no fit has parameters that the parts can have",
                    lambda fit: fit is None)  # fmt: skip
#: A fitted parameter that is no value of its part.
_MISS = Rule(
    "miss", "the value lies at the end of its range or beyond", lambda limit: limit is not None
)


def next_steps(verdict: Verdict) -> tuple[Sentence, ...]:
    """Two to five sentences: what to do next, the most useful first."""
    if is_agreement(verdict):
        others = [cause.probability for cause in verdict.causes[1:]]
        evidence = {"probability": verdict.first.probability, "others": others}
        return (
            Sentence(
                "Nothing has to be changed: the nominal model can be used for this campaign.",
                (),
                FIRST,
                evidence,
            ),
            Sentence(
                "To look for a smaller error, diagnose again with a smaller tolerance "
                "(--tolerance) or with more repetitions of each configuration."
            ),
        )
    steps: list[Sentence | None]
    if is_unknown(verdict):
        steps = [_nearest_sentence(verdict), rest_sentence(verdict), *next_experiment(verdict)]
    else:
        rest = verdict.unexplained is not None and verdict.unexplained.share >= _LARGE_REST
        steps = [_adoption(verdict), _separation(verdict), *_limits(verdict)]
        steps += [rest_sentence(verdict) if rest else None, _confirmation(verdict)]
    if any(sentence.startswith("floor assumed") for sentence in verdict.assumptions):
        steps.append(
            Sentence(
                "Repeat three configurations three times: nothing was repeated, so the "
                "measurement noise is an assumption and the probabilities are not calibrated."
            )
        )
    return tuple(step for step in steps if step is not None)[:_MOST_STEPS]


def gone_with(verdict: Verdict, best: Adoption) -> float | None:
    """The part of the reducible error that disappears on configurations that the fit has not seen
    with what can be adopted; None: not measured."""
    return verdict.held_out_fraction if best.after is None else _fraction(verdict, best.after)


def _adoption(verdict: Verdict) -> Sentence:
    best = offered(verdict)
    names = join_words([set_name(own.effects) for own in verdict.cause_sets]) or set_subject(
        verdict.first.effects[0]
    )
    if best is None:
        return Sentence(
            f"Do not adopt {names}: no fit of them has parameters that the parts can have.",
            (),
            _NOT_OFFERED,
            {"fit": best},
        )
    fraction = gone_with(verdict, best)
    if fraction is None:
        return Sentence(
            f"How far the error shrinks with {names} was not measured: do not adopt it on this "
            "alone.",
            (),
            NOT_ENOUGH,
            {"count": 0, "needed": 1},
        )
    if not fraction >= _WORTH_ADOPTING:
        gone = Number("gone", max(fraction, 0.0), "share")
        # The number is of what can be adopted, which may be a part of what was established.
        members = {effect.id for effect in best.effects}
        is_part = any(members.isdisjoint(own.effects) for own in verdict.cause_sets)
        if is_part:
            names = f"{join_words([effect_subject(name) for name in sorted(members)])} alone"
        ending = (
            " With the other effects no fit has parameters that the parts can have."
            if is_part
            else ""
        )
        return Sentence(
            f"Do not adopt {names} yet: only {gone} of the error disappears with it on "
            f"configurations that the fit has not seen.{ending}",
            (gone,),
            EXCEEDS,
            {"value": _WORTH_ADOPTING, "limit": fraction},
        )
    command = (
        f"pyroshock diagnose {shlex.quote(verdict.campaign)} --adopt {best.name.replace('+', ',')}"
    )
    return Sentence(
        f"{_adopted_words(verdict, best)}: {command}.",
        (),
        REACHES,
        {"value": fraction, "limit": _WORTH_ADOPTING},
    )


def _adopted_words(verdict: Verdict, best: Adoption) -> str:
    if best.is_averaged:
        return (
            "Adopt the mean of what these sets of effects predict, so that predictions include it"
        )
    members = {effect.id for effect in best.effects}
    omitted = [
        set_name(own.effects) for own in verdict.cause_sets if members.isdisjoint(own.effects)
    ]
    if omitted:
        subjects = join_words([effect_subject(effect.id) for effect in best.effects])
        return (
            f"Adopt {subjects}, and not {join_words(omitted)}: together with that no fit has "
            "parameters that the parts can have"
        )
    if len(best.effects) > 1:
        return "Adopt these effects, so that predictions include them"
    if any(len(own.effects) > 1 for own in verdict.cause_sets) or len(verdict.first.effects) > 1:
        subject = effect_subject(best.effects[0].id)
        reason = f", {best.reason}" if best.reason else ""
        return f"Of the effects that these runs cannot tell apart, adopt {subject}{reason}"
    return "Adopt this effect, so that predictions include it"


def _fraction(verdict: Verdict, after: float) -> float | None:
    """The part of the reducible error that is gone where `after` is left."""
    room = verdict.gap.before - verdict.gap.noise_floor
    return (verdict.gap.before - after) / room if room > 0 else None


def _settling(verdict: Verdict) -> Sentence | None:
    """The channel that would tell the effects of the largest such set apart; None where none is
    known."""
    for own in verdict.cause_sets:
        if own.settled_by is not None and len(own.effects) > 1:
            channel = own.settled_by.channel.replace("_", " ")
            distance = Number("told apart by", own.settled_by.d_prime, "size")
            subjects = join_words([effect_subject(name) for name in own.effects], "or")
            return Sentence(
                f"To tell whether {subjects} acts, record the {channel}: it would tell them apart "
                f"by {distance} standard deviations of its noise.",
                (distance,),
                ALIKE,
                {"effects": own.effects},
            )
    return None


def _separation(verdict: Verdict) -> Sentence | None:
    if settling := _settling(verdict):
        return settling
    if verdict.next_runs:
        return run_sentence(verdict.next_runs[0])
    several = [own.effects for own in verdict.cause_sets if len(own.effects) > 1]
    names = next(
        iter([*several, *([verdict.first.effects] if len(verdict.first.effects) > 1 else [])]), ()
    )
    checks = _checks(single_effects(names))
    subjects = join_words([set_subject(name, "with") for name in names], "or")
    if not checks:
        return None
    return Sentence(
        f"These runs cannot tell whether {subjects} acts; to decide, measure {checks}.",
        (),
        ALIKE,
        {"effects": names},
    )


def _checks(effects: Iterable[str]) -> str:
    """The first two measurements that show one of the effects by itself; "" where none is known."""
    return join_words(list(dict.fromkeys(filter(None, map(effect_check, effects))))[:2], "or")


def run_sentence(run: NextRun) -> Sentence:
    """The next experiment; one that cannot decide says so, and what to measure instead."""
    numbers = [
        Number(column, float(level))
        for column, level in run.settings.items()
        if not isinstance(level, str)
    ]
    numeric = {item.key: item for item in numbers}
    settings = join_words(
        [
            f"{display_of(column).label} {numeric.get(column, level)}"
            for column, level in run.settings.items()
        ]
    )
    count = Number("runs needed", run.runs_needed, "count")
    runs = f"{count} run" if run.runs_needed == 1 else f"{count} runs"
    shown = (count, *numbers)
    match = re.match(r"separates (\S+) from (\S+)( only to )?", run.why)
    if match is None:
        ids = "|".join(map(re.escape, sorted(catalogue(), key=len, reverse=True)))
        why = re.sub(ids, lambda identity: effect_subject(identity[0]), run.why)
        return Sentence(f"Fire {runs} at {settings}: this {why}.", shown)
    # "and" between effects that act together would be read with what stands beside it
    pair = f"{set_subject(match[1], 'with')} from {set_subject(match[2], 'with')}"
    if not match[3]:
        return Sentence(f"Fire {runs} at {settings}: this separates {pair}.", shown)
    first, second = match[1].split("+"), match[2].split("+")
    checks = _checks(name for name in (*first, *second) if (name in first) != (name in second))
    instead = f"; measure {checks} instead" if checks else ""
    return Sentence(f"Even {runs} at {settings} would not separate {pair}{instead}.", shown)


def _limits(verdict: Verdict) -> Iterator[Sentence]:
    """A sentence for each fitted parameter of a cause that is no value of the part."""
    for identity, fitted in _fitted_parameters(verdict):
        exceeded = exceeded_limit(identity, fitted.parameter, fitted.value)
        if exceeded is None:
            continue
        unit, scale = shown_unit(exceeded.parameter.unit)
        value = format_interval(*(scale * item for item in (fitted.value, *fitted.ci90)))[0]
        limit = f"{number(scale * exceeded.limit)} {unit}".rstrip()
        where = (
            f"beyond its range, which ends at {limit}"
            if exceeded.is_beyond
            else f"at the end of its range ({limit})"
        )
        label = parameter_label(exceeded.parameter.name, exceeded.parameter.unit)
        yield Sentence(
            f"The {label} of {effect_subject(identity)} is fitted as "
            f"{f'{value} {unit}'.rstrip()}, {where}: this is a miss of the law and not a value, "
            "and is not offered for adoption.",
            (),
            _MISS,
            {"limit": exceeded},
        )


def _fitted_parameters(verdict: Verdict) -> list[tuple[str, Fitted]]:
    """Parameters with their effects: of the sets that are causes, or of the first answer where
    there is none."""
    members = {name for own in verdict.cause_sets for name in own.effects}
    if members:
        rows = [effect for effect in verdict.effects if effect.effect in members]
        return [(effect.effect, item) for effect in rows for item in effect.parameters]
    return owned_parameters(verdict.first)


def _confirmation(verdict: Verdict) -> Sentence | None:
    """What shows the largest cause by itself; a set of several is to be told apart first."""
    sets = verdict.cause_sets
    largest = sets[0].effects if sets else (verdict.first.effects[0].split("+")[0],)
    check = effect_check(largest[0]) if len(largest) == 1 else ""
    if not check:
        return None
    verb = "confirm" if sets else "test"
    return Sentence(f"To {verb} {effect_subject(largest[0])} without the model, measure {check}.")


def _nearest_sentence(verdict: Verdict) -> Sentence | None:
    """What the nearest effects take away held out, each by itself and all of the path together."""
    nearest = [
        (effect_subject(item.effect), Number("adds held out", item.held_out_gain, "share"))
        for item in nearest_effects(verdict)
    ]
    if nearest:
        subject, gain = nearest[0]
        shown = [gain for _, gain in nearest]
        others = join_words([f"{name} {other}" for name, other in nearest[1:]])
        together = ""
        if len(verdict.path) > 1 and verdict.path[-1].fraction >= LEAST_FRACTION:
            shown.append(Number("gone", verdict.path[-1].fraction, "share"))
            together = f"; the effects of the path together take {shown[-1]}"
        return Sentence(
            f"The nearest effect is {subject}, which takes {gain} of the error away beside the "
            "other likely effects, on configurations that it was not fitted "
            f"to{', ' if others else ''}{others}{together}.",
            tuple(shown),
            REACHES,
            {"value": gain.value, "limit": LEAST_FRACTION},
        )
    if verdict.effects:
        return Sentence(
            "No effect of the catalogue takes anything away on configurations that it was not "
            "fitted to.",
            (),
            NOT_ENOUGH,
            {"count": len(nearest), "needed": 1},
        )
    causes = [cause for cause in verdict.causes if cause.effects[0] not in (NONE, UNKNOWN)][
        :NEAREST
    ]
    numbers = tuple(Number("probability", cause.probability, "share") for cause in causes)
    names = [
        f"{set_subject(cause.effects[0])} ({probability})"
        for cause, probability in zip(causes, numbers, strict=True)
    ]
    if not names:
        return None
    return Sentence(f"The nearest answer of the catalogue is {join_words(names, 'or')}.", numbers)


def rest_sentence(verdict: Verdict) -> Sentence | None:
    """Where the error that is not explained lies: stage, settings, time, frequency, order of runs;
    None if nowhere."""
    where, main_stage = verdict.where, _main_stage(verdict)
    places = []
    if len(where.stage) > 1:
        places += [f"in {stage_name(stage.name)}" for stage in where.stage if stage.share >= MOST][
            :1
        ]
    if where.factors:
        places.append(f"where {where.factors[0].rule}")
    for spans in (
        where.time,
        where.frequency,
    ):  # a span of another stage than the main one would mislead
        shown = [
            span
            for span in spans
            if not where.stage or _STAGE_OF_CHANNEL.get(span.channel, "plate") == main_stage
        ]
        places += [f"in {span_label(span)}" for span in shown[:1]]
    largest = f"The error is largest {join_words(places)}." if places else ""
    drift = (
        f"It changes while the campaign goes on: {with_labels(where.drift[0])}."
        if where.drift
        else ""
    )
    text = " ".join(filter(None, (largest, drift)))
    return Sentence(text) if text else None


def next_experiment(verdict: Verdict) -> tuple[Sentence, ...]:
    """What to fire or measure next; never empty. Under `unknown` always an experiment."""
    runs = tuple(map(run_sentence, verdict.next_runs))
    if is_unknown(verdict):
        return (*(runs or (_separating_runs(verdict),)), _further_measurement(verdict))
    if runs:
        return tuple(filter(None, (_settling(verdict), *runs)))
    if is_agreement(verdict):
        return (Sentence("No experiment is needed: model and measurement agree."),)
    separation = _separation(verdict) or Sentence("No run is needed to tell causes apart.")
    return tuple(filter(None, (separation, _confirmation(verdict))))


def _separating_runs(verdict: Verdict) -> Sentence:
    """Repeated runs on both sides of where the error is large: they show whether the place is the
    cause."""
    if verdict.where.factors:
        return Sentence(
            f"Fire three repetitions of two settings where {verdict.where.factors[0].rule} and of "
            "two where this does not hold, with all other settings the same: this shows whether "
            "that setting makes the error."
        )
    _, runs = _STAGE_EXPERIMENTS[_main_stage(verdict)]
    return Sentence(
        f"Fire three repetitions at {runs} and with all other settings the same: "
        f"this shows how the error grows."
    )


def _further_measurement(verdict: Verdict) -> Sentence:
    further, _ = _STAGE_EXPERIMENTS[_main_stage(verdict)]
    nearest = next(iter(nearest_effects(verdict)), None)
    if nearest is None or not effect_check(nearest.effect):
        return Sentence(
            f"Measure {further}: this shows causes that the recorded channels cannot show."
        )
    return Sentence(
        f"Measure {effect_check(nearest.effect)}, to see whether {effect_subject(nearest.effect)} "
        f"acts; other causes may show in {further}."
    )


def _main_stage(verdict: Verdict) -> str:
    """Where most of the error arises; else the first stage that was simulated."""
    named = [stage.name for stage in sorted(verdict.where.stage, key=lambda stage: -stage.share)]
    simulated = [part.split(":")[0].strip() for part in verdict.simulator.split("|")]
    return next((name for name in (*named, *simulated) if name in _STAGE_EXPERIMENTS), "contact")
