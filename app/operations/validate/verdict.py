"""The scores of `validate --json` in sentences: whether the 90 % bands hold, and how far off the
predictions are."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ....validation.prediction_scores.quantity_score import ERROR, Coverage
from ...common.number_format import join_words, signed_percent
from ..sentence import (
    HOLDS,
    NOT_ENOUGH,
    TOO_NARROW,
    TOO_WIDE,
    Number,
    Rule,
    Sentence,
    sentence,
)

#: The share of measured values that a 90 % band promises to hold.
NOMINAL = 0.90
#: As many independent values are needed that, if all lie inside, the interval begins above this.
_LEAST_LOW = 0.75

#: A group of shots that is predicted wrong, and not by chance.
DEVIATES = Rule(
    "deviates",
    f"the deviation is not zero, with a probability of chance of {ERROR:g} at most",
    lambda bias, p_value: bias != 0 and p_value <= ERROR,
)

Row = Mapping[str, Any]


def joint_interval(row: Row, quantities: int) -> tuple[float, float]:
    """The interval of a row's share inside the 90 % band, where so many quantities share the 5 % of
    errors. Results of older software have the interval of each quantity by itself alone."""
    if "coverage90_joint_ci95" in row:
        low, high = row["coverage90_joint_ci95"]
    elif "effective_values" in row:
        coverage = Coverage(
            row["coverage90"], row["values"], row["configurations"], row["effective_values"]
        )
        low, high = coverage.interval(quantities)
    else:
        low, high = row["coverage90_ci95"]
    return float(low), float(high)


def needed_values(quantities: int) -> int:
    """Independent values below which nothing is said of bands that seem to hold."""
    return math.ceil(math.log(ERROR / (2 * quantities)) / math.log(_LEAST_LOW))


def is_calibrated(data: Mapping[str, Any]) -> bool:
    """Whether no 90 % band holds so few of the measured values that chance does not explain it.

    Bands that are too wide are no danger to a user, and too few shots tell nothing against a twin.
    """
    return not _Coverages(data["quantities"]).narrow


def verdict_sentences(data: Mapping[str, Any]) -> list[Sentence]:
    """Whether the bands hold, of all quantities together, and the median errors.

    Each coverage has a 95 % interval that is shared among the quantities (Bonferroni), so that a
    calibrated twin is called so in 95 of 100 campaigns. Raises `ValueError` without a quantity.
    """
    if not data["quantities"]:
        raise ValueError(
            "no quantity was measured in any shot: there is nothing to compare with the predictions"
        )
    coverages = _Coverages(data["quantities"])
    return [*coverages.sentences(), _errors(data["quantities"])]


def verdict_text(data: Mapping[str, Any]) -> str:
    """The sentences as one text."""
    return " ".join(map(str, verdict_sentences(data)))


class _Coverages:
    """The quantities by what their interval says of their 90 % band."""

    def __init__(self, rows: Sequence[Row]) -> None:
        self.rows = rows
        self.needed = needed_values(len(rows)) if rows else 0
        self.intervals = [joint_interval(row, len(rows)) for row in rows]
        self.narrow = [i for i, (_, high) in enumerate(self.intervals) if high < NOMINAL]
        self.wide = [i for i, (low, _) in enumerate(self.intervals) if low > NOMINAL]
        within = [i for i in range(len(rows)) if i not in (*self.narrow, *self.wide)]
        self.held = [i for i in within if independent_values(rows[i]) >= self.needed]
        self.unknown = [i for i in within if i not in self.held]

    def sentences(self) -> Iterator[Sentence]:
        if self.narrow:
            yield self._listed(
                "Not calibrated: the 90 % bands hold only {listed}.", TOO_NARROW, self.narrow
            )
            return
        if not self.held and not self.wide:
            shares = self._not_enough(
                "Too little to judge the 90 % bands, {shots} of {configurations}: inside lie "
                "{listed}. They are as well known as from {count} independent values at most, and "
                f"{self.needed} are needed.",
                range(len(self.rows)),
            )
            yield shares
            return
        if self.held:
            yield self._hold()
        if self.wide:
            begin = (
                "Some bands are wider than needed"
                if self.held
                else "The 90 % bands are wider than needed"
            )
            yield self._listed(f"{begin}: inside lie {{listed}}.", TOO_WIDE, self.wide)
        if self.unknown:
            names = join_words([self._name(i) for i in self.unknown])
            yield self._not_enough(
                f"Nothing can be said of the bands of {names}: their shares are as well known as "
                f"from {{count}} independent values at most, and {self.needed} are needed.",
                self.unknown,
            )

    def _name(self, place: int) -> str:
        return quantity_words(self.rows[place]["name"])

    def _evidence(self, places: Sequence[int]) -> dict[str, Any]:
        """From the lowest to the highest end: what lies beside the level as a whole does so in each
        part."""
        lows, highs = zip(*(self.intervals[i] for i in places), strict=True)
        return {"interval": (min(lows), max(highs)), "level": NOMINAL}

    def _shares(self, places: Sequence[int]) -> tuple[str, list[Number]]:
        """Coverage of each quantity, those of the same share together."""
        names: dict[str, list[str]] = {}
        numbers = []
        for i in sorted(places, key=lambda i: float(self.rows[i]["coverage90"])):
            number = _share(self.rows[i]["coverage90"])
            numbers.append(number)
            names.setdefault(str(number), []).append(self._name(i))
        parts = [
            f"{share} of the measured values of {join_words(words)}"
            for share, words in names.items()
        ]
        return ", ".join(parts), numbers

    def _listed(self, template: str, rule: Rule, places: Sequence[int]) -> Sentence:
        listed, numbers = self._shares(places)
        return Sentence(template.format(listed=listed), numbers, rule, self._evidence(places))

    def _hold(self) -> Sentence:
        shares = [self.rows[i]["coverage90"] for i in self.held]
        low, high = _share(min(shares)), _share(max(shares))
        lows, highs = zip(*(self.intervals[i] for i in self.held), strict=True)
        inside = "{low}" if str(low) == str(high) else "{low} to {high}"
        which = (
            ""
            if len(self.held) == len(self.rows)
            else f" of {join_words([self._name(i) for i in self.held])}"
        )
        counts = self._counts(self.held)
        return sentence(
            f"The 90 % bands{which} hold: {inside} of the measured values lie inside, in "
            f"{_counted(counts)}.",
            HOLDS,
            # what both the highest low end and the lowest high end admit, each interval admits
            {"interval": (max(lows), min(highs)), "level": NOMINAL},
            low=low,
            high=high,
            **counts,
        )

    def _not_enough(self, template: str, places: Sequence[int]) -> Sentence:
        count = max(independent_values(self.rows[i]) for i in places)
        listed, numbers = self._shares(places)
        counts = self._counts(places)
        shown = {
            "listed": listed,
            "count": Number("independent values", count, "count"),
            "shots": _plural(counts["shots"], "shot"),
            "configurations": _plural(counts["configurations"], "configuration"),
        }
        used = [*numbers, *counts.values()] if "{listed}" in template else []
        return Sentence(
            template.format(**shown),
            [Number("independent values", count, "count"), *used],
            NOT_ENOUGH,
            {"count": count, "needed": self.needed},
        )

    def _counts(self, places: Sequence[int]) -> dict[str, Number]:
        return {
            name: Number(name, max(self.rows[i].get(name, 0) for i in places), "count")
            for name in ("shots", "configurations")
        }


def _counted(counts: Mapping[str, Number]) -> str:
    return (
        f"{_plural(counts['shots'], 'shot')} of "
        f"{_plural(counts['configurations'], 'configuration')}"
    )


def _plural(count: Number, noun: str) -> str:
    return f"{count} {noun}{'s' * (count.value != 1)}"


def _share(value: float) -> Number:
    return Number("coverage90", value, "share")


def independent_values(row: Row) -> int:
    """How many independent values a share is as well known from."""
    return int(row.get("effective_values", row.get("configurations", 0)) + 1e-9)


def quantity_words(name: str) -> str:
    """ "peak_force" as "peak force", "srs_acceleration_1" as "spectrum, acceleration_1"."""
    if name == "velocity":
        return "impact velocity"
    for start, words in (("srs_", "spectrum, "), ("peak_acceleration_", "peak acceleration, ")):
        if name.startswith(start):
            return words + name.removeprefix(start)
    return name.replace("_", " ")


def error_number(value: float, unit: str) -> Number:
    """An error of a quantity: of logarithms as a part of the value, of spectra in dB."""
    if unit == "dB":
        return Number("median_error_db", round(value, 2))
    return Number("median_error", math.expm1(value), "part")


def _errors(rows: Sequence[Row]) -> Sentence:
    """The median error of the quantity that is predicted worst for each unit."""
    worst = {
        row["unit"]: row for row in sorted(rows, key=lambda row: float(row["median_abs_error"]))
    }
    numbers = [error_number(row["median_abs_error"], row["unit"]) for row in worst.values()]
    parts = [
        f"the {quantity_words(row['name'])} is off by {number}"
        for row, number in zip(worst.values(), numbers, strict=True)
    ]
    text = join_words(parts)
    return Sentence(f"{text[0].upper()}{text[1:]} in the median.", numbers)


def prediction_deviation(bias: float, unit: str) -> str:
    """What the predictions differ by from the measured values in the mean, where `bias` is measured
    less predicted: `+27.2 %` of predictions that are too high."""
    if unit == "dB":
        return f"{-bias:+.2f} dB".replace("-", "−")
    return signed_percent(math.expm1(-bias))


def failure_rows(data: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The failures as rows of a table: which shots, which quantity, by how much its predictions
    differ from what was measured, and the probability of chance."""
    units = {row["name"]: row["unit"] for row in data["quantities"]}
    return [
        {
            "where": failure["rule"].replace("_", " "),
            "quantity": quantity_words(failure["quantity"]),
            "prediction": _failure_words(failure["bias"], units.get(failure["quantity"], "ln")),
            "shots": failure["shots"],
            "p_value": float(failure["p_value"]),
        }
        for failure in data["failures"]
        if "bias" in failure
    ]


def _failure_words(bias: float, unit: str) -> str:
    """Rounded as the sentence of the failure is (`PredictionFailure.sentence`)."""
    size = f"{100 * abs(bias):.0f} %"
    if unit == "dB":
        size = f"{abs(20 * math.log10(1 + bias)):.1f} dB"
    return f"{size} too {'low' if bias < 0 else 'high'}"


def failure_sentences(data: Mapping[str, Any]) -> list[Sentence]:
    """Where the predictions fail. Each is named because chance does not explain it."""
    return [
        Sentence(
            failure["sentence"],
            (),
            DEVIATES if "p_value" in failure else None,
            {key: failure[key] for key in ("bias", "p_value") if key in failure},
        )
        for failure in data["failures"]
    ]
