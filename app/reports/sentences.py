"""What a diagnosis says, in the words of the bench: sentences that the terminal and the page share."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from ...diagnosis.verdict import NONE, UNKNOWN, Cause, Fitted, NextRun, Shrinkage, Verdict, Where
from ...twin.effects import catalogue

#: From this probability on a cause is said to be it; below, to come first.
_PROBABLE = 0.5


def verdict_sentence(verdict: Verdict) -> str:
    """The whole diagnosis in one sentence."""
    first = verdict.first
    size = size_words(verdict)
    if first.effects == (NONE,):
        return f"{verdict.campaign}: measurement and simulator agree, {size} (no effect: {percent(first.probability)})."
    if first.effects == (UNKNOWN,):
        where = f", in the {verdict.where.stage[0].name} stage" if verdict.where.stage else ""
        return (
            f"{verdict.campaign}: {size}{where}, and no effect of the catalogue explains it "
            f"(unknown: {percent(first.probability)})."
        )
    return f"{verdict.campaign}: {size}; {_cause_words(first)}{_shrinks(verdict)}."


def size_words(verdict: Verdict) -> str:
    """How large the gap is."""
    gap = verdict.gap
    floors = f", {number(gap.before / gap.noise_floor)} noise floors" if gap.noise_floor > 0 else ""
    within = "" if gap.beyond_noise else ", within noise floor and tolerance"
    return f"the gap is {number(gap.before)} ({gap.metric}{floors}{within})"


def _cause_words(cause: Cause) -> str:
    how = "most probably" if cause.probability >= _PROBABLE else "no cause stands out; first comes"
    if len(cause.effects) > 1:
        told = f"one of {', '.join(cause.effects)}, which these runs cannot tell apart"
        return f"{how} {told} (together {percent(cause.probability)})"
    if "+" in cause.effects[0]:
        told = " and ".join(cause.effects[0].split("+")) + " together"
        return f"{how} {told} ({percent(cause.probability)})"
    numbers = ", ".join(fitted_words(parameter) for parameter in cause.parameters)
    return f"{how} {cause.effects[0]} ({percent(cause.probability)}{': ' + numbers if numbers else ''})"


def _shrinks(verdict: Verdict) -> str:
    own = [each for each in verdict.shrinkage if set(each.effects) & set(verdict.first.effects)]
    found = next((each for each in own if each.fraction is not None), None)
    if found is None or found.fraction is None:
        return ""
    return f"; with it the gap of configurations that it has not seen shrinks by {percent(found.fraction)}"


def fitted_words(parameter: Fitted) -> str:
    """`compliance_m_n = 3.4e-08 m/N (2.6e-08 to 4.1e-08)`."""
    unit = "" if parameter.unit in ("", "1") else f" {parameter.unit}"
    low, high = parameter.ci90
    value, low_text, high_text = (_beside(each, high - low) for each in (parameter.value, low, high))
    return f"{parameter.name} = {value}{unit} ({low_text} to {high_text})"


def _beside(value: float, width: float) -> str:
    """A number with the digits that a width calls for, three at least."""
    if not (math.isfinite(value) and width > 0 and abs(value) > width):
        return number(value)
    digits = min(2 + math.ceil(math.log10(abs(value) / width)), 9)
    return number(value) if digits <= 3 else f"{value:.{digits}g}"


def cause_name(cause: Cause) -> str:
    """The ids of an entry; a group's with their shares."""
    if len(cause.effects) == 1:
        return cause.effects[0]
    if len(cause.split) != len(cause.effects):
        return " or ".join(cause.effects)
    return " or ".join(f"{name} ({percent(share)})" for name, share in zip(cause.effects, cause.split, strict=True))


def effect_title(identity: str) -> str:
    """The equation of an effect; what "none" and "unknown" mean."""
    words: Mapping[str, str] = {NONE: "agreement within tolerance", UNKNOWN: "nothing in the catalogue"}
    if identity in words:
        return words[identity]
    return f"{identity}: {catalogue()[identity].law}" if identity in catalogue() else ""


def where_lines(where: Where) -> Iterator[str]:
    """Each finding about where the gap lies."""
    for stage in where.stage:
        low, high = stage.ci90
        yield (
            f"stage {stage.name}: {percent(stage.share)} of the gap at the end ({percent(low)} to {percent(high)}); "
            f"its own gap is {number(stage.own)} tolerances"
        )
    for region in where.factors:
        yield f"where {region.rule}: {number(region.excess)} floors more than elsewhere (p = {number(region.p_value)})"
    for window in where.time:
        yield f"{window.channel}: {number(1e3 * window.from_s)} to {number(1e3 * window.to_s)} ms"
    for band in where.frequency:
        yield f"{band.channel}: {number(band.from_hz)} to {number(band.to_hz)} Hz"
    yield from where.drift


def shrinkage_line(entry: Shrinkage) -> str:
    """One line on unseen configurations."""
    what = " + ".join(entry.effects) or "no effect"
    told = f"{what}, held out by {entry.held_out_by}: {number(entry.before)} before, {number(entry.after)} after"
    if entry.fraction is None:
        return f"{told}; no gap to shrink"
    between = "" if entry.ci90 is None else f" ({percent(entry.ci90[0])} to {percent(entry.ci90[1])})"
    return f"{told}; {percent(entry.fraction)} of what is above the floor{between}"


def next_run_line(run: NextRun) -> str:
    """A setting in the units of the bench, and how many shots of it."""
    settings = ", ".join(f"{key} = {_level(value)}" for key, value in run.settings.items())
    shots = "1 run" if run.runs_needed == 1 else f"{run.runs_needed} runs"
    return f"{shots} at {settings}: {run.why}"


def _level(value: str | float) -> str:
    return value if isinstance(value, str) else number(value)


def percent(share: float) -> str:
    """`93 %`; never 100 or 0 for what is only near it."""
    if 0.995 <= share < 1:
        return "> 99 %"
    if 0 < share < 0.005:
        return "< 1 %"
    return f"{100 * share:.0f} %"


def number(value: float) -> str:
    """Three digits."""
    text = f"{value:.3g}"
    return f"{float(text):.0f}" if "e+" in text and abs(value) < 1e6 else text
