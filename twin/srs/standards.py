"""When a spectrum meets a specification: tolerances, and what a standard asks of all lines
together.

The texts of the standards are not freely copied; the numbers here are those that secondary sources
give for them (test houses' data sheets and papers). Compare them with the edition that a test is
contracted to.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats


@dataclass(frozen=True)
class PassRule:
    """What all lines together must keep to, beside the tolerance of each.

    At least `share_within` of the lines lie within their tolerance, and the others within
    `+wider_upper_db` and `-wider_lower_db` where these are given. At least `share_above` of the
    lines lie at the level or above it. `clause` says where the rule stands; it is empty for one
    that no standard makes.
    """

    name: str = ""
    clause: str = ""
    share_within: float = 1.0
    wider_upper_db: float | None = None
    wider_lower_db: float | None = None
    share_above: float = 0.0

    def required_within(self, lines: int) -> int:
        """How many lines must lie within their tolerance.

        Parameters:
            lines: How many lines there are.
        """
        return _at_least(self.share_within, lines)

    def required_above(self, lines: int) -> int:
        """How many lines must lie at the level or above it.

        Parameters:
            lines: How many lines there are.
        """
        return _at_least(self.share_above, lines)


def _at_least(share: float, lines: int) -> int:
    """Whole lines: 95 % of 41 lines are 39."""
    return int(np.ceil(share * lines - 1e-9))


EVERY_LINE = PassRule()


@dataclass(frozen=True)
class Tolerance:
    """Bands: from `from_hz` on (the first is 0), a line may lie `upper_db` above and `lower_db`
    below its level."""

    from_hz: tuple[float, ...]
    upper_db: tuple[float, ...]
    lower_db: tuple[float, ...]
    rule: PassRule = EVERY_LINE

    def __post_init__(self) -> None:
        if not all(value >= 0 for value in (*self.upper_db, *self.lower_db)):
            raise ValueError(
                f"tolerance +{self.upper_db} / "
                f"-{self.lower_db} dB: expected 0 dB or more, either way"
            )

    def at(self, frequency_hz: Floats) -> tuple[Floats, Floats]:
        """Upper and lower tolerance at lines, (f,) each, dB.

        Parameters:
            frequency_hz: The lines (f,).
        """
        band = np.searchsorted(self.from_hz, frequency_hz, side="right") - 1
        return np.asarray(self.upper_db)[band], np.asarray(self.lower_db)[band]


def within_db(upper: float, lower: float | None = None) -> Tolerance:
    """The same tolerance at every frequency.

    Parameters:
        upper: How far a line may lie above its level, dB.
        lower: How far a line may lie below its level, dB, not negative; by default None, as far as
            above.

    Raises:
        ValueError: For less than 0 dB.
    """
    return Tolerance((0.0,), (upper,), (upper if lower is None else lower,))


#: NASA-STD-7003A (2011), test control tolerances of the maximax spectrum at Q = 10: 6 dB either way
#: to 3 kHz, +9 / -6 dB above, and at least half of the magnitudes above the nominal specification.
#: A line at 3 kHz belongs to the lower band.
NASA_STD_7003 = Tolerance(
    (0.0, 3000.01),
    (6.0, 9.0),
    (6.0, 6.0),
    PassRule("NASA-STD-7003A", "test control tolerances", share_above=0.5),
)
#: MIL-STD-810H Method 517.3 (pyroshock), test tolerances of a simulated shock's maximax spectrum:
#: -3 / +6 dB over at least 80 % of the band, -6 / +9 dB over the rest.
MIL_STD_810H_517 = Tolerance(
    (0.0,),
    (6.0,),
    (3.0,),
    PassRule(
        "MIL-STD-810H Method 517.3", "test tolerances", 0.8, wider_upper_db=9.0, wider_lower_db=6.0
    ),
)
#: ECSS-E-HB-32-25A (2015) repeats the shock row of the table of test tolerances of ECSS-E-ST-10-03C
#: (table 4-1, which a paraphrase of the standard places in clause 4.4.2): -3 / +6 dB of the
#: response spectrum, and half of its amplitudes above 0 dB.
ECSS_E_HB_32_25A = Tolerance(
    (0.0,),
    (6.0,),
    (3.0,),
    PassRule("ECSS-E-HB-32-25A", "test tolerances of ECSS-E-ST-10-03C", share_above=0.5),
)

NAMED_TOLERANCES = {
    "nasa-std-7003": NASA_STD_7003,
    "mil-std-810h-517": MIL_STD_810H_517,
    "ecss-e-hb-32-25a": ECSS_E_HB_32_25A,
}
_SYNONYMS = {"nasa-std-7003a": "nasa-std-7003", "ecss-e-st-10-03c": "ecss-e-hb-32-25a"}
_ONE = re.compile(r"(?:±|\+-|\+/-)?\s*(\d+(?:\.\d+)?)\s*dB", re.IGNORECASE)
_TWO = re.compile(r"\+\s*(\d+(?:\.\d+)?)\s*(?:dB)?\s*/\s*-\s*(\d+(?:\.\d+)?)\s*dB", re.IGNORECASE)


def parse_tolerance(text: str) -> Tolerance:
    """A tolerance from what a person writes.

    Parameters:
        text: `6dB`, `+9/-6dB` or a standard's name such as `nasa-std-7003`.

    Raises:
        ValueError: For anything else, a number without its unit, too.
    """
    text = text.strip()
    name = _SYNONYMS.get(text.lower(), text.lower())
    if name in NAMED_TOLERANCES:
        return NAMED_TOLERANCES[name]
    match = _ONE.fullmatch(text) or _TWO.fullmatch(text)
    if match is None:
        raise ValueError(
            f"tolerance is {text!r}; expected one such as 6dB, +9/-6dB or "
            f"{', '.join(NAMED_TOLERANCES)}"
        )
    return within_db(*(float(number) for number in match.groups()))


@dataclass(frozen=True, eq=False)
class RuleResult:
    """One rule and whether spectra (...) keep it: `lines` that do, of `of`, where `required`
    must."""

    name: str
    lines: NDArray[np.intp]
    of: int
    required: int

    @property
    def met(self) -> NDArray[np.bool_]:
        return np.asarray(self.lines >= self.required)

    def sentence(self, place: tuple[int, ...] = ()) -> str:
        """How many lines of one spectrum keep the rule, and whether that is enough.

        Parameters:
            place: Indices of the spectrum among the spectra (...); by default (), for a single one.
        """
        verdict = "met" if bool(self.met[place]) else "not met"
        needed = "all" if self.required == self.of else f"{self.required}"
        return (
            f"{self.name}: {int(self.lines[place])} of {self.of} lines, {needed} "
            f"required, {verdict}"
        )


def rule_results(
    rule: PassRule, error_db: Floats, upper_db: Floats, lower_db: Floats
) -> tuple[RuleResult, ...]:
    """Each rule, with the lines of each spectrum (...) that keep it; an edge belongs to the band.

    Parameters:
        rule: What all lines together must keep to.
        error_db: Levels (..., f) above that of the target, dB.
        upper_db: How far each line may lie above (f,), dB.
        lower_db: How far each line may lie below (f,), dB, not negative.
    """
    lines = error_db.shape[-1]

    def counted(
        keeps: NDArray[np.bool_],
    ) -> NDArray[np.intp]:
        return np.asarray(np.count_nonzero(keeps, axis=-1))

    within = (error_db < upper_db + _ROUNDING_DB) & (error_db > -lower_db - _ROUNDING_DB)
    results = [RuleResult("within tolerance", counted(within), lines, rule.required_within(lines))]
    if rule.wider_upper_db is not None and rule.wider_lower_db is not None:
        wider = (error_db < rule.wider_upper_db + _ROUNDING_DB) & (
            error_db > -rule.wider_lower_db - _ROUNDING_DB
        )
        name = f"within +{rule.wider_upper_db:g}/-{rule.wider_lower_db:g} dB"
        results.append(RuleResult(name, counted(wider | within), lines, lines))
    if rule.share_above > 0:
        above = error_db > -_ROUNDING_DB
        results.append(
            RuleResult("at the level or above", counted(above), lines, rule.required_above(lines))
        )
    return tuple(results)


#: An edge belongs to the band, to within rounding.
_ROUNDING_DB = 1e-9
