"""What a diagnosis says: how large the model error is, where it arises, what causes it, what
remains, and what disappears on configurations that the fit has not seen.

Sentences of a verdict alone, which command, pages, reports and library share. An effect is called a
cause only where the verdict's evidence on held-out configurations says so (`CAUSE`), and effects
are "not told apart" only as a set of several (`ALIKE`). A verdict without shares of effects (an
older one) is described by its causes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from ....diagnosis.verdict import (
    CORRECTED,
    LEAST_FRACTION,
    NONE,
    UNKNOWN,
    EffectSet,
    EffectShare,
    HeldOutEvidence,
    Shrinkage,
    Unexplained,
    Verdict,
    Where,
)
from ...common.number_format import format_interval, join_words, number
from ..sentence import ESTABLISHED, EXCEEDS, REACHES, WITHIN, Interval, Number, Rule, Sentence
from .wording import (
    MOST_NAMES,
    effect_subject,
    held_out_name,
    sentence_start,
    set_name,
    set_subject,
    span_label,
    stage_name,
    unexplained_interval,
    with_labels,
)

#: A stage with this share of the error is where most of it arises; from _WHOLE on, all of it.
MOST, _WHOLE = 0.5, 0.995
#: From this probability on a cause is said to be the probable one; below, the likeliest of several.
_PROBABLE = 0.5
#: A cause with a smaller share makes next to none of the error by itself, or hides a part of it.
MAKES_ERROR = 0.02
#: Digits of an error in tolerances that are shown at most.
_DIGITS_OF_RATIO = 3
#: From this share on what remains is more than the error itself: whole per cent show 100 below it.
_MORE_THAN_WHOLE = 1.005
#: So many effects are named under `unknown`.
NEAREST = 3

_WORDS_OF_EVIDENCE = (
    "more of the error disappears with the effects on configurations that the fit has not seen, "
    "and the 90 % interval of what disappears lies above zero"
)
#: Effects cause a part of the error.
CAUSE = Rule(
    "cause",
    _WORDS_OF_EVIDENCE,
    lambda evidence: all(item.is_established for item in evidence),
)
#: Effects take a part of the error away where they were fitted, and are no causes.
FITTED_ONLY = Rule(
    "fitted only",
    f"it is not so that {_WORDS_OF_EVIDENCE}",
    lambda evidence: not any(item.is_established for item in evidence),
)
#: What the list of causes has first.
FIRST = Rule(
    "first",
    "no other entry of the causes has a larger probability",
    lambda probability, others: all(probability >= other for other in others),
)
#: Effects of which at least one acts.
ALIKE = Rule("alike", "the entry has several effects", lambda effects: len(effects) > 1)


def answer(verdict: Verdict) -> tuple[Sentence, ...]:
    """The diagnosis in a few sentences: size and stage of the model error, its causes, what
    remains."""
    return tuple(_answer(verdict))


def summary(verdict: Verdict) -> str:
    """`answer` as a text."""
    return " ".join(item.text for item in answer(verdict))


def is_agreement(verdict: Verdict) -> bool:
    """Whether the likeliest answer is that model and measurement agree."""
    return verdict.first.effects == (NONE,)


def is_unknown(verdict: Verdict) -> bool:
    """Whether the likeliest answer is that no effect of the catalogue explains the error."""
    return verdict.first.effects == (UNKNOWN,)


def _answer(verdict: Verdict) -> Iterator[Sentence]:
    yield from _size_and_stage(verdict)
    if is_agreement(verdict):
        yield _first_answer(verdict, "No effect is needed to explain it ({probability}).")
        yield from _without_weight(verdict)
        return
    if is_unknown(verdict):
        yield from _unknown(verdict)
        yield from _shares(verdict)
        return
    if verdict.cause_sets or verdict.named_sets:
        yield from _shares(verdict)
        yield from _other_first_answer(verdict)
    else:
        yield from _likeliest(verdict)
    yield from _hidden_parts(verdict)
    yield from _hardly_matters(verdict)
    yield from _two_probabilities(verdict)
    yield from _unseen(verdict)


# --- size and stage


def _size_and_stage(verdict: Verdict) -> Iterator[Sentence]:
    gap = verdict.gap
    sizes = [
        (Number(f"error in units of the {name}", gap.before / scale, "ratio"), name)
        for scale, name in ((gap.tolerance, "tolerance"), (gap.noise_floor, "measurement noise"))
        if scale > 0 and math.isfinite(gap.before / scale)
    ]
    ratios = tuple(ratio for ratio, _ in sizes)
    text = " and ".join(f"{ratio} times the {name}" for ratio, name in sizes)
    size = f"the model error is {text or 'of unknown size'}"
    if is_agreement(verdict):
        beyond = gap.beyond_noise or any(family.beyond_noise for family in gap.families)
        limits = " within the errors that a simulator has without any effect" if beyond else ""
        yield _first_answer(verdict, f"Model and measurement agree{limits}: {size}.", ratios)
        return
    places, shares = _stages(verdict)
    if gap.beyond_noise:
        yield Sentence(f"{sentence_start(size)}{places}.", (*ratios, *shares))
    else:
        words = f"{sentence_start(size)}, which is within tolerance and noise together{places}."
        evidence = {"value": float(gap.beyond_noise), "limit": 0.0}
        yield Sentence(words, (*ratios, *shares), WITHIN, evidence)
    yield from _largest_stage(verdict)


def _stages(verdict: Verdict) -> tuple[str, tuple[Number, ...]]:
    """Where the error arises, as the end of a sentence, with the shares that it shows."""
    stages = sorted(verdict.where.stage, key=lambda stage: -stage.share)
    if not stages:
        return "", ()
    shares = [Number("share", stage.share, "share") for stage in stages]
    largest = stage_name(stages[0].name)
    if stages[0].share >= _WHOLE or len(stages) == 1:
        return f"; it arises in {largest}", ()
    if stages[0].share >= MOST:
        return f"; most of it arises in {largest} ({shares[0]})", (shares[0],)
    shown = [
        (stage_name(stage.name), share)
        for stage, share in zip(stages, shares, strict=True)
        if stage.share >= LEAST_FRACTION
    ]
    if not shown:
        return "", ()
    places = join_words([f"{name} ({share})" for name, share in shown])
    return f"; it arises in {places}", tuple(share for _, share in shown)


def _largest_stage(verdict: Verdict) -> Iterator[Sentence]:
    """Of the stage that is off most given its measured input, where another makes most of the error
    at the end of the chain; or of several that are off alike, as far as these runs tell."""
    alike = verdict.where.nearly_largest
    stages = verdict.where.stage[:1] + alike
    sizes = tuple(Number("own error in tolerances", stage.own, "ratio") for stage in stages)
    names = join_words([stage_name(stage.name) for stage in stages])
    if alike:
        yield Sentence(
            f"{sentence_start(names)} are off by nearly the same "
            f"({join_words([str(size) for size in sizes])} times their tolerances): these runs "
            "cannot rank them.",
            sizes,
            ALIKE,
            {"effects": stages},
        )
    elif stages:
        largest = max(stage.share for stage in verdict.where.stage)
        if stages[0].share < largest:
            yield Sentence(
                f"Given its measured input, {names} is off most ({sizes[0]} tolerances).",
                sizes,
                EXCEEDS,
                {"value": largest, "limit": stages[0].share},
            )


# --- causes


def _shares(verdict: Verdict) -> Iterator[Sentence]:
    """Which effects cause how much; which take a part away only where they were fitted; what
    remains."""
    causes = [own for own in verdict.cause_sets if own.share >= MAKES_ERROR]
    fitted = [
        own
        for own in verdict.named_sets
        if own not in verdict.cause_sets and abs(own.share) >= MAKES_ERROR
    ]
    remainder, numbers = _remainder(verdict)
    if causes:
        words, shown = _parts(causes)
        ending = f"; {remainder}" if remainder else ""
        yield Sentence(
            f"{sentence_start(words)}{ending}.",
            (*shown, *numbers),
            CAUSE,
            {"evidence": _evidence(verdict, causes)},
        )
    for own in fitted:
        yield _fitted_only(verdict, own)
    if fitted and not causes and remainder:
        yield Sentence(f"{sentence_start(remainder)}.", numbers)


def _parts(sets: Sequence[EffectSet]) -> tuple[str, list[Number | Interval]]:
    parts: list[str] = []
    shown: list[Number | Interval] = []
    for own in sets:
        share = Number("share", own.share, "share")
        shown.append(share)
        text = str(share) if parts else f"causes {share} of it"
        if math.isfinite(sum(own.ci90)):
            interval = Interval("90 % interval", *own.ci90)
            shown.append(interval)
            text = f"{text} ({interval})"
        parts.append(f"{set_name(own.effects)} {text}")
    return join_words(parts), shown


def _evidence(verdict: Verdict, sets: Sequence[EffectSet]) -> tuple[HeldOutEvidence, ...]:
    return tuple(verdict.held_out(own) for own in sets)


def _fitted_only(verdict: Verdict, own: EffectSet) -> Sentence:
    (evidence,) = _evidence(verdict, [own])
    share = Number("share", own.share, "share")
    shown: tuple[Number, ...] = (share,)
    if not (verdict.path or verdict.shrinkage or own.held_out_gain):
        why = "there are too few configurations to test this on others"
    elif min(evidence.gain, evidence.gone) < LEAST_FRACTION:
        why = "none of it disappears on configurations that the fit has not seen"
    else:
        gone = Number("gone", evidence.gone, "share")
        shown = (share, gone)
        why = (
            f"that {gone} of the error disappears on configurations that the fit has not seen may "
            "be chance"
        )
    return Sentence(
        f"{sentence_start(set_name(own.effects))} takes {share} of it away in the runs that the "
        f"model was fitted to, but {why}: this is not established as a cause.",
        shown,
        FITTED_ONLY,
        {"evidence": (evidence,)},
    )


def _remainder(verdict: Verdict) -> tuple[str, tuple[Number | Interval, ...]]:
    """What no named set takes, as the end of a sentence."""
    members = {name for own in verdict.named_sets for name in own.effects}
    others = sum(effect.share for effect in verdict.effects if effect.effect not in members)
    ends: list[str] = []
    shown: list[Number | Interval] = []
    if others >= 2 * LEAST_FRACTION:
        shown.append(Number("share of other effects", others, "share"))
        ends.append(
            f"effects that the data do not establish take {shown[-1]} away where they were fitted"
        )
    if verdict.unexplained is not None:
        words, numbers = unexplained_words(verdict.unexplained)
        shown += numbers
        ends.append(words)
    return join_words(ends), tuple(shown)


def unexplained_words(unexplained: Unexplained) -> tuple[str, tuple[Number | Interval, ...]]:
    """What no effect explains, as the end of a sentence, with the numbers that it shows; no share
    where the error is larger with the effects than without them, for a part is at most the
    whole."""
    if unexplained.share >= _MORE_THAN_WHOLE:
        return (
            "with the effects that are likeliest the error is larger than without any, so that all "
            "of it remains unexplained"
        ), ()
    share = Number("share", unexplained.share, "share")
    interval = Interval("90 % interval", *unexplained_interval(unexplained))
    return f"{share} ({interval}) of the squared error remains unexplained", (share, interval)


def _hidden_parts(verdict: Verdict) -> Iterator[Sentence]:
    """Of each cause that makes the error no larger: why it is named all the same."""
    for own in verdict.cause_sets:
        if own.share >= MAKES_ERROR or own.held_out_gain < LEAST_FRACTION:
            continue
        gain = Number("adds held out", own.held_out_gain, "share")
        shown: tuple[Number, ...] = (gain,)
        size = "makes next to none of it by itself"
        if own.share <= -MAKES_ERROR:
            share = Number("share", own.share, "share")
            size, shown = f"hides a part of it ({share})", (share, gain)
        yield Sentence(
            f"{sentence_start(set_name(own.effects))} acts, too, and {size}: with it {gain} more "
            "of the error disappears on configurations that the fit has not seen.",
            shown,
            CAUSE,
            {"evidence": _evidence(verdict, [own])},
        )


def _without_weight(verdict: Verdict) -> Iterator[Sentence]:
    """Of each cause where model and measurement agree."""
    for own in verdict.cause_sets:
        probability = Number("probability", own.inclusion, "share")
        yield Sentence(
            f"{sentence_start(set_name(own.effects))} acts with a probability of {probability}, "
            "and hardly matters for this error.",
            (probability,),
            CAUSE,
            {"evidence": _evidence(verdict, [own])},
        )


def _hardly_matters(verdict: Verdict) -> Iterator[Sentence]:
    """Of causes that are established although the size of the error is within tolerance."""
    families = [family for family in verdict.gap.families if family.beyond_noise]
    if verdict.gap.beyond_noise or not families or not verdict.cause_sets:
        return
    sizes = [
        Number("error in tolerances", family.before / family.tolerance, "ratio")
        for family in families
    ]
    places = join_words(
        [
            f"the {family.family} ({size} times its tolerance)"
            for family, size in zip(families, sizes, strict=True)
        ]
    )
    yield Sentence(
        "It hardly matters for the size of the error, which is within tolerance; it shows in "
        f"{places}.",
        tuple(sizes),
        WITHIN,
        {"value": float(verdict.gap.beyond_noise), "limit": 0.0},
    )


# --- the first entry of the causes


def _first_answer(verdict: Verdict, text: str, shown: Sequence[Number | Interval] = ()) -> Sentence:
    """A sentence that rests on the first entry; `{probability}` in it is the entry's."""
    numbers = tuple(shown)
    if "{probability}" in text:
        probability = Number("probability", verdict.first.probability, "share")
        text, numbers = text.replace("{probability}", str(probability)), (*numbers, probability)
    others = [cause.probability for cause in verdict.causes[1:]]
    return Sentence(
        text, numbers, FIRST, {"probability": verdict.first.probability, "others": others}
    )


def _other_first_answer(verdict: Verdict) -> Iterator[Sentence]:
    """The first entry of the causes, where it has none of the effects of the largest cause."""
    first = {part for name in verdict.first.effects for part in name.split("+")}
    largest = next(iter(verdict.cause_sets or verdict.named_sets), None)
    if largest is not None and first.isdisjoint(largest.effects):
        name = join_words([set_subject(name, "with") for name in verdict.first.effects], "or")
        yield _first_answer(
            verdict,
            f"The likeliest answer as a whole has another effect: {name} ({{probability}}).",
        )


def _likeliest(verdict: Verdict) -> Iterator[Sentence]:
    """Of a verdict that names no set: its first entry, and whether it is established."""
    cause = verdict.first
    probability = Number("probability", cause.probability, "share")
    if verdict.effects:
        yield _first_answer(
            verdict,
            f"The likeliest answer is {join_words(_answers(verdict), 'or')} ({{probability}}).",
        )
        remainder, numbers = _remainder(verdict)
        if remainder:
            yield Sentence(f"No effect is established as a cause: {remainder}.", numbers)
        return
    whole = verdict.held_out_fraction or 0.0
    interval = next((item.ci90 for item in verdict.shrinkage if item.ci90 is not None), None)
    evidence = HeldOutEvidence(whole, whole, interval)
    if len(cause.effects) > 1:
        start = "Most probably it" if cause.probability >= _PROBABLE else "The likeliest cause"
        subject = join_words(_answers(verdict), "or")
        words = f"is {subject}, which these runs cannot tell apart (together {probability})."
        if evidence.is_established:
            yield Sentence(f"{start} {words}", (probability,), ALIKE, {"effects": cause.effects})
        else:
            yield _first_answer(verdict, f"The likeliest answer {words}", (probability,))
    elif cause.probability < _PROBABLE:
        subject = set_subject(cause.effects[0])
        yield _first_answer(
            verdict, f"No cause stands out; the likeliest is {subject} ({{probability}})."
        )
    elif evidence.is_established:
        verb = "cause it together" if "+" in cause.effects[0] else "causes it"
        yield Sentence(
            f"Most probably {set_subject(cause.effects[0])} {verb} ({probability}).",
            (probability,),
            CAUSE,
            {"evidence": (evidence,)},
        )
    else:
        yield _first_answer(
            verdict, f"The likeliest answer is {set_subject(cause.effects[0])} ({{probability}})."
        )


def _answers(verdict: Verdict) -> list[str]:
    return [set_subject(name, "with") for name in verdict.first.effects]


def at_least(share: Number) -> str:
    """`at least 97 %`; `> 99 %`, which says it already."""
    return str(share) if share.cell.startswith(">") else f"at least {share}"


def _two_probabilities(verdict: Verdict) -> Iterator[Sentence]:
    """What each of two probabilities is of, where the causes and the effects have different ones
    for the same set."""
    sets, first = verdict.cause_sets, verdict.first
    acts = Number("probability", min((own.inclusion for own in sets), default=math.nan), "share")
    whole = Number("probability", first.probability, "share")
    if not sets or acts.cell == whole.cell or not math.isfinite(acts.value):
        return
    members = {name for own in sets for name in own.effects}
    if {part for name in first.effects for part in name.split("+")} != members:
        return
    acting = (
        f"These effects act, each with a probability of {at_least(acts)}"
        if len(sets) > 1
        else f"This acts with a probability of {acts}"
    )
    yield _first_answer(
        verdict,
        f"{acting}, if the catalogue has every cause; that this is the whole answer has a "
        f"probability of {whole}.",
        (acts, whole),
    )


# --- nothing in the catalogue


def _unknown(verdict: Verdict) -> Iterator[Sentence]:
    if verdict.cause_sets:
        yield _first_answer(
            verdict,
            "The effects of the catalogue explain only a part of it (unknown: {probability}).",
        )
        return
    ending = ""
    shown: tuple[Number | Interval, ...] = ()
    if verdict.unexplained is not None:
        words, shown = unexplained_words(verdict.unexplained)
        ending = f": {words}"
        for effect in nearest_effects(verdict)[:1]:
            ending += f"; {effect_subject(effect.effect)} comes nearest"
    yield _first_answer(
        verdict,
        f"No effect of the catalogue explains it (unknown: {{probability}}){ending}.",
        shown,
    )


def nearest_effects(verdict: Verdict) -> tuple[EffectShare, ...]:
    """Up to three effects that take most away on configurations that they were not fitted to, the
    largest first."""
    helpful = [effect for effect in verdict.effects if effect.held_out_gain >= LEAST_FRACTION]
    return tuple(sorted(helpful, key=lambda effect: -effect.held_out_gain)[:NEAREST])


# --- configurations that the fit has not seen


def _unseen(verdict: Verdict) -> Iterator[Sentence]:
    fraction = verdict.held_out_fraction
    if fraction is None or not math.isfinite(fraction):
        return
    gone = Number("gone", fraction, "share")
    start = "On configurations that the fit has not seen,"
    if fraction <= -LEAST_FRACTION:
        yield Sentence(
            f"{start} the error is larger with the effects than without them.",
            (),
            WITHIN,
            {"value": fraction, "limit": LEAST_FRACTION},
        )
        return
    if fraction < LEAST_FRACTION:
        yield Sentence(
            f"{start} none of the error above the noise disappears.",
            (),
            WITHIN,
            {"value": fraction, "limit": LEAST_FRACTION},
        )
        return
    words = f"{start} {gone} of the error above the noise disappears"
    interval = verdict.held_out_interval
    if interval is None:
        evidence = {"value": fraction, "limit": LEAST_FRACTION}
        yield Sentence(f"{words}.", (gone,), REACHES, evidence)
    elif interval[0] > 0:
        yield Sentence(f"{words}.", (gone,), ESTABLISHED, {"interval": interval})
    else:
        shown = Interval("90 % interval", *interval)
        evidence = {"value": interval[0], "limit": 0.0}
        text = f"{words}, which may be chance (90 % interval {shown})."
        yield Sentence(text, (gone, shown), WITHIN, evidence)


def held_out_sentence(entry: Shrinkage, verdict: Verdict) -> Sentence:
    """What one test on configurations that the fit has not seen gave."""
    steps, what = len(verdict.path) or len(entry.effects), held_out_name(entry, verdict)
    if steps > MOST_NAMES:
        what = f"all {steps} steps of the path" if verdict.path else f"{steps} effects"
    what = sentence_start(what) if "." not in what.partition(" ")[0] else what
    before, after = Number("before", entry.before, "size"), Number("after", entry.after, "size")
    sizes = f"{before} before, {after} after, held out by {entry.held_out_by}"
    if entry.fraction is None:
        return Sentence(f"{what}: {sizes}; there was no error to reduce.", (before, after))
    shown: list[Number | Interval] = [before, after]
    if entry.fraction <= -LEAST_FRACTION:
        text = f"{what}: {sizes}; the error is larger with the effects than without them."
    else:
        gone = Number("gone", entry.fraction, "share")
        shown.append(gone)
        share = str(gone)
        if entry.ci90 is not None:
            interval = Interval("90 % interval", *entry.ci90)
            shown.append(interval)
            share = f"{gone} ({interval})"
        text = f"{what}: {sizes}; {share} of the error above the noise disappears."
    if CORRECTED in entry.more:
        corrected = Number("after a learned correction", entry.more[CORRECTED][1], "size")
        shown.append(corrected)
        text += (
            f" With a learned correction of the rest {corrected} would be left; a correction is "
            "not a cause."
        )
    return Sentence(text, tuple(shown))


# --- places


def where_sentences(where: Where) -> Iterator[Sentence]:
    """A sentence for each finding about where the error lies."""
    for stage in where.stage:
        share, interval = Number("share", stage.share, "share"), Interval("share", *stage.ci90)
        yield Sentence(
            f"The {stage.name} makes {share} ({interval}) of the error at the end of the chain; "
            f"its own error is {own_error(stage.own, stage.own_ci90)} tolerances.",
            (share, interval),
        )
    for region in where.factors:
        excess = Number("excess", region.excess, "size")
        p_value = Number("p", region.p_value, "size")
        yield Sentence(
            f"Where {region.rule}, the error exceeds that of the other settings by {excess} times "
            f"the measurement noise (p = {p_value}).",
            (excess, p_value),
        )
    for window in where.time:
        yield Sentence(f"In time the error stands out in {span_label(window)}.")
    for band in where.frequency:
        yield Sentence(f"In frequency the error stands out in {span_label(band)}.")
    for drift in where.drift:
        yield Sentence(with_labels(drift))


def own_error(own: float, interval: tuple[float, float] | None) -> str:
    """`4.2 (3.6 to 4.7)`: a stage's error given its measured input, in tolerances, with its 90 %
    interval."""
    if interval is None:
        return number(own)
    value, low, high = format_interval(own, *interval)
    if len(value.replace(".", "").lstrip("0")) > _DIGITS_OF_RATIO:  # a tolerance has no more
        value, low, high = (number(size) for size in (own, *interval))
    return value if low == value == high else f"{value} ({low} to {high})"


# --- the effects that pictures are drawn with


def drawn_effects(verdict: Verdict) -> str:
    """What the "model with effects" of the pictures is; "" where nothing is drawn after."""
    names = [
        join_words([effect_subject(identity) for identity in own])
        for own in verdict.pictures.drawn_effects
    ]
    if not names:
        return ""
    if not verdict.cause_sets:
        return (
            f"The model with effects has the likeliest effects, fitted to all runs: {names[0]}. "
            "The data do not establish them as causes."
        )
    if len(names) == 1:
        return f"The model with effects has {names[0]}, fitted to all runs."
    return (
        f"The model with effects is the mean of {len(names)} predictions, each fitted to all runs: "
        f"with {join_words(names, 'or with')}."
    )
