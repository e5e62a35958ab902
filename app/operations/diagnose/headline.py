"""What the page of a diagnosis says before its pictures: the size of the model error, what causes
it, and how sure that is, in two sentences whose numbers stand in the tables and figures below."""

from __future__ import annotations

from ....diagnosis.verdict import LEAST_FRACTION, EffectSet, Verdict
from ...common.number_format import join_words
from ..sentence import Number, Sentence
from .statements import CAUSE, FIRST, MAKES_ERROR, answer, at_least, is_agreement, is_unknown
from .waterfall import short_names
from .wording import ACTS, MOST_NAMES, WHOLE_ANSWER, sentence_start


def headline(verdict: Verdict) -> tuple[Sentence, ...]:
    """The size of the error and, in a sentence of its own, what the diagnosis concludes."""
    size, *others = answer(verdict)
    causes = [own for own in verdict.cause_sets if own.share >= MAKES_ERROR]
    if is_unknown(verdict):
        return size, _unknown(verdict, bool(causes))
    if is_agreement(verdict) or not causes:
        return (size, *others[:1])
    return size, _cause(verdict, causes)


def _cause(verdict: Verdict, causes: list[EffectSet]) -> Sentence:
    names = [_spoken(own) for own in causes[:MOST_NAMES]]
    if len(causes) > MOST_NAMES:
        names.append(f"{len(causes) - MOST_NAMES} more sets of effects")
    verb = "cause" if len(names) > 1 else "causes"
    evidence = {"evidence": tuple(verdict.held_out(own) for own in causes)}
    if is_whole_answer(verdict):
        number = Number(WHOLE_ANSWER, verdict.first.probability, "share")
        sure = f"that this is the whole answer has a probability of {number}"
    else:
        least = min(causes, key=lambda own: own.inclusion)
        number = Number(ACTS, least.inclusion, "share")
        sure = (
            f"each acts with a probability of {at_least(number)}, if the catalogue has every cause"
            if len(causes) > 1
            else f"it acts with a probability of {number}, if the catalogue has every cause"
        )
    text, shown = f"{sentence_start(join_words(names))} {verb} it; {sure}", [number]
    fraction = verdict.held_out_fraction
    if fraction is not None and fraction >= LEAST_FRACTION:
        gone = Number("gone", fraction, "share")
        shown.append(gone)
        text += (
            f", and {gone} of the error above the noise disappears on configurations that the fit "
            "has not seen"
        )
    return Sentence(f"{text}.", tuple(shown), CAUSE, evidence)


def _unknown(verdict: Verdict, in_part: bool) -> Sentence:
    number = Number("probability", verdict.first.probability, "share")
    start = (
        "The effects of the catalogue explain only a part of it"
        if in_part
        else "No effect of the catalogue explains it"
    )
    others = [cause.probability for cause in verdict.causes[1:]]
    return Sentence(
        f"{start}: that the cause is unknown, outside of the catalogue, has a probability of "
        f"{number}.",
        (number,),
        FIRST,
        {"probability": verdict.first.probability, "others": others},
    )


def _spoken(own: EffectSet) -> str:
    """`the flow resistance of the barrel or of the valve (these runs cannot tell which)`."""
    name = f"the {short_names(own.effects)}"
    return name if len(own.effects) == 1 else f"{name} (these runs cannot tell which)"


def is_whole_answer(verdict: Verdict) -> bool:
    """Whether the first entry of the causes has the effects of the sets that are causes, and no
    others: its probability is then that of the sentence."""
    members = {name for own in verdict.cause_sets for name in own.effects}
    return {part for name in verdict.first.effects for part in name.split("+")} == members


def size_words(verdict: Verdict, configurations: int) -> str:
    """What the size of the error is a number of, in a line below the sentences."""
    gap = verdict.gap
    where = f" over {configurations} configurations" if configurations else ""
    return (
        f"Size: {gap.metric}{where}. Errors with effects are those of configurations that the fit "
        "has not seen."
    )
