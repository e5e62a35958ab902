"""Which sets of effects may act: a search over subsets by adding, dropping and exchanging effects.

Sets that are much less likely than the best are left out (Occam's window: Madigan and Raftery, J.
Am. Stat. Assoc. 89 (1994) 1535). All effects are as likely to act, so seldom that a longer
catalogue does not make "some effect" likelier (Scott and Berger, Ann. Stat. 38 (2010) 2587, on
multiplicity).
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ...parallel.phases import Phases, Progress
from ...twin.effects import Effect
from .effect_laws import COMMON_SHARE, EffectLaw
from .exchanges_of_two import exchanges_of_two
from .problem import InferenceProblem
from .subset_fit import (
    Start,
    SubsetFit,
    covariance,
    covariance_factor,
    fit_subsets,
    least_squares_place,
    no_effects,
    point_of,
    polished,
    residual,
    split_parts,
    with_evidence,
)

#: Prior probability that no effect acts.
NONE_PRIOR = 0.2
#: Logarithm of the probability that an effect does not act though the laboratory measured that it
#: does: no record overrules a measurement (`known_facts` says where one speaks against it).
_STATED = -30.0
#: Candidates of a step that are fitted; sets within so many nats of the best are kept.
_FITTED, WINDOW = 4, 20.0
#: Exchanges from each set that are fitted in a round, rounds, and sets that additions begin from:
#: of a problem with few cells, and of one with more than `_MANY` of them (the lines of a plate),
#: where each fit costs far more.
_EXCHANGED, _ROUNDS, _EXTENDED, _MANY = (20, 10), (8, 4), (2, 1), 400
#: Power of the posterior by which sets are weighed. The laws are not those of a real bench, so that
#: evidence counts for less than it says (a coarsened posterior: Miller and Dunson, J. Am. Stat.
#: Assoc. 114 (2019) 1113), and the less the more observables repeat what a law is off by: the first
#: of up to `_FEW` observables, which a gun has, the second of more. The true sets have the same
#: probability from 0.1 to 0.5 (`benchmarks/diagnosis_maps.py`); above 0.2 the probabilities that
#: effects of a contact act are too sure.
TEMPER, TEMPER_OF_MANY, _FEW = 0.3, 0.15, 6
#: Of the moves that bring the same law in so many are fitted.
_OF_ONE_LAW = 2
#: So many sets are exchanged at once.
BEAM = 2
#: Sets that differ from one of the likeliest by two effects, so many of each, are fitted: of a
#: problem with few cells, and of one with many; of so many times as many candidates, most of which
#: the library may have. Rounds of it.
_OF_TWO, _SCREENED, _ROUNDS_OF_TWO = (8, 3), 4, 2
#: A set that is so many nats below the best and smaller than it is not followed further down.
_GIVEN_UP = 15.0
#: The likeliest sets, so many, are compared by the same backgrounds.
_COMPARED = 60
#: Likely sets of each stage that are put together with those of the others.
_OF_A_STAGE = 6
#: Steps of the fit of all effects at once, before and after its derivatives are simulated.
_FROM_ALL = 6
#: Step of differences in u.
_DIFFERENCE = 0.03
#: What the search of a stage costs for each of its cells, in seconds of campaigns with 24 to 48
#: shots; and the search of all stages together, over that of each (measured: 0.08 to 1.2).
_CELL_COSTS, _TOGETHER_COST = {"gun": 0.045, "contact": 0.04, "plate": 0.009}, 0.4
#: What the parts of the search of a stage cost, in per cent.
_PART_COSTS = {"additions": 25.0, "all at once": 25.0, "exchanges": 35.0, "two at once": 15.0}


@dataclass(eq=False)
class ModelLibrary:
    """Every set of laws that was fitted, by its key, and the prior of its size."""

    problem: InferenceProblem
    fits: dict[tuple[str, ...], SubsetFit] = field(default_factory=dict)

    def add(self, fits: Iterable[SubsetFit]) -> None:
        """Adds fits. A polished fit takes the place of one that is not; else the likelier one
        stays.

        Parameters:
            fits: Sets of laws that were fitted to the problem.
        """
        for fit in fits:
            key = tuple(sorted(fit.key))
            old = self.fits.get(key)
            if old is None or fit.polished > old.polished or fit.log_evidence > old.log_evidence:
                self.fits[key] = fit

    @property
    def temper(self) -> float:
        """The power of the posterior by which its sets are weighed."""
        return TEMPER if len(self.problem.gap.observables) <= _FEW else TEMPER_OF_MANY

    def polish(self) -> None:
        """Polishes the likeliest sets that are not."""
        rough = [fit for fit, _ in self.weights(window=5.0) if not fit.polished and fit.laws][:4]
        if rough:
            self.add(polished(self.problem, rough))

    def compare_backgrounds(self) -> None:
        """Tries the likeliest set's backgrounds on all others: a search leaves each set with those
        that it began with, and sets that do the same would be nats apart."""
        best = self.best().errors
        fresh = []
        for fit in sorted(self.fits.values(), key=self.log_joint, reverse=True)[:_COMPARED]:
            errors = tuple(
                replace(own, background=other.background)
                for own, other in zip(fit.errors, best, strict=True)
            )
            if errors != fit.errors:
                fresh.append(with_evidence(self.problem, replace(fit, errors=errors)))
        self.add(fresh)

    def has(self, laws: Sequence[EffectLaw]) -> bool:
        """Whether a set of laws was fitted.

        Parameters:
            laws: The laws of the set, in any order.
        """
        return tuple(sorted(law.key for law in laws)) in self.fits

    def log_joint(self, fit: SubsetFit) -> float:
        """Log evidence plus log prior of the set.

        Parameters:
            fit: The set as it was fitted.
        """
        return fit.log_evidence + self.log_set_prior(fit)

    def log_set_prior(self, fit: SubsetFit) -> float:
        """Log prior of the set: of which effects act, and by which laws.

        Parameters:
            fit: The set as it was fitted.
        """
        acting = set(fit.effects)
        prior = sum(priors[name in acting] for name, priors in self.prior.items())
        return prior + sum(law.log_prior for law in fit.laws)

    @cached_property
    def prior(self) -> dict[str, tuple[float, float]]:
        """By effect, the logarithms of the probabilities that it does not act and that it does."""
        prior = {
            name: (off, on)
            for name, (on, off) in set_prior(self.problem.laws, self.problem.detectable).items()
        }
        return prior | {
            law.id: (_STATED, float(np.log1p(-np.exp(_STATED))))
            for law in self.problem.laws
            if law.surely_acts
        }

    def best(self, without: Collection[str] = ()) -> SubsetFit:
        """The likeliest set.

        Parameters:
            without: Ids of effects that the set must not have; by default none.
        """
        return max(
            (fit for fit in self.fits.values() if not set(fit.effects) & set(without)),
            key=self.log_joint,
        )

    def weights(self, window: float = WINDOW) -> list[tuple[SubsetFit, float]]:
        """Sets within Occam's window, the likeliest first, and their probabilities by the tempered
        posterior.

        Parameters:
            window: How far below the likeliest a set may be, in nats; by default 20.
        """
        joint = {key: self.log_joint(fit) for key, fit in self.fits.items()}
        top = max(joint.values())
        kept = sorted(
            (key for key, value in joint.items() if value > top - window),
            key=lambda key: -joint[key],
        )
        mass = np.exp(self.temper * (np.array([joint[key] for key in kept]) - top))
        return [
            (self.fits[key], float(share))
            for key, share in zip(kept, mass / mass.sum(), strict=True)
        ]


def set_prior(
    laws: Sequence[EffectLaw], detectable: Sequence[type[Effect]] = ()
) -> dict[str, tuple[float, float]]:
    """By effect, the logarithms of the probabilities that it acts and that it does not, such that
    none of all effects acts with `NONE_PRIOR`.

    Parameters:
        laws: The laws of the effects that are looked for.
        detectable: The classes of all effects that the campaign can show, where the laws are those
            of some of them. By default those of the laws are all.
    """
    from scipy.optimize import brentq

    odds = {law.id: law.kind.prior_odds for law in laws}
    if not odds:
        return {}
    every = {kind.id: kind.prior_odds for kind in detectable} | odds
    ratios = np.array(list(every.values()))
    scale = brentq(
        lambda x: float(np.log1p(np.exp(x) * ratios).sum()) + float(np.log(NONE_PRIOR)), -20, 20
    )
    ratios = np.array(list(odds.values()))
    acts = np.exp(scale) * ratios / (1 + np.exp(scale) * ratios)
    return {
        name: (float(np.log(p)), float(np.log1p(-p))) for name, p in zip(odds, acts, strict=True)
    }


def search(problem: InferenceProblem, progress: Progress = lambda *_: None) -> ModelLibrary:
    """The library of a problem. Stages are independent given what was measured between them, but
    for the sensors that two of them share: each is searched by itself, and what they find together
    begins the search of all.

    Parameters:
        problem: The gap, and the laws that may explain it.
        progress: Receives the steps done, their number and what is searched; by default nothing is
            called.
    """
    library = ModelLibrary(problem)
    library.add([no_effects(problem)])
    if len(problem.blocks) == 1:
        _search_stage(problem, library, Phases(progress, _PART_COSTS))
        return library
    costs = {
        block.stage: _CELL_COSTS.get(block.stage, 0.01) * len(block.z) for block in problem.blocks
    }
    phases = Phases(progress, {**costs, "all stages": _TOGETHER_COST * sum(costs.values())})
    stages = [search(problem.stage(stage), phases.of(stage)) for stage in costs]
    phases.begin("all stages")
    _join(problem, library, stages)
    _exchange(problem, library, phases.of("all stages"))
    return library


def _exchange_in_turn(problem: InferenceProblem, library: ModelLibrary, progress: Progress) -> None:
    """Two effects at once, and single ones from what that finds."""
    for round_number in range(_ROUNDS_OF_TWO):
        progress(round_number, _ROUNDS_OF_TWO, "two effects at once")
        best = library.best()
        _exchange_two(problem, library)
        if library.best().key == best.key:
            break
        _exchange(problem, library)


def _exchange_two(problem: InferenceProblem, library: ModelLibrary) -> None:
    """Fits the most promising sets that are two effects away from a likely one: a search by single
    effects may have to pass sets that are much worse on the way there."""
    likely = [fit for fit, _ in library.weights()][:BEAM]
    starts = [(law, u) for law in problem.laws if not law.levels for u in _starts_of(library, law)]
    picked: dict[tuple[str, ...], tuple[SubsetFit, tuple[EffectLaw, ...], Floats]] = {}
    count = _OF_TWO[_is_large(problem)]
    for current in likely:
        screened = exchanges_of_two(problem, current, starts, _SCREENED * count)
        for move in [move for move in screened if not library.has(move.laws)][:count]:
            picked.setdefault(
                tuple(sorted(law.key for law in move.laws)), (current, move.laws, move.u)
            )
    library.add(fit_subsets(problem, _starts(problem, list(picked.values()))))
    library.compare_backgrounds()
    library.polish()


def _is_large(problem: InferenceProblem) -> bool:
    """Whether a fit is expensive."""
    return sum(len(block.z) for block in problem.blocks) > _MANY


def _search_stage(problem: InferenceProblem, library: ModelLibrary, phases: Phases) -> None:
    """From no effects upwards as long as another one pays, from all effects downwards, and from
    what these find by exchanges."""
    phases.begin("additions")
    _add(problem, library, phases.of("additions"))
    phases.begin("all at once")
    _eliminate(problem, library, phases.of("all at once"))
    _exchange(problem, library, phases.of("exchanges"))
    _exchange_in_turn(problem, library, phases.of("two at once"))


def _add(problem: InferenceProblem, library: ModelLibrary, progress: Progress) -> None:
    """From no effects upwards as long as another one pays."""
    beam = [library.best()]
    _fit_singles(problem, library)
    gains = True
    while gains:
        before = library.log_joint(library.best())
        fits = _fitted(
            problem, library, [(current, _additions(problem, library, current)) for current in beam]
        )
        fits += [
            fit
            for fit in library.fits.values()
            if len(fit.laws) == len(beam[0].laws) + 1 and fit not in fits
        ]
        if not fits:
            break
        count = _EXTENDED[_is_large(problem)]
        beam = polished(problem, sorted(fits, key=library.log_joint, reverse=True)[:count])
        library.add(beam)
        gains = library.log_joint(library.best()) > before
        # How many rounds follow is not known; two are counted on.
        progress(size := len(beam[0].laws), size + 2, f"sets of {size}")


def _join(problem: InferenceProblem, library: ModelLibrary, parts: Sequence[ModelLibrary]) -> None:
    """Sets of all stages from those of each. Without sensors that two stages share, evidence and
    parameters are those of the stages; with them, unions of the stages' best sets are fitted
    together."""
    shown = Counter(name for part in parts for name in part.problem.effects)
    shared = {name for name, count in shown.items() if count > 1}
    alone = [
        [fit for fit, _ in part.weights() if not set(fit.effects) & shared][:_OF_A_STAGE]
        for part in parts
    ]
    alone = [fits or [part.best(without=shared)] for fits, part in zip(alone, parts, strict=True)]
    library.add(_composed(choice) for choice in itertools.product(*alone))
    unions: dict[tuple[str, ...], tuple[tuple[EffectLaw, ...], Floats]] = {}
    for choice in itertools.product(*([part.best(), part.best(without=shared)] for part in parts)):
        laws: dict[str, tuple[EffectLaw, Floats]] = {}
        for fit in choice:
            laws |= {
                law.id: (law, own)
                for law, own in zip(fit.laws, fit.parts, strict=True)
                if law.id not in laws
            }
        union = tuple(law for law, _ in laws.values())
        if not library.has(union):
            unions[tuple(law.key for law in union)] = (
                union,
                np.concatenate([own for _, own in laws.values()]),
            )
    best = library.best()
    starts = _starts(problem, [(best, laws, u) for laws, u in unions.values()])
    library.add(polished(problem, fit_subsets(problem, starts, iterations=_FROM_ALL), _FROM_ALL))


def _composed(parts: Sequence[SubsetFit]) -> SubsetFit:
    """One set from sets of each stage that have no effect in common."""
    from scipy.linalg import block_diag

    laws = tuple(law for part in parts for law in part.laws)
    u = np.concatenate([part.u for part in parts])
    jacobian, contributions, at, row = [], [], 0, 0
    for part in parts:
        slope = np.zeros((len(part.change[0]), len(u)))
        slope[:, at : at + len(part.u)] = part.jacobian[0]
        own = np.zeros((len(laws), len(part.change[0])))
        own[row : row + len(part.laws)] = part.contributions[0]
        at, row = at + len(part.u), row + len(part.laws)
        jacobian.append(slope)
        contributions.append(own)
    return SubsetFit(
        laws,
        u,
        tuple(part.change[0] for part in parts),
        tuple(jacobian),
        tuple(contributions),
        tuple(part.errors[0] for part in parts),
        sum(part.log_evidence for part in parts),
        block_diag(*(part.precision for part in parts)),
        all(part.polished for part in parts),
    )


def _exchange(
    problem: InferenceProblem, library: ModelLibrary, progress: Progress = lambda *_: None
) -> None:
    """From the best sets by drops, exchanges and additions until none is better."""
    library.compare_backgrounds()
    library.polish()
    beam = [fit for fit, _ in library.weights()][:BEAM]
    large = _is_large(problem)
    for round_number in range(_ROUNDS[large]):  # of which two more are counted on
        progress(round_number, round_number + 2, "exchanges of effects")
        moves = []
        for current in beam:
            additions = _additions(problem, library, current)
            moves.append(
                (current, [*_drops(current), *_exchanges(problem, library, current), *additions])
            )
        _fitted(problem, library, moves, count=_EXCHANGED[large])
        library.compare_backgrounds()
        library.polish()
        best = [fit for fit, _ in library.weights()][:BEAM]
        if best[0].key == beam[0].key:
            break
        beam = best


def _eliminate(problem: InferenceProblem, library: ModelLibrary, progress: Progress) -> None:
    """From all effects at once downwards: what additions pass by because only together two of them
    pay."""
    best = library.best()
    usual = [_plainest(problem, name)[0] for name in problem.effects]
    others = [law for law in usual if law.id not in best.effects]
    starts = [
        (tuple(usual), [law.smallest_start() for law in usual]),
        ((*best.laws, *others), [*best.parts, *(law.smallest_start() for law in others)]),
    ]
    for start_number, (laws, places) in enumerate(starts):
        progress(start_number, len(starts), "all effects at once")
        if not library.has(laws):
            u = np.concatenate(places)
            if not _is_large(
                problem
            ):  # steps of Gauss and Newton alone end far off where effects work together
                u = least_squares_place(problem, laws, u)
            start = _starts(problem, [(best, laws, u)])
            current = polished(
                problem, fit_subsets(problem, start, iterations=_FROM_ALL), steps=_FROM_ALL
            )[0]
            library.add([current])
            _shrink(problem, library, current)


def _shrink(problem: InferenceProblem, library: ModelLibrary, current: SubsetFit) -> None:
    """Drops one effect after the other, each time the one that is missed least."""
    while current.laws:
        fits = _fitted(problem, library, [(current, _drops(current))], count=3)
        if not fits:
            break
        current = max(fits, key=library.log_joint)
        best = library.best()
        if library.log_joint(current) < library.log_joint(best) - _GIVEN_UP and len(
            current.laws
        ) < len(best.laws):
            break


def fit_sets(
    problem: InferenceProblem, library: ModelLibrary, sets: Sequence[Sequence[str]]
) -> None:
    """Fits sets of effects, each effect by its law in the likeliest set of the library, else by the
    law that is likeliest before any evidence, and adds them to the library.

    Parameters:
        problem: The problem that they are fitted to.
        library: Its library; sets that it has are not fitted again.
        sets: Ids of the effects of each set.
    """
    best = library.best()
    used = {law.id: (law, part) for law, part in zip(best.laws, best.parts, strict=True)}
    picked: list[tuple[SubsetFit, tuple[EffectLaw, ...], Floats]] = []
    for ids in sets:
        chosen = [used.get(identity) or _plainest(problem, identity) for identity in ids]
        if chosen and not library.has([law for law, _ in chosen]):
            picked.append(
                (
                    best,
                    tuple(law for law, _ in chosen),
                    np.concatenate([part for _, part in chosen]),
                )
            )
    library.add(polished(problem, fit_subsets(problem, _starts(problem, picked), iterations=8)))


def fit_other_laws(
    problem: InferenceProblem, current: SubsetFit, laws: Sequence[EffectLaw]
) -> list[SubsetFit]:
    """The most promising sets in which one of some laws joins the current set, takes the place of
    one of its effects, or acts alone; fitted and polished. A set has one law of each effect.

    Parameters:
        problem: The problem that they are fitted to.
        current: The set that is changed.
        laws: The laws that are tried, which need not be the problem's.
    """
    moves = []
    for law in laws:
        at = [i for i, own in enumerate(current.laws) if own.id == law.id]
        rest = _without(current, at[0]) if at else _Move(current.laws, current.u)
        places = split_parts(rest.laws, rest.u)
        kept = [list(range(len(rest.laws)))]
        kept += [[i for i in kept[0] if i != out] for out in kept[0]]
        kept += [[]] if len(rest.laws) > 1 else []
        for rows in kept:
            own_laws = tuple(rest.laws[i] for i in rows)
            own_u = [places[i] for i in rows]
            moves += [_Move((*own_laws, law), np.concatenate([*own_u, u])) for u in law.starts()]
    return polished(
        problem, _fitted(problem, ModelLibrary(problem), [(current, moves)]), steps=_FROM_ALL
    )


def _plainest(problem: InferenceProblem, identity: str) -> tuple[EffectLaw, Floats]:
    """The likeliest law of an effect before any evidence, and the middle of where its search
    begins."""
    law = max((law for law in problem.laws if law.id == identity), key=lambda law: law.log_prior)
    return law, law.starts()[len(law.starts()) // 2]


@dataclass(frozen=True, eq=False)
class _Move:
    laws: tuple[EffectLaw, ...]
    u: Floats


def _fit_singles(problem: InferenceProblem, library: ModelLibrary) -> None:
    """Every law by itself, from its best start: a law whose starts are all far off is else passed
    by, and where it fits is another start for it beside other effects."""
    empty = library.best()
    moves = _additions(problem, library, empty)
    scores, places = _screened(problem, empty, moves)
    best: dict[str, int] = {}
    for index in np.argsort(scores):
        best[moves[index].laws[0].key] = int(index)
    library.add(
        fit_subsets(
            problem, _starts(problem, [(empty, moves[i].laws, places[i]) for i in best.values()])
        )
    )


def _starts_of(library: ModelLibrary, law: EffectLaw) -> list[Floats]:
    """Where a law may begin: its usual starts, and where it fits by itself."""
    single = library.fits.get((law.key,))
    return [*law.starts(), *([] if single is None else [single.u])]


def _additions(problem: InferenceProblem, library: ModelLibrary, current: SubsetFit) -> list[_Move]:
    taken = set(current.effects)
    laws = [law for law in problem.laws if law.id not in taken]
    moves = [
        _Move((*current.laws, law), np.concatenate([current.u, u]))
        for law in laws
        if not law.levels
        for u in _starts_of(library, law)
    ]
    problem.changes(
        [point_of(move.laws, move.u) for move in moves]
    )  # one batch, of which levels take what they need
    return moves + [_level_addition(problem, current, law) for law in laws if law.levels]


#: Where a parameter that grows from nothing does next to nothing.
_NEXT_TO_NOTHING = -2.5


def _level_addition(problem: InferenceProblem, current: SubsetFit, law: EffectLaw) -> _Move:
    """Each level begins where its cells fit best: at a start of the law with one value, or at
    nothing."""
    starts = law.common.starts()
    nothing = _NEXT_TO_NOTHING if law.coordinates[0].one_sided else 0.0
    places = np.array([nothing, *(u[0] for u in starts)])
    points = [current.point(), *((*current.point(), (law.common, u)) for u in starts)]
    cost = np.zeros((len(points), len(law.level_names)))
    for index, (block, table) in enumerate(
        zip(problem.blocks, problem.changes(points), strict=True)
    ):
        variance = np.diag(covariance(block, current.contributions[index], current.errors[index]))
        weighted = residual(block, table) ** 2 / variance
        levels = problem.cell_levels(law, block)
        for level in range(len(law.level_names)):
            cost[:, level] += weighted[:, levels == level].sum(axis=1)
    u = law.level_start(places[cost.argmin(axis=0)])
    return _Move((*current.laws, law), np.concatenate([current.u, u]))


def _drops(current: SubsetFit) -> list[_Move]:
    return [_without(current, i) for i in range(len(current.laws))]


def _without(current: SubsetFit, index: int) -> _Move:
    parts = [part for i, part in enumerate(current.parts) if i != index]
    laws = tuple(law for i, law in enumerate(current.laws) if i != index)
    return _Move(laws, np.concatenate(parts) if parts else np.zeros(0))


def _exchanges(problem: InferenceProblem, library: ModelLibrary, current: SubsetFit) -> list[_Move]:
    moves = []
    for index, old in enumerate(current.laws):
        rest = _without(current, index)
        taken = {law.id for law in rest.laws}
        for law in problem.laws:
            if law.key == old.key or law.id in taken or (law.levels and law.id != old.id):
                continue
            same = (
                [_spread(current.parts[index], old, law)]
                if _alike(old, law)
                else _starts_of(library, law)
            )
            moves += [_Move((*rest.laws, law), np.concatenate([rest.u, u])) for u in same]
    return moves


def _alike(old: EffectLaw, new: EffectLaw) -> bool:
    """Whether one is the other with levels of its own, or without."""
    return (
        old.id == new.id
        and bool(old.levels) != bool(new.levels)
        and old.coordinates == new.coordinates
    )


def _spread(u: Floats, old: EffectLaw, new: EffectLaw) -> Floats:
    rows = u.reshape(len(old.coordinates), -1)
    out = np.zeros((len(new.coordinates), 1 + len(new.level_names)))
    root = np.sqrt(COMMON_SHARE)
    out[:, 0] = rows[:, 0] * (root if old.levels else 1 / root)
    return out.ravel()


def _fitted(
    problem: InferenceProblem,
    library: ModelLibrary,
    moves: Sequence[tuple[SubsetFit, Sequence[_Move]]],
    count: int = _FITTED,
) -> list[SubsetFit]:
    """The most promising moves from each set, fitted; those that are in the library already are
    left out."""
    open_moves = [
        (current, [move for move in own if not library.has(move.laws)]) for current, own in moves
    ]
    problem.changes(
        [point_of(move.laws, move.u) for _, own in open_moves for move in own]
    )  # one batch for all
    picked: list[tuple[SubsetFit, tuple[EffectLaw, ...], Floats]] = []
    seen: set[tuple[str, ...]] = set()
    for current, own in open_moves:
        if not own:
            continue
        scores, places = _screened(problem, current, own)
        fresh = 0
        of_law: Counter[str] = Counter()
        for index in np.argsort(-scores):
            key = tuple(sorted(law.key for law in own[index].laws))
            new = next((law.key for law in own[index].laws if law.key not in current.key), "")
            if key not in seen and of_law[new] < _OF_ONE_LAW:
                seen.add(key)
                of_law[new] += 1
                picked.append((current, own[index].laws, places[index]))
                fresh += 1
            if fresh >= count:
                break
    fits = fit_subsets(problem, _starts(problem, picked))
    library.add(fits)
    return fits


def _starts(
    problem: InferenceProblem, picked: Sequence[tuple[SubsetFit, tuple[EffectLaw, ...], Floats]]
) -> list[Start]:
    """Derivatives and discrepancies of laws that stay are those of the set that a start comes from;
    those of new ones are simulated. `picked`: the set, the laws of the start, and its u."""
    points = []
    for current, laws, u in picked:
        points.append(point_of(laws, u))
        for i in _new_places(current, laws):
            moved = u.copy()
            moved[i] += _DIFFERENCE
            points.append(point_of(laws, moved))
        points += [point_of(*_removed(laws, u, law)) for law in laws if law.key not in current.key]
    tables = problem.changes(points) if points else []
    starts, at = [], 0
    for current, laws, u in picked:
        new = _new_places(current, laws)
        added = [law for law in laws if law.key not in current.key]
        base, slopes = at, slice(at + 1, at + 1 + len(new))
        without = slice(slopes.stop, slopes.stop + len(added))
        at = without.stop
        rows, own = _shared(laws, dict(zip(current.key, _columns(current), strict=True)))
        jacobian, contributions = [], []
        for index, table in enumerate(tables):
            slope = np.zeros((table.shape[1], len(u)))
            slope[:, rows] = current.jacobian[index][:, own]
            slope[:, new] = np.nan_to_num((table[slopes] - table[base]) / _DIFFERENCE).T
            jacobian.append(slope)
            part = dict(zip(current.key, current.contributions[index], strict=True))
            part |= {
                law.key: np.nan_to_num(table[base] - table[without.start + i])
                for i, law in enumerate(added)
            }
            contributions.append(np.array([part[law.key] for law in laws]).reshape(len(laws), -1))
        change = tuple(table[base] for table in tables)
        starts.append(Start(laws, u, tuple(contributions), current.errors, change, tuple(jacobian)))
    return starts


def _new_places(current: SubsetFit, laws: Sequence[EffectLaw]) -> list[int]:
    """Places in u of laws that the current set has not."""
    places, at = [], 0
    for law in laws:
        if law.key not in current.key:
            places += list(range(at, at + law.size))
        at += law.size
    return places


def _removed(
    laws: Sequence[EffectLaw], u: Floats, out: EffectLaw
) -> tuple[tuple[EffectLaw, ...], Floats]:
    parts = split_parts(laws, u)
    kept = [i for i, law in enumerate(laws) if law.key != out.key]
    return tuple(laws[i] for i in kept), np.concatenate([np.zeros(0), *(parts[i] for i in kept)])


def _screened(
    problem: InferenceProblem, current: SubsetFit, moves: Sequence[_Move]
) -> tuple[Floats, list[Floats]]:
    """A score of each move, higher is better, and where its fit begins: the parameters of effects
    that stay are adjusted by the current set's derivatives."""
    from scipy.linalg import solve_triangular

    tables = problem.changes([point_of(move.laws, move.u) for move in moves])
    columns = {law.key: part for law, part in zip(current.laws, _columns(current), strict=True)}
    gains = np.zeros(len(moves))
    quadratic = [np.eye(len(move.u)) for move in moves]
    linear = [-move.u for move in moves]
    shared_places = [_shared(move.laws, columns) for move in moves]
    for index, block in enumerate(problem.blocks):
        factor = covariance_factor(block, current.contributions[index], current.errors[index])
        residuals = residual(block, tables[index])
        white = solve_triangular(factor, residuals.T, lower=True)
        slopes = (
            solve_triangular(factor, current.jacobian[index], lower=True)
            if len(current.u)
            else None
        )
        gains -= 0.5 * np.einsum("nk,nk->k", white, white)
        for k, (rows, own) in enumerate(shared_places):
            if slopes is None or not len(rows):
                continue
            jacobian = slopes[:, own]
            quadratic[k][np.ix_(rows, rows)] += jacobian.T @ jacobian
            linear[k][rows] += jacobian.T @ white[:, k]
    places = []
    for k, move in enumerate(moves):
        step = (
            np.clip(np.linalg.solve(quadratic[k], linear[k]), -1.5, 1.5)
            if len(move.u)
            else np.zeros(0)
        )
        held_mask = np.ones(len(move.u), dtype=bool)
        held_mask[shared_places[k][0]] = False
        step[held_mask] = 0.0
        gains[k] += float(linear[k] @ step - 0.5 * step @ quadratic[k] @ step) - 0.5 * float(
            move.u @ move.u
        )
        gains[k] += sum(law.log_prior for law in move.laws)
        places.append(np.clip(move.u + step, -4.0, 4.0))
    return gains, places


def _columns(fit: SubsetFit) -> list[NDArray[np.intp]]:
    return split_parts(fit.laws, np.arange(len(fit.u)))  # type: ignore[arg-type,return-value]


def _shared(
    laws: Sequence[EffectLaw], columns: dict[str, NDArray[np.intp]]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Places in u of some laws, and in that of the current set, of those that are in both."""
    rows, own, at = [], [], 0
    for law in laws:
        if law.key in columns:
            rows += list(range(at, at + law.size))
            own += [int(i) for i in columns[law.key]]
        at += law.size
    return np.array(rows, dtype=np.intp), np.array(own, dtype=np.intp)
