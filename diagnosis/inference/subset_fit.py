"""One set of effects fitted to the gap: the mode of its posterior and the evidence for it.

Glossary: r (N,) residual z - Delta(u) of one stage, J (N, p) derivative of Delta for u, S (N, N)
covariance of r without the uncertainty of u; u (p,) has a standard normal prior.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...array_types import Floats
from .effect_laws import EffectLaw
from .model_error import bank
from .problem import NO_ANSWER, InferenceProblem, Point, StageBlock

#: Amplitudes of laws' discrepancies, as shares of what the effects do, and their prior.
DISCREPANCIES = np.array([0.0, 0.03, 0.06, 0.12, 0.25, 0.5, 1.0])
_LOG_PRIOR = np.log(np.full(len(DISCREPANCIES), 1 / len(DISCREPANCIES)))
#: Step of the differences in u; longest step of one iteration; how far from its prior's middle a
#: parameter may go.
_DIFFERENCE, _STEP, _FARTHEST = 0.03, 1.2, 4.5
#: Standard deviation by which a smooth background may be beyond tolerance, in tolerances, and a
#: rough one.
_BEYOND_TOLERANCE, _ROUGH_BEYOND_TOLERANCE = 0.2, 0.4
#: From this amplitude on, what configurations have of their own makes a background a rough one.
_ROUGH = 0.4
#: A step in u that is too short to matter.
_SETTLED = 0.02
#: Steps in a region of trust.
_TRUSTED_STEPS = 30
#: Memory of the factors that are kept for a stage.
_FACTOR_BYTES = 100_000_000


@dataclass(frozen=True)
class ErrorSize:
    """Of one stage: member of the bank of backgrounds, and amplitudes of the laws' discrepancy
    (places in `DISCREPANCIES`) for amplitudes and durations, and for details of shape and
    timing."""

    background: int = 0
    discrepancy: int = 0
    detail: int = 0


@dataclass(frozen=True, eq=False)
class SubsetFit:
    """A set of laws at the mode of its posterior.

    By stage: `change` (N,) in tolerances, `jacobian` (N, p), `contributions` (m, N): what each of
    the m laws adds to the others. `errors` by stage. `log_evidence` is Laplace's, without the prior
    of the set.
    """

    laws: tuple[EffectLaw, ...]
    u: Floats
    change: tuple[Floats, ...]
    jacobian: tuple[Floats, ...]
    contributions: tuple[Floats, ...]
    errors: tuple[ErrorSize, ...]
    log_evidence: float
    precision: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    polished: bool = False

    @property
    def key(self) -> tuple[str, ...]:
        return tuple(law.key for law in self.laws)

    @property
    def effects(self) -> tuple[str, ...]:
        return tuple(law.id for law in self.laws)

    def point(self, u: Floats | None = None) -> Point:
        return point_of(self.laws, self.u if u is None else u)

    @property
    def parts(self) -> list[Floats]:
        """u of each law."""
        return split_parts(self.laws, self.u)


def split_parts(laws: Sequence[EffectLaw], u: Floats) -> list[Floats]:
    ends = list(itertools.accumulate(law.size for law in laws))
    return [u[end - law.size : end] for law, end in zip(laws, ends, strict=True)]


def point_of(laws: Sequence[EffectLaw], u: Floats) -> Point:
    return tuple(zip(laws, split_parts(laws, u), strict=True))


def no_effects(problem: InferenceProblem) -> SubsetFit:
    """The empty set, with the backgrounds that suit the gap best."""
    empty = SubsetFit(
        laws=(),
        u=np.zeros(0),
        change=tuple(np.zeros(len(block.z)) for block in problem.blocks),
        jacobian=tuple(np.zeros((len(block.z), 0)) for block in problem.blocks),
        contributions=tuple(np.zeros((0, len(block.z))) for block in problem.blocks),
        errors=tuple(ErrorSize() for _ in problem.blocks),
        log_evidence=-np.inf,
    )
    return with_evidence(problem, empty, search_errors=True, backgrounds=True)


def residual(block: StageBlock, change: Floats) -> Floats:
    return np.asarray(np.where(np.isfinite(change), block.z - change, NO_ANSWER))


def covariance(block: StageBlock, contributions: Floats, error: ErrorSize) -> Floats:
    """S (N, N)."""
    base = block.covariances[error.background]
    if not _has_discrepancy(contributions, error):
        return np.asarray(base)
    share = np.where(block.detail, DISCREPANCIES[error.detail], DISCREPANCIES[error.discrepancy])
    scaled = np.nan_to_num(contributions) * share
    matrix = scaled.T @ scaled
    matrix *= block.discrepancy  # in place: a plate has a million of its elements
    matrix += base
    return np.asarray(matrix)


def _has_discrepancy(contributions: Floats, error: ErrorSize) -> bool:
    return bool(len(contributions) and (error.discrepancy or error.detail))


def covariance_factor(block: StageBlock, contributions: Floats, error: ErrorSize) -> Floats:
    """The lower Cholesky factor of S (N, N). The last ones of a stage are kept: sets that differ in
    the effects of other stages have the same."""
    acting = (
        contributions[contributions.any(axis=1)]
        if _has_discrepancy(contributions, error)
        else contributions[:0]
    )
    key = (error if len(acting) else error.background, acting.tobytes())
    lower = block.factors.pop(key, None)
    if lower is None:
        lower = factor(covariance(block, acting, error))
    block.factors[key] = lower  # the latest is the last
    while len(block.factors) * lower.nbytes > _FACTOR_BYTES:
        block.factors.pop(next(iter(block.factors)))
    return lower


def with_evidence(
    problem: InferenceProblem,
    fit: SubsetFit,
    *,
    search_errors: bool = False,
    backgrounds: bool = False,
    factors: Sequence[Floats] = (),
) -> SubsetFit:
    """The fit with its Laplace evidence, log p(z) = sum over stages of log N(r; 0, S) - |u|^2 / 2 -
    log|I + sum J' S^-1 J| / 2, and with the sizes of errors that make it largest.

    `factors`: Cholesky factors of S by stage, as the fit has its errors, where they are known."""
    errors, pieces = list(fit.errors), []
    for index, block in enumerate(problem.blocks):
        terms = _block_terms(block, fit, index, errors[index], factors[index] if factors else None)
        if search_errors:
            errors[index], terms = _best_errors(
                block, fit, index, errors[index], terms, backgrounds=backgrounds
            )
        pieces.append(terms)
    precision = np.eye(len(fit.u)) + sum(
        (piece[1] for piece in pieces), np.zeros((len(fit.u), len(fit.u)))
    )
    log_likelihood = sum(piece[0] for piece in pieces)
    log_prior = sum(_log_prior(error) for i, error in enumerate(errors) if _acts(fit, i))
    log_prior -= sum(np.log(len(block.covariances)) for block in problem.blocks)
    log_prior += sum(
        _background_prior(block, fit, i, errors[i]) for i, block in enumerate(problem.blocks)
    )
    log_evidence = (
        log_likelihood
        + log_prior
        - 0.5 * float(fit.u @ fit.u)
        - 0.5 * float(np.linalg.slogdet(precision)[1])
    )
    return replace(fit, errors=tuple(errors), log_evidence=float(log_evidence), precision=precision)


def _acts(fit: SubsetFit, index: int) -> bool:
    """Whether any law of a set does anything in a stage, so that it can be wrong there."""
    return bool(fit.contributions[index].any())


def _background_prior(block: StageBlock, fit: SubsetFit, index: int, error: ErrorSize) -> float:
    """A background lies within tolerance: what remains beyond noise, tolerance and the laws' errors
    is less and less likely to be one, whatever its kernel says."""
    cells = ~block.detail
    if not cells.any():
        return 0.0
    scaled = DISCREPANCIES[error.discrepancy] * np.nan_to_num(fit.contributions[index][:, cells])
    noise = np.diag(block.covariances[0])[cells]
    allowed = float(np.sqrt(np.mean(1 + (scaled**2).sum(axis=0))))
    residual_variance = float(np.mean(residual(block, fit.change[index])[cells] ** 2 - noise))
    beyond = max(float(np.sqrt(max(residual_variance, 0.0))) / allowed - 1.0, 0.0)
    rough = bank(block.stage)[error.background].white >= _ROUGH
    return -0.5 * (beyond / (_ROUGH_BEYOND_TOLERANCE if rough else _BEYOND_TOLERANCE)) ** 2


def _log_prior(error: ErrorSize) -> float:
    return float(_LOG_PRIOR[error.discrepancy] + _LOG_PRIOR[error.detail])


#: Of one stage: log N(r; 0, S) and J' S^-1 J.
_Terms = tuple[float, Floats]


def _block_terms(
    block: StageBlock, fit: SubsetFit, index: int, error: ErrorSize, lower: Floats | None = None
) -> _Terms:
    if lower is None:
        lower = covariance_factor(block, fit.contributions[index], error)
    white = whitened(
        lower, np.column_stack([residual(block, fit.change[index]), fit.jacobian[index]])
    )
    log_norm = -float(np.log(np.diag(lower)).sum()) - 0.5 * len(block.z) * float(np.log(2 * np.pi))
    return log_norm - 0.5 * float(white[:, 0] @ white[:, 0]), white[:, 1:].T @ white[:, 1:]


@dataclass(frozen=True, eq=False)
class _ScoredErrors:
    """Sizes of the errors of one stage, with what a search for them compares, and the terms of the
    evidence."""

    score: float
    error: ErrorSize
    terms: _Terms


def _best_errors(
    block: StageBlock,
    fit: SubsetFit,
    index: int,
    start: ErrorSize,
    terms: _Terms,
    *,
    backgrounds: bool,
) -> tuple[ErrorSize, _Terms]:
    """The likeliest sizes near `start`, which has the `terms`, and theirs; of the backgrounds all
    are tried, or the one at hand is kept."""

    def scored(error: ErrorSize, terms: _Terms | None = None) -> _ScoredErrors:
        terms = terms or _block_terms(block, fit, index, error)
        spread = float(np.linalg.slogdet(np.eye(len(fit.u)) + terms[1])[1]) if len(fit.u) else 0.0
        prior = _log_prior(error) if _acts(fit, index) else 0.0
        return _ScoredErrors(terms[0] - 0.5 * spread + prior, error, terms)

    best = scored(start, terms)
    if backgrounds:
        others = (
            replace(start, background=i)
            for i in range(len(block.covariances))
            if i != start.background
        )
        best = max([best, *map(scored, others)], key=lambda option: option.score)
    if _acts(fit, index):
        names = ("discrepancy", "detail") if block.detail.any() else ("discrepancy",)
        for name in names:
            best = _climbed(best, name, scored)
    return best.error, best.terms


def _climbed(
    best: _ScoredErrors, name: str, scored: Callable[[ErrorSize], _ScoredErrors]
) -> _ScoredErrors:
    """Neighbouring amplitudes in one direction, then in the other, as long as they are likelier."""
    for side in (1, -1):
        while 0 <= (place := getattr(best.error, name) + side) < len(DISCREPANCIES):
            option = scored(replace(best.error, **{name: place}))
            if option.score <= best.score:
                break
            best = option
    return best


@dataclass(frozen=True, eq=False)
class Start:
    """Where a fit begins. `contributions` by stage (m, N) and `errors` say what its covariance is
    made of; `change` (N,) and `jacobian` (N, p) by stage are those of `u`, the latter perhaps of a
    set nearby."""

    laws: tuple[EffectLaw, ...]
    u: Floats
    contributions: tuple[Floats, ...]
    errors: tuple[ErrorSize, ...]
    change: tuple[Floats, ...]
    jacobian: tuple[Floats, ...]


def fit_subsets(
    problem: InferenceProblem,
    starts: Sequence[Start],
    iterations: int = 4,
    *,
    backgrounds: bool = False,
) -> list[SubsetFit]:
    """Quasi-Newton fits of all starts at once, so that one batch simulates all of them.

    Gauss and Newton's steps with Broyden's updates of the derivatives (Math. Comput. 19 (1965)
    577): one simulation for each step. Steps that make the posterior less likely are shortened.
    """
    if not starts:
        return []
    u = [start.u.copy() for start in starts]
    change, jacobian = [start.change for start in starts], [start.jacobian for start in starts]
    factors = [
        [
            covariance_factor(block, start.contributions[i], start.errors[i])
            for i, block in enumerate(problem.blocks)
        ]
        for start in starts
    ]
    cost = [_cost(problem, factors[k], change[k], u[k]) for k in range(len(starts))]
    shorter = np.ones(len(starts))
    active = list(range(len(starts)))
    for _ in range(iterations):
        step = {
            k: shorter[k] * newton_step(problem, factors[k], change[k], jacobian[k], u[k])
            for k in active
        }
        active = [k for k in active if np.abs(step[k]).max(initial=0.0) > _SETTLED]
        if not active:
            break
        trial = {k: np.clip(u[k] + step[k], -_FARTHEST, _FARTHEST) for k in active}
        tried = _changes(problem, [starts[k].laws for k in active], [trial[k] for k in active])
        for k, new_change in zip(active, tried, strict=True):
            jacobian[k] = _broyden(jacobian[k], change[k], new_change, trial[k] - u[k])
            new_cost = _cost(problem, factors[k], new_change, trial[k])
            if new_cost < cost[k]:
                u[k], cost[k], change[k], shorter[k] = trial[k], new_cost, new_change, 1.0
            else:
                shorter[k] *= 0.3
    fits = []
    for k, start in enumerate(starts):
        fit = SubsetFit(
            start.laws, u[k], change[k], jacobian[k], start.contributions, start.errors, -np.inf
        )
        fits.append(
            with_evidence(
                problem, fit, search_errors=True, backgrounds=backgrounds, factors=factors[k]
            )
        )
    return fits


def polished(
    problem: InferenceProblem, fits: Sequence[SubsetFit], steps: int = 2
) -> list[SubsetFit]:
    """The same sets with derivatives and contributions as simulated at their modes, which move a
    little."""
    if not fits:
        return []
    laws, places = [fit.laws for fit in fits], [fit.u for fit in fits]
    problem.changes(
        [*_nearby(laws, places)[0], *_left_out_points(laws, places)]
    )  # one batch for both
    change, jacobian = linearised(problem, laws, places)
    contributions = leave_one_out(problem, laws, places, change)
    starts = [
        Start(fit.laws, fit.u, contributions[k], fit.errors, change[k], jacobian[k])
        for k, fit in enumerate(fits)
    ]
    return [
        replace(fit, polished=True)
        for fit in fit_subsets(problem, starts, iterations=steps, backgrounds=True)
    ]


def least_squares_place(
    problem: InferenceProblem, laws: tuple[EffectLaw, ...], u: Floats
) -> Floats:
    """(p,): where exact laws fit best beside a usual background, by steps in a region of trust
    (Branch, Coleman and Li, SIAM J. Sci. Comput. 21 (1999) 1). A shot without an answer is far
    off."""
    from scipy.optimize import least_squares

    factors = [factor(block.covariances[block.usual]) for block in problem.blocks]

    def misfit(place: Floats) -> Floats:
        changes = problem.changes([point_of(laws, place)])
        white = [
            whitened(lower, residual(block, table[0]))
            for block, lower, table in zip(problem.blocks, factors, changes, strict=True)
        ]
        return np.concatenate([place, *white])

    def slope(place: Floats) -> Floats:
        jacobian = linearised(problem, [laws], [place])[1][0]
        white = [-whitened(lower, own) for lower, own in zip(factors, jacobian, strict=True)]
        return np.vstack([np.eye(len(place)), *white])

    return np.asarray(least_squares(misfit, u, slope, x_scale=1.0, max_nfev=_TRUSTED_STEPS).x)


def _broyden(
    jacobian: tuple[Floats, ...],
    before: tuple[Floats, ...],
    after: tuple[Floats, ...],
    step: Floats,
) -> tuple[Floats, ...]:
    square = float(step @ step)
    if square == 0:
        return jacobian
    return tuple(
        own
        + np.outer(
            np.nan_to_num(new - old) * np.isfinite(new - old) - own @ step * np.isfinite(new - old),
            step,
        )
        / square
        for own, old, new in zip(jacobian, before, after, strict=True)
    )


def leave_one_out(
    problem: InferenceProblem,
    laws: Sequence[tuple[EffectLaw, ...]],
    u: Sequence[Floats],
    change: Sequence[tuple[Floats, ...]],
) -> list[tuple[Floats, ...]]:
    """By start and stage (m, N): the change less that of all laws but one; 0 where there is no
    answer."""
    points = _left_out_points(laws, u)
    tables = (
        problem.changes(points)
        if points
        else [np.zeros((0, len(block.z))) for block in problem.blocks]
    )
    contributions, at = [], 0
    for own_laws, own_change in zip(laws, change, strict=True):
        rows = slice(at, at + len(own_laws))
        at = rows.stop
        contributions.append(
            tuple(np.nan_to_num(own_change[i] - table[rows]) for i, table in enumerate(tables))
        )
    return contributions


def _left_out_points(laws: Sequence[tuple[EffectLaw, ...]], u: Sequence[Floats]) -> list[Point]:
    """Every set without each of its laws."""
    points: list[Point] = []
    for own_laws, own in zip(laws, u, strict=True):
        point = point_of(own_laws, own)
        points += [tuple(pair for j, pair in enumerate(point) if j != i) for i in range(len(point))]
    return points


def linearised(
    problem: InferenceProblem, laws: Sequence[tuple[EffectLaw, ...]], u: Sequence[Floats]
) -> tuple[list[tuple[Floats, ...]], list[tuple[Floats, ...]]]:
    """Changes by stage (N,), and their derivatives (N, p); 0 where there is no answer."""
    points, signs = _nearby(laws, u)
    tables = problem.changes(points)
    changes, jacobians, at = [], [], 0
    for own, sign in zip(u, signs, strict=True):
        base, moved_rows = at, slice(at + 1, at + 1 + len(own))
        at = moved_rows.stop
        changes.append(tuple(table[base] for table in tables))
        jacobians.append(
            tuple(
                np.nan_to_num((table[moved_rows] - table[base]) / (sign[:, None] * _DIFFERENCE)).T
                for table in tables
            )
        )
    return changes, jacobians


def _nearby(
    laws: Sequence[tuple[EffectLaw, ...]], u: Sequence[Floats]
) -> tuple[list[Point], list[Floats]]:
    """Every set, and with each of its u moved a little; the sign of each move."""
    points: list[Point] = []
    signs: list[Floats] = []
    for own_laws, own in zip(laws, u, strict=True):
        points.append(point_of(own_laws, own))
        sign = np.where(own > 0, -1.0, 1.0)
        signs.append(sign)
        for i in range(len(own)):
            moved = own.copy()
            moved[i] += sign[i] * _DIFFERENCE
            points.append(point_of(own_laws, moved))
    return points, signs


def _changes(
    problem: InferenceProblem, laws: Sequence[tuple[EffectLaw, ...]], u: Sequence[Floats]
) -> list[tuple[Floats, ...]]:
    tables = problem.changes(
        [point_of(own_laws, own) for own_laws, own in zip(laws, u, strict=True)]
    )
    return [tuple(table[k] for table in tables) for k in range(len(u))]


def factor(matrix: Floats) -> Floats:
    from scipy.linalg import cholesky

    return np.asarray(cholesky(matrix, lower=True, check_finite=False))


def whitened(factor: Floats, values: Floats) -> Floats:
    from scipy.linalg import solve_triangular

    return np.asarray(solve_triangular(factor, values, lower=True, check_finite=False))


def _cost(
    problem: InferenceProblem, factors: Sequence[Floats], change: Sequence[Floats], u: Floats
) -> float:
    """Minus the logarithm of the posterior, up to a constant."""
    total = 0.5 * float(u @ u)
    for block, factor, own in zip(problem.blocks, factors, change, strict=True):
        white = whitened(factor, residual(block, own))
        total += 0.5 * float(white @ white)
    return total


def newton_step(
    problem: InferenceProblem,
    factors: Sequence[Floats],
    change: Sequence[Floats],
    jacobian: Sequence[Floats],
    u: Floats,
) -> Floats:
    """Gauss and Newton's: (I + J' S^-1 J) step = J' S^-1 r - u."""
    if not len(u):
        return np.zeros(0)
    matrix, right = np.eye(len(u)), -u
    for block, factor, own, slope in zip(problem.blocks, factors, change, jacobian, strict=True):
        answered = np.isfinite(own)
        white = whitened(
            factor, np.column_stack([np.where(answered, residual(block, own), 0.0), slope])
        )
        matrix = matrix + white[:, 1:].T @ white[:, 1:]
        right = right + white[:, 1:].T @ white[:, 0]
    step: Floats = np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
    longest = float(np.abs(step).max())
    return np.asarray(step * min(1.0, _STEP / longest)) if longest > 0 else step
