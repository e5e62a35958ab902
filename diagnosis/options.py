"""What a user may ask of a diagnosis.

Two probabilities of a report that evidence alone says too surely, learned on campaigns whose cause
was known (`benchmarks/diagnosis_maps.py`).

That something outside of the catalogue makes most of the gap: a law that is a little wrong is
beaten by a free form. Hence a logit of the compressed log odds of the evidence, of the fraction of
the gap that the effects take away where they were not fitted, of how much is left there of the
family of observables of which most is left, in tolerances (but for modes and pressures), of how
wrong the laws of the effects have to be, and of how much likelier the data are if something else
acts beside the likeliest effects. The probability is at most twice the fraction that is not taken
away. Where it is likely that no effect acts there is nothing to predict, and the fraction says
nothing.

That the first entry is right, where the catalogue has what acts: a set of it has no effect that
does not act, and leaves out none that makes a tenth of the gap. Sets that are not quite right are
many, several effects are seldom all found, and effects that predict well are more often the right
ones.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..twin.contact_interface import ContactStage

#: Of the probability that the first entry is right (`first_entry_probability`): intercept of the
#: logit, what "none" adds to it and several effects at once take off, and the weight of the
#: fraction held out. How much likelier the evidence makes the entry than the others says nothing
#: more on the campaigns of which this was learned.
ENTRY_INTERCEPT, ENTRY_NONE, ENTRY_SEVERAL, ENTRY_FRACTION = 1.16, 0.72, -0.85, 3.33
#: Fraction held out about which the weight turns, and which stands for one that is not known.
_USUAL_FRACTION = 0.85
#: Less than this is left by any simulator, and more than that says no more, in tolerances.
_LEAST_LEFT, _MOST_LEFT = 0.3, 3.0
#: The probability of `unknown` is at most so many times the fraction of the gap that effects leave
#: held out.
_OF_REMAINDER = 2.0


@dataclass(frozen=True)
class UnknownFigures:
    """What the probability of a cause outside of the catalogue follows from.

    `log_odds` of such a cause by the evidence alone. `fraction` of the reducible gap that the
    effects take away held out, and `remaining_gap`, the rms that they leave there beyond the noise
    floor, in tolerances; None where nothing was held out. `none`: the probability of sets within
    tolerance. `discrepancy`: the posterior mean of how far the laws of the effects are off, a share
    of what they do. `beside`: log evidence with something unexplained beside the likeliest set,
    less that without.
    """

    log_odds: float
    fraction: float | None = None
    remaining_gap: float | None = None
    none: float = 0.0
    discrepancy: float = 0.0
    beside: float = 0.0

    @property
    def features(self) -> tuple[float, ...]:
        """One, and the terms of the logit in the order of `UnknownMap`."""
        fraction, remaining_gap = _finite(self.fraction, 0.5), _finite(self.remaining_gap, 1.0)
        return (
            1.0,
            float(np.arcsinh(self.log_odds / 2)),
            (1 - self.none) * (0.5 - float(np.clip(fraction, -0.5, 1.0))),
            float(np.log(np.clip(remaining_gap, _LEAST_LEFT, _MOST_LEFT))),
            self.discrepancy,
            float(np.arcsinh(max(self.beside, 0.0) / 2)),
        )


def _finite(value: float | None, otherwise: float) -> float:
    return otherwise if value is None or not np.isfinite(value) else value


@dataclass(frozen=True)
class UnknownMap:
    """logit p = `intercept` + `odds` asinh(log odds / 2) + `fraction` (1 - p_none) (1/2 - held-out
    fraction) + `left` ln(remaining gap) + `discrepancy` (mean discrepancy) + `beside`
    asinh(max(gain beside, 0) / 2); p is at most twice the fraction that is left held out. Without
    figures that are held out the evidence alone decides."""

    intercept: float = -2.19
    odds: float = 0.20
    fraction: float = 2.88
    left: float = 0.58
    discrepancy: float = 2.63
    beside: float = 0.26
    source: str = (
        "development and calibration campaigns of the virtual bench "
        "(docs/blind-check/development/maps.jsonl.gz)"
    )

    def __call__(self, figures: UnknownFigures) -> float:
        weights = [
            self.intercept,
            self.odds,
            self.fraction,
            self.left,
            self.discrepancy,
            self.beside,
        ]
        logit = float(np.dot(weights, figures.features))
        return min(float(1 / (1 + np.exp(-logit))), unknown_bound(figures.fraction, figures.none))


def unknown_bound(fraction: float | None, none: float = 0.0) -> float:
    """The largest probability of `unknown`, by the fraction of the gap that goes held out; 1 where
    none is known.

    Parameters:
        fraction: The fraction of the reducible gap that effects take away where they were not
            fitted; None where it is not known.
        none: The probability that no effect acts; by default 0. Where none acts, half of the
            fraction says nothing.
    """
    if fraction is None or not np.isfinite(fraction):
        return 1.0
    remainder = none / 2 + (1 - none) * (
        1 - min(fraction, 1.0)
    )  # where no effect acts half of it says nothing
    return float(min(_OF_REMAINDER * remainder, 1.0))


def first_entry_probability(effects: Sequence[str], fraction: float | None) -> float:
    """The probability that an entry is right, given that the catalogue has what acts.

    Parameters:
        effects: Ids of the effects of its likeliest set; empty where no effect acts.
        fraction: The fraction of the reducible gap that effects take away where they were not
            fitted; None where it is not known.
    """
    numbers = [ENTRY_INTERCEPT, ENTRY_NONE, ENTRY_SEVERAL, ENTRY_FRACTION]
    return float(1 / (1 + np.exp(-np.dot(numbers, entry_features(effects, fraction)))))


def entry_features(
    effects: Sequence[str], fraction: float | None
) -> tuple[float, float, float, float]:
    """One, and the figures of the logit of `first_entry_probability`.

    Parameters:
        effects: Ids of the effects of the entry's likeliest set; empty where no effect acts.
        fraction: The fraction of the reducible gap that effects take away where they were not
            fitted; None where it is not known.
    """
    fraction = _finite(fraction if effects else None, _USUAL_FRACTION)
    return (
        1.0,
        float(not effects),
        float(len(effects) > 1),
        float(np.clip(fraction, 0.0, 1.0)) - _USUAL_FRACTION,
    )


#: Of each stage: velocity and peak force as shares, spectra in dB. What the observables' tolerances
#: stand for.
TOLERANCES = {"gun": 0.01, "contact": 0.03, "plate": 0.5}

#: Stages whose nominal parameters may be declared uncertain.
_UNCERTAIN = ("gun", "contact")


@dataclass(frozen=True)
class Options:
    """`tolerances` by stage (gun and contact: shares, plate: dB); a gap within them is none.

    `uncertain`: standard deviations of nominal parameters, "gun.friction_coefficient" in SI,
    "contact.impactor_mass_kg" and what else an impact is made of as shares. `contact`: a registered
    model in the place of Hertz' impact, which may want to know `plate_mass_kg`. `catalogue`: ids of
    the effects that are looked for (`diagnose --with`); None: all there are. `without`: ids that
    are left out (`diagnose --without`). `unknown_map`: from log odds to the probability of
    something outside of the catalogue. `shrink`, `where`, `plan` and `rate_pulses` (ISO 18571)
    leave out parts of the report that take time. `explore` adds what a page shows beside the
    report: the error with other sets of effects, and by settings. Raises `ValueError` for a stage
    there is none of and for a tolerance that is not positive.
    """

    seed: int = 0
    tolerances: Mapping[str, float] = field(default_factory=dict)
    uncertain: Mapping[str, float] = field(default_factory=dict)
    contact: ContactStage | None = None
    plate_mass_kg: float | None = None
    catalogue: tuple[str, ...] | None = None
    without: tuple[str, ...] = ()
    unknown_map: UnknownMap = field(default_factory=UnknownMap)
    shrink: bool = True
    where: bool = True
    plan: bool = True
    rate_pulses: bool = True
    explore: bool = False

    def __post_init__(self) -> None:
        for stage, value in self.tolerances.items():
            if stage not in TOLERANCES:
                raise ValueError(
                    f"tolerance of {stage!r}: no such stage; "
                    f"expected one of {', '.join(TOLERANCES)}"
                )
            if not value > 0:
                raise ValueError(f"tolerance of {stage} = {value!r}: expected a positive number")
        for name in self.uncertain:
            if name.partition(".")[0] not in _UNCERTAIN:
                names = " or ".join(f"{stage}.NAME" for stage in _UNCERTAIN)
                raise ValueError(
                    f"uncertain {name!r}: expected {names}, a nominal parameter of that stage"
                )

    @property
    def tolerance_scale(self) -> dict[str, float]:
        """By how much each stage's tolerances are widened."""
        return {stage: value / TOLERANCES[stage] for stage, value in self.tolerances.items()}

    def uncertain_of(self, stage: str) -> dict[str, float]:
        """Standard deviations of a stage's nominal parameters, by the name that the stage knows.

        Parameters:
            stage: The name of the stage, "gun" or "contact".
        """
        prefix = f"{stage}."
        return {
            name.removeprefix(prefix): value
            for name, value in self.uncertain.items()
            if name.startswith(prefix)
        }
