"""Lines of a diagnosis that the terminal and the page share; its first sentences are `diagnoses.summary`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from ...diagnosis.verdict import CORRECTED, NONE, UNKNOWN, Cause, Fitted, Shrinkage, Where
from ...twin.effects import catalogue
from ..diagnoses.labels import span_label, with_labels
from ..number_format import number, number_beside, percent, percent_with_range


def fitted_words(parameter: Fitted) -> str:
    """`compliance_m_n = 3.4e-08 m/N (2.6e-08 to 4.1e-08)`."""
    low, high = parameter.ci90
    value, low_text, high_text = (number_beside(item, high - low) for item in (parameter.value, low, high))
    return f"{parameter.name} = {f'{value} {parameter.unit}'.rstrip()} ({low_text} to {high_text})"


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
    """A sentence for each finding about where the error lies."""
    for stage in where.stage:
        share = percent_with_range(stage.share, stage.ci90)
        yield (
            f"The {stage.name} makes {share} of the error at the end of the chain; its own error is "
            f"{number(stage.own)} tolerances."
        )
    for region in where.factors:
        yield (
            f"Where {region.rule}, the error exceeds that of the other settings by {number(region.excess)} times the "
            f"measurement noise (p = {number(region.p_value)})."
        )
    for window in where.time:
        yield f"In time the error stands out in {span_label(window)}."
    for band in where.frequency:
        yield f"In frequency the error stands out in {span_label(band)}."
    yield from map(with_labels, where.drift)


def shrinkage_line(entry: Shrinkage) -> str:
    """One sentence on configurations that the fit has not seen."""
    what = " + ".join(entry.effects) or "No effect"
    sizes = f"{number(entry.before)} before, {number(entry.after)} after, held out by {entry.held_out_by}"
    if entry.fraction is None:
        return f"{what}: {sizes}; there was no error to reduce."
    share = percent(entry.fraction) if entry.ci90 is None else percent_with_range(entry.fraction, entry.ci90)
    sentence = f"{what}: {sizes}; {share} of the error above the noise disappears"
    if CORRECTED not in entry.more:
        return f"{sentence}."
    after = number(entry.more[CORRECTED][1])
    return f"{sentence}. With a learned correction of the rest {after} would be left; a correction is not a cause."
