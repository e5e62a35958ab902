"""Lines of a diagnosis that the terminal and the page share; its first sentences are `diagnosis.summary`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from ...diagnosis.labels import with_labels
from ...diagnosis.number_format import number, percent, percent_range, rounded_beside
from ...diagnosis.verdict import NONE, UNKNOWN, Cause, Fitted, Shrinkage, Where
from ...twin.effects import catalogue

#: Among the further figures of a shrinkage: what is left when the learned discrepancy corrects the rest.
LEARNED = "with the learned discrepancy"


def fitted_words(parameter: Fitted) -> str:
    """`compliance_m_n = 3.4e-08 m/N (2.6e-08 to 4.1e-08)`."""
    unit = "" if parameter.unit in ("", "1") else f" {parameter.unit}"
    low, high = parameter.ci90
    value, low_text, high_text = (rounded_beside(each, high - low) for each in (parameter.value, low, high))
    return f"{parameter.name} = {value}{unit} ({low_text} to {high_text})"


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
        between = f"{percent(stage.share)} ({percent_range(*stage.ci90)})"
        yield (
            f"The {stage.name} makes {between} of the error at the end of the chain; its own error is "
            f"{number(stage.own)} tolerances."
        )
    for region in where.factors:
        yield (
            f"Where {region.rule}, the error exceeds that of the other settings by {number(region.excess)} times the "
            f"measurement noise (p = {number(region.p_value)})."
        )
    for window in where.time:
        times = f"{number(1e3 * window.from_s)} to {number(1e3 * window.to_s)} ms"
        yield f"In time the error stands out in the {_channel(window.channel)} from {times}."
    for band in where.frequency:
        lines = f"{number(band.from_hz)} to {number(band.to_hz)} Hz"
        yield f"In frequency the error stands out in the {_channel(band.channel)} from {lines}."
    yield from map(with_labels, where.drift)


def _channel(name: str) -> str:
    return name.replace("_", " ")


def shrinkage_line(entry: Shrinkage) -> str:
    """One sentence on configurations that the fit has not seen."""
    what = " + ".join(entry.effects) or "No effect"
    sizes = f"{number(entry.before)} before, {number(entry.after)} after, held out by {entry.held_out_by}"
    if entry.fraction is None:
        return f"{what}: {sizes}; there was no error to reduce."
    between = "" if entry.ci90 is None else f" ({percent_range(*entry.ci90)})"
    told = f"{what}: {sizes}; {percent(entry.fraction)}{between} of the error above the noise disappears"
    if LEARNED not in entry.more:
        return f"{told}."
    after = number(entry.more[LEARNED][1])
    return f"{told}. With a learned correction of the rest {after} would be left; a correction is not a cause."
