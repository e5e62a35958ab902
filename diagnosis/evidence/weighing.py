"""All hypotheses on one scale."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...twin.effects import Effect
from ..hypotheses import Priors
from ..stages.base import Stage
from ..verdict import NONE, UNKNOWN
from .background import under
from .form import form_modes, left_open, with_form_error
from .logs import log_mean
from .pairs import OnPair, Started, interaction, of_pair, start_pair
from .scene import Scene
from .singles import OnSurface, of_none, of_strays, of_surface

Floats = NDArray[np.float64]

#: Pairs are tried among so many of the best singles; so many get a fine grid, and so many are simulated together.
BEST_SINGLES, QUICK_SINGLES, FINE_PAIRS, SIMULATED_PAIRS = 7, 4, 8, 4
#: Beside these, what completes the best singles.
_COMPLETED, _COMPLEMENTS = 3, 2
PRIORS = Priors()
#: So many backgrounds that suit the gap best are tried under what nothing explains.
_SUITED = 2
#: The form of the law is looked at for singles within so many nats of the best.
_FORM_WITHIN = 40.0
#: What the laws of a pair leave open is taken from where it is likeliest, so often.
_PAIR_ROUNDS = 2


@dataclass(frozen=True, eq=False)
class Weighed:
    """Log evidences by hypothesis ("none", "unknown", "gun.blow_by", "a+b"); `log_joint` has the priors in it."""

    scene: Scene
    log_evidence: dict[str, float]
    log_joint: dict[str, float]
    singles: dict[str, tuple[OnSurface, ...]]
    pairs: dict[str, OnPair] = field(default_factory=dict)

    @cached_property
    def probability(self) -> dict[str, float]:
        """Raw, by hypothesis, largest first."""
        names = list(self.log_joint)
        logs = np.array([self.log_joint[name] for name in names])
        weights = np.exp(logs - logs.max())
        weights /= weights.sum()
        return {names[i]: float(weights[i]) for i in np.argsort(-weights, kind="stable")}

    def effects(self, name: str) -> tuple[Effect, ...]:
        """A hypothesis at its likeliest parameters; () for none and unknown."""
        if name in (NONE, UNKNOWN):
            return ()
        if name in self.pairs:
            return self.pairs[name].effects(self.scene)
        return (self.best_sheet(name).surface.effect(self.best_point(name)),)

    def best_sheet(self, name: str) -> OnSurface:
        return max(self.singles[name], key=lambda one: one.log_evidence)

    def best_point(self, name: str) -> Floats:
        sheet = self.best_sheet(name)
        return np.asarray(sheet.surface.points[sheet.best[0]])


def weigh(
    scene: Scene,
    priors: Priors = PRIORS,
    stages: Sequence[Stage] = (),
    *,
    quick: bool = False,
) -> Weighed:
    """Evidence of every hypothesis. With `stages` pairs are simulated; without, their changes are added up.

    `quick`, for choices inside of folds: fewer pairs, each on the likeliest sheets of its effects, and laws taken at
    their word.
    """
    z = scene.cells.z
    whitened = [white.white(z) for white in scene.before]
    plain = [of_surface(scene, i, whitened) for i in range(len(scene.surfaces))]
    shaped = _shaped(scene, plain, whitened, quick=quick)
    singles = {name: tuple(shaped[i] for i in scene.sheets(name)) for name in scene.ids}
    evidence = {name: _of_sheets(sheets) for name, sheets in singles.items()}
    alone = of_none(scene, z)
    astray = of_strays(scene, z, _under(scene, alone, plain))
    log = {NONE: log_mean(alone), UNKNOWN: log_mean(list(astray.values())), **evidence}
    pairs = _pairs(scene, evidence, dict(enumerate(plain)), whitened, stages, quick) if priors.pairs > 0 else {}
    log |= {name: pair.log_evidence for name, pair in pairs.items()}
    return Weighed(scene, log, _joint(log, priors, len(scene.ids)), singles, pairs)


def _shaped(scene: Scene, plain: Sequence[OnSurface], whitened: list[Floats], *, quick: bool) -> list[OnSurface]:
    """With an error of the law's form near the best; `quick`: only of laws that leave something open."""
    if quick and not any(one.surface.loose is not None for one in plain):
        return list(plain)
    modes = form_modes(scene)
    top = max((one.log_evidence for one in plain), default=0.0)
    return [
        with_form_error(scene, i, one, whitened, modes)
        if one.surface.loose is not None or (not quick and one.log_evidence > top - _form_reach(scene))
        else one
        for i, one in enumerate(plain)
    ]


def _under(scene: Scene, alone: Floats, plain: Sequence[OnSurface]) -> list[int]:
    """Backgrounds that may lie under what nothing explains: some always, and those that suit the gap best, without an
    effect and with the likeliest."""
    always = under(scene.gap.stages)
    chosen = {i for i, one in enumerate(scene.backgrounds) if one in always} | set(
        np.argsort(alone)[-_SUITED:].tolist()
    )
    if plain:
        best = max(plain, key=lambda one: one.log_evidence)
        chosen |= set(np.argsort(best.log_likelihood.max(axis=0))[-_SUITED:].tolist())
    return sorted(chosen)


def _form_reach(scene: Scene) -> float:
    """The more cells, the more nats a small error of form costs."""
    return _FORM_WITHIN + len(scene.cells.z)


def _of_sheets(sheets: Sequence[OnSurface]) -> float:
    return log_mean([one.log_evidence for one in sheets])


def _joint(log: dict[str, float], priors: Priors, effects: int) -> dict[str, float]:
    pairs = effects * (effects - 1) // 2

    def share(name: str) -> float:
        if name == NONE:
            return priors.none
        if name == UNKNOWN:
            return priors.unknown
        return priors.pairs / pairs if "+" in name else priors.singles / effects

    with np.errstate(divide="ignore"):
        return {name: value + float(np.log(share(name))) for name, value in log.items()}


def _pairs(
    scene: Scene,
    evidence: dict[str, float],
    plain: Mapping[int, OnSurface],
    whitened: list[Floats],
    stages: Sequence[Stage],
    quick: bool,
) -> dict[str, OnPair]:
    ranked = sorted(evidence, key=lambda name: -evidence[name])
    best = ranked[: QUICK_SINGLES if quick else BEST_SINGLES]
    started: dict[str, Started] = {}

    def sheets(name: str) -> list[int]:
        every = scene.sheets(name)
        return [max(every, key=lambda i: plain[i].log_evidence)] if quick else every

    place = list(scene.ids).index
    tried = set(itertools.combinations(sorted(best, key=place), 2))
    for name in ranked[: 0 if quick else _COMPLETED]:
        tried |= {
            (min(name, other, key=place), max(name, other, key=place)) for other in _complements(scene, name, plain)
        }
    for a, b in sorted(tried, key=lambda pair: (place(pair[0]), place(pair[1]))):
        options = [start_pair(scene, i, j, plain, whitened) for i in sheets(a) for j in sheets(b)]
        started[f"{a}+{b}"] = max(options, key=lambda one: one.log_likelihood)
    near = sorted(started, key=lambda name: -started[name].log_likelihood)[:FINE_PAIRS]
    found = {name: of_pair(scene, started[name], whitened) for name in near}
    top = sorted(found, key=lambda name: -found[name].log_evidence)[:SIMULATED_PAIRS]
    modes = form_modes(scene)
    return found | {name: _shaped_pair(scene, found[name], stages, modes, errors=not quick) for name in top}


def _complements(scene: Scene, name: str, plain: Mapping[int, OnSurface]) -> list[str]:
    """The effects that explain best what an effect leaves of the gap: alone they may explain next to nothing."""
    sheet = max((plain[i] for i in scene.sheets(name)), key=lambda one: one.log_evidence)
    point, _ = sheet.best
    left = scene.cells.z - scene.cells.take(np.tensordot(sheet.surface.basis[point], sheet.surface.nodes, axes=1))
    whitened = [white.white(left) for white in scene.before]
    others = [other for other in scene.ids if other != name]
    found = {other: _of_sheets([of_surface(scene, i, whitened) for i in scene.sheets(other)]) for other in others}
    return sorted(found, key=lambda other: -found[other])[:_COMPLEMENTS]


def _shaped_pair(scene: Scene, pair: OnPair, stages: Sequence[Stage], modes: Floats, *, errors: bool) -> OnPair:
    """The same pair with what the two do together taken off the gap, impossible where they have no answer together; and
    with what their laws leave open and errors of their forms, as single effects have them."""
    z = scene.cells.z
    if stages:
        z = z - interaction(scene, pair, stages)
        if not np.isfinite(z).all():
            return replace(pair, log_evidence=-np.inf)
    both = (pair.first, pair.second)
    sheets = [scene.surfaces[i] for i in both]
    for _ in range(_PAIR_ROUNDS if any(sheet.loose is not None for sheet in sheets) else 1):
        open_ = left_open(scene, list(zip(sheets, pair.u, strict=True)), modes, errors=errors)
        if not stages and not any(each.shape[1] for each in open_):
            return pair
        found = [_again(scene.opened(both, each) if each.shape[1] else scene, both, z) for each in open_]
        pair = max(found, key=lambda one: one.log_evidence)
    return replace(pair, log_evidence=log_mean([one.log_evidence for one in found]))


def _again(scene: Scene, pair: tuple[int, int], z: Floats) -> OnPair:
    whitened = [white.white(z) for white in scene.before]
    alone = {i: of_surface(scene, i, whitened) for i in pair}
    return of_pair(scene, start_pair(scene, *pair, alone, whitened), whitened)
