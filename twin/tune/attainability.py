"""Whether any setting meets the goal, how likely, and what stands in the way where none does.

An obstacle is what, taken away alone, lets a setting meet the goal: a limit of the bench, the edge
of the model's domain, or what measured shots have not taught yet. Where none of them alone is
enough, the expected spectra decide: the obstacle is the level where the nearest spectrum would have
to be louder or softer at all lines alike, the shape where some line stays out all the same, and the
tolerance where a shot's own scatter exceeds it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

import numpy as np

from ...array_types import Floats
from ..discrepancy.shot_correction import ShotCorrection
from ..setting import Setting
from .goal import Goal
from .probability import Proposal, probability_met, proposals
from .search import Candidate, Searcher, SearchResult, best_of_mounts
from .space import ContinuousRange, TuningSpace, setting_text

#: From this probability on a setting meets the goal: more likely than not.
AT_LEAST = 0.5
#: How far beyond its range a tank pressure is looked at, and in how many equal ratios.
_PRESSURE_RATIO, _PRESSURES = 10.0, 6
#: Masses on every mount; mounts that are looked at beyond the bench; settings of them that are
#: judged by draws.
_MASSES, _MOUNTS, _JUDGED = 4, 10, 8

Kind = Literal["bench limit", "model domain", "measured shots", "level", "shape", "tolerance"]


@dataclass(frozen=True)
class Obstacle:
    """What stands in the way, with its figures.

    `probability_without`: of the best setting, were the obstacle not there. `frequency_hz` is the
    line that decides, `margin_db` its distance from the nearer edge of the tolerance, negative
    outside. `limits` are those of the bench, or of the model's domain, with value and range; empty
    where neither is the obstacle. `shot_scatter_db` is the standard deviation from shot to shot at
    a line, where that is the obstacle. `figures` are the settings and numbers of the sentence, each
    with what it is.
    """

    kind: Kind
    sentence: str
    probability_without: float
    frequency_hz: float
    margin_db: float
    limits: tuple[str, ...] = ()
    shot_scatter_db: float | None = None
    figures: tuple[str, ...] = ()


@dataclass(frozen=True)
class Attainability:
    """The first proposal's probability of meeting the goal, how many of the proposals reach
    `at_least`, and why none.

    `lines` says in words what a spectrum must have within tolerance. Without an obstacle a setting
    meets the goal.
    """

    probability: float
    at_least: float
    meeting: int
    proposals: int
    lines: str
    obstacle: Obstacle | None

    def as_json(self) -> dict[str, Any]:
        """Plain data."""
        return {"meets": self.obstacle is None, **asdict(self)}


@dataclass(frozen=True, eq=False)
class Evidence:
    """What a search has found, to be judged: allowed proposals, and those outside of the model's
    domain."""

    searcher: Searcher
    space: TuningSpace
    result: SearchResult
    kept: Sequence[Proposal]
    outside: Sequence[Proposal]
    shots: int
    at_least: float
    normals: Floats

    @property
    def goal(self) -> Goal:
        return self.searcher.goal

    @property
    def learned(self) -> ShotCorrection:
        return self.searcher.learned


def attainability(evidence: Evidence, rng: np.random.Generator) -> Attainability:
    """The answer, about the first of the proposals. Settings beyond the bench go to the model only
    where no allowed one meets the goal."""
    reached = [p.probability_met for p in evidence.kept]
    meeting = sum(p >= evidence.at_least for p in reached)
    obstacle = None if meeting else _obstacle(evidence, rng)
    return Attainability(
        reached[0] if reached else 0.0,
        evidence.at_least,
        meeting,
        len(reached),
        _lines(evidence.goal),
        obstacle,
    )


def _lines(goal: Goal) -> str:
    lines = "every line of the next shot lies within tolerance"
    if goal.share < 1:
        lines = (
            f"at least {100 * goal.share:.3g} % of the lines of the next shot lie within tolerance"
        )
    above = goal.rule.required_above(goal.frequency_hz.size)
    if not above:
        return lines
    return (
        f"{lines} and at least {above} of {goal.frequency_hz.size} at the level "
        f"or above it ({goal.rule.name})"
    )


def _obstacle(evidence: Evidence, rng: np.random.Generator) -> Obstacle:
    beyond = _bench_obstacles(evidence, rng)
    if not evidence.kept:
        return (
            beyond[0]
            if beyond and beyond[0].probability_without >= evidence.at_least
            else _refused(evidence)
        )
    apart = [*_outside(evidence), *beyond]
    scatter = _unmeasured(evidence)
    best = max((scatter, *apart), key=lambda obstacle: obstacle.probability_without)
    if best.probability_without >= evidence.at_least:
        return best
    if scatter.margin_db >= 0:
        return _tolerance(scatter, evidence)
    nearest = max(apart, key=lambda obstacle: obstacle.margin_db, default=None)
    if nearest is not None and nearest.margin_db >= 0:
        return nearest
    return _level_or_shape(evidence, nearest)


# --- limits of the bench ---


def _bench_obstacles(evidence: Evidence, rng: np.random.Generator) -> list[Obstacle]:
    """The best setting that the bench must not, or cannot, fire; none where no such setting can be
    computed."""
    candidates = best_of_mounts(_candidates_beyond(evidence))[:_JUDGED]
    if not candidates:
        return []
    reasons = {candidate.setting: candidate.refused for candidate in candidates}
    judged = proposals(
        candidates, evidence.learned, evidence.goal, rng, draws=len(evidence.normals)
    )
    best = max(judged, key=lambda p: (*_promise(p, evidence.goal), -len(reasons[p.setting])))
    limits = reasons[best.setting]
    sentence = (
        f"A limit of the bench stands in the way: {setting_text(best.setting)} would reach "
        f"{_reached(best, evidence.goal)}, but goes beyond it: {'; '.join(limits)}."
    )
    figures = (f"setting {setting_text(best.setting)}", _reached(best, evidence.goal))
    return [_of("bench limit", sentence, best, evidence.goal, limits, figures)]


def _candidates_beyond(evidence: Evidence) -> Iterator[Candidate]:
    """Refused settings of the search, and on the most promising mounts tank pressures out of the
    bench's range."""
    yield from evidence.result.refused
    mounts = best_of_mounts([*evidence.result.best, *evidence.result.refused])[:_MOUNTS]
    low, high = evidence.space.tank_pressure_pa.ends
    wide = replace(
        evidence.space,
        tank_pressure_pa=ContinuousRange(low / _PRESSURE_RATIO, high * _PRESSURE_RATIO),
    )
    steps = np.geomspace(1.0, _PRESSURE_RATIO, _PRESSURES + 1)[1:]
    masses = evidence.space.impactor_mass_kg.grid(_MASSES).tolist()
    settings = [
        replace(mount.setting, impactor_mass_kg=mass) for mount in mounts for mass in masses
    ]
    best: list[Candidate] = []
    for pressures in (high * steps, low / steps):
        for pressure in pressures.tolist():
            try:
                best += _out_of_range(
                    evidence, [replace(s, tank_pressure_pa=pressure) for s in settings]
                )
            except ValueError:
                break  # the model refuses such a pressure, and would refuse those farther out
    best = best_of_mounts(best)[:_JUDGED]
    yield from best
    try:
        yield from _out_of_range(evidence, [s for c in best for s in wide.around(c.setting, 1.3)])
    except ValueError:
        return


def _out_of_range(evidence: Evidence, settings: Sequence[Setting]) -> list[Candidate]:
    """Candidates with the reason for which the bench does not fire them; those that it does fire
    are left out."""
    low, high = evidence.space.tank_pressure_pa.ends
    candidates = []
    for candidate in evidence.searcher.candidates(settings, "beyond the bench") if settings else ():
        pressure = candidate.setting.tank_pressure_pa or 0.0
        inside = low * (1 - 1e-9) <= pressure <= high * (1 + 1e-9)
        what = (
            f"tank pressure {pressure / 1e5:.3g} bar, the bench sets "
            f"{low / 1e5:.3g} to {high / 1e5:.3g} bar"
        )
        reasons = candidate.refused or (() if inside else (what,))
        if reasons:
            candidates.append(replace(candidate, refused=reasons))
    return candidates


def _refused(evidence: Evidence) -> Obstacle:
    """The bench refuses everything that it can be set to."""
    nearest = max(evidence.result.refused, key=evidence.searcher.nearness)
    sentence = (
        f"The bench refuses all of {evidence.result.examined} settings. The nearest, "
        f"{setting_text(nearest.setting)}, is refused for: {'; '.join(nearest.refused)}."
    )
    return Obstacle(
        "bench limit",
        sentence,
        0.0,
        *_decisive(nearest.level_db, evidence.goal),
        nearest.refused,
        figures=(
            f"settings {evidence.result.examined}",
            f"nearest {setting_text(nearest.setting)}",
        ),
    )


# --- the model ---


def _outside(evidence: Evidence) -> list[Obstacle]:
    """The best setting outside of what the model was made for; none where all lie inside."""
    if not evidence.outside:
        return []
    best = max(evidence.outside, key=lambda p: _promise(p, evidence.goal))
    sentence = (
        f"The domain of the contact model stands in the way: {setting_text(best.setting)} would "
        f"reach {_reached(best, evidence.goal)}, but the model has not learned from such shots: "
        f"{'; '.join(best.outside)}. --extrapolate proposes it."
    )
    figures = (f"setting {setting_text(best.setting)}", _reached(best, evidence.goal))
    return [_of("model domain", sentence, best, evidence.goal, best.outside, figures)]


def _unmeasured(evidence: Evidence) -> Obstacle:
    """Of the first proposal that would do, were only the scatter from shot to shot left, else of
    the one that would be best: the answer is about the best setting wherever that is enough.

    The sentence is about the line of it that is the least sure today.
    """
    shot_covariance = evidence.learned.prior.shot_covariance_db2()
    without = [
        probability_met(p.level_db, shot_covariance, evidence.goal, evidence.normals)
        for p in evidence.kept
    ]
    enough = (i for i, probability in enumerate(without) if probability >= evidence.at_least)
    place = next(enough, None)
    if place is None:
        place = max(
            range(len(without)),
            key=lambda i: (without[i], _decisive(evidence.kept[i].level_db, evidence.goal)[1]),
        )
    best, margin = evidence.kept[place], evidence.goal.margin_db(evidence.kept[place].level_db)
    half_db = (best.upper_db - best.lower_db) / 2
    line = int(np.argmax(half_db - margin))
    shots = f"{evidence.shots} measured shots were" if evidence.shots else "no measured shot was"
    frequency, decisive_db = _decisive(best.level_db, evidence.goal)
    expected = (
        "within tolerance"
        if decisive_db >= 0
        else f"{-decisive_db:.1f} dB outside of tolerance at {frequency:.0f} Hz"
    )
    edge = f"{abs(margin[line]):.1f} dB {'away' if margin[line] >= 0 else 'exceeded'}"
    sentence = (
        f"Too few measured shots stand in the way: {setting_text(best.setting)} is expected "
        f"{expected}, its 90 % band at {evidence.goal.frequency_hz[line]:.0f} Hz reaches "
        f"±{half_db[line]:.1f} dB, the edge there is {edge}, and {shots} learned "
        "from. With nothing but the scatter from shot to shot the probability would be "
        f"{_percent(without[place])}: measure this setting and name its campaign (--measured)."
    )
    figures = (
        f"setting {setting_text(best.setting)}",
        f"expected {expected}",
        f"90 % band ±{half_db[line]:.1f} dB at {evidence.goal.frequency_hz[line]:.0f} Hz",
        f"edge {edge}",
        f"measured shots {evidence.shots}",
        f"probability {_percent(without[place])}",
    )
    return Obstacle(
        "measured shots", sentence, without[place], frequency, decisive_db, figures=figures
    )


# --- the goal ---


def _tolerance(scatter: Obstacle, evidence: Evidence) -> Obstacle:
    """The expected spectrum fits, and a shot's own scatter takes it out."""
    deviation = float(np.sqrt(np.diag(evidence.learned.prior.shot_covariance_db2()).max()))
    sentence = (
        "The tolerance stands in the way: the nearest expected spectrum leaves "
        f"{scatter.margin_db:.1f} dB at {scatter.frequency_hz:.0f} Hz, and shots at the same "
        f"setting scatter by {deviation:.1f} dB (standard deviation at a line). More measured "
        "shots do not help, for with that scatter alone the probability is "
        f"{_percent(scatter.probability_without)}: widen the tolerance, or require fewer of the "
        "lines (--share)."
    )
    figures = (
        f"nearest expected spectrum {scatter.margin_db:.1f} dB at {scatter.frequency_hz:.0f} Hz",
        f"scatter {deviation:.1f} dB",
        f"probability {_percent(scatter.probability_without)}",
    )
    return replace(
        scatter, kind="tolerance", sentence=sentence, shot_scatter_db=deviation, figures=figures
    )


def _level_or_shape(evidence: Evidence, apart: Obstacle | None) -> Obstacle:
    """No expected spectrum is within tolerance: what keeps the nearest allowed one out, and at
    which line.

    The level does where it is off (by the median over the lines) by more than what remains outside
    without that.
    """
    nearest, goal = evidence.result.nearest, evidence.goal
    assert nearest is not None  # there are proposals
    frequency, margin = _decisive(nearest.level_db, goal)
    further = ""
    if apart is not None and apart.margin_db > margin:
        what = (
            "beyond the bench's limits"
            if apart.kind == "bench limit"
            else "outside of the model's domain"
        )
        further = (
            f" A setting {what} ({apart.limits[0]}) still misses by {-apart.margin_db:.1f} dB."
        )
    off_db = float(np.median(goal.level_db - nearest.level_db))
    shifted_hz, shifted_db = _decisive(nearest.level_db + off_db, goal)
    if abs(off_db) > -shifted_db:
        low, high = (end / 1e5 for end in evidence.space.tank_pressure_pa.ends)
        rest = (
            f"; {-shifted_db:.1f} dB would then remain at {shifted_hz:.0f} Hz"
            if shifted_db < 0
            else ""
        )
        sentence = (
            f"The level stands in the way: the nearest setting, {setting_text(nearest.setting)}, "
            f"would have to be {abs(off_db):.1f} dB {'louder' if off_db > 0 else 'softer'}{rest}. "
            f"The bench sets {low:.3g} to {high:.3g} bar.{further}"
        )
        return Obstacle(
            "level",
            sentence,
            0.0,
            frequency,
            margin,
            (f"tank pressure {low:.3g} to {high:.3g} bar",),
            figures=(
                f"nearest {setting_text(nearest.setting)}",
                f"level off by {abs(off_db):.1f} dB{rest}",
                further.strip(),
            ),
        )
    line, _ = goal.deciding_line(nearest.level_db)
    expected, prescribed = (10 ** (level[line] / 20) for level in (nearest.level_db, goal.level_db))
    within = np.count_nonzero(goal.margin_db(nearest.level_db) >= 0)
    lines = (
        "every line" if goal.share == 1 else f"{goal.required} of {goal.frequency_hz.size} lines"
    )
    sentence = (
        f"The shape of the spectrum stands in the way: of {evidence.result.examined} settings none "
        f"has {lines} within tolerance. The nearest, {setting_text(nearest.setting)}, has {within} "
        f"of {goal.frequency_hz.size}; at {frequency:.0f} Hz it gives {expected:,.0f} m/s2 where "
        f"{prescribed:,.0f} m/s2 is prescribed, {-margin:.1f} dB "
        f"{_beyond(nearest.level_db, goal)}.{further}"
    )
    figures = (
        f"settings {evidence.result.examined}",
        f"nearest {setting_text(nearest.setting)}",
        f"lines within tolerance {within} of {goal.frequency_hz.size}, required {lines}",
        f"{expected:,.0f} m/s2 where {prescribed:,.0f} m/s2 is prescribed",
        f"{-margin:.1f} dB {_beyond(nearest.level_db, goal)} at {frequency:.0f} Hz",
        further.strip(),
    )
    return Obstacle("shape", sentence, 0.0, frequency, margin, figures=figures)


def _of(
    kind: Kind,
    sentence: str,
    best: Proposal,
    goal: Goal,
    limits: tuple[str, ...],
    figures: tuple[str, ...],
) -> Obstacle:
    decisive = _decisive(best.level_db, goal)
    return Obstacle(kind, sentence, best.probability_met, *decisive, limits, figures=figures)


def _promise(proposal: Proposal, goal: Goal) -> tuple[float, float]:
    """Larger is better: the probability to a percent, then the margin of the line that decides."""
    return round(proposal.probability_met, 2), _decisive(proposal.level_db, goal)[1]


def _decisive(level_db: Floats, goal: Goal) -> tuple[float, float]:
    """Frequency and margin of the line that decides."""
    line, margin = goal.deciding_line(level_db)
    return float(goal.frequency_hz[line]), margin


def _beyond(level_db: Floats, goal: Goal) -> str:
    """What the line that decides lies beyond, of levels that do not meet the goal."""
    line, _ = goal.deciding_line(level_db)
    if goal.margin_db(level_db)[line] < 0:
        return "outside of the tolerance"
    return (
        f"below the level, which {goal.rule.required_above(goal.frequency_hz.size)} lines must "
        "reach"
    )


def _reached(proposal: Proposal, goal: Goal) -> str:
    frequency, margin = _decisive(proposal.level_db, goal)
    where = "within" if margin >= 0 else "outside of"
    return (
        f"{_percent(proposal.probability_met)} (expected {abs(margin):.1f} dB "
        f"{where} tolerance at {frequency:.0f} Hz)"
    )


def _percent(probability: float) -> str:
    """Draws do not tell certainty: none of some hundred is not never."""
    if probability < 0.005:
        return "< 1 %"
    return "> 99 %" if probability >= 0.995 else f"{100 * probability:.0f} %"
