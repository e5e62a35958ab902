"""The diagnosis: where the gap between bench and twin lies, which effect causes it, how far it shrinks."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..twin.effects import Effect, catalogue
from .chain import stages_of
from .gap import GapTable
from .inference.posterior import Posterior, common_effects, fitted_effects
from .observables.base import Stage
from .options import Options
from .plot_data import Pictures
from .record import CampaignRecord
from .verdict import NONE, UNKNOWN, Cause, EffectShare, Shrinkage, Verdict, Where

if TYPE_CHECKING:
    from .gap_reduction.measure import HeldOut
    from .inference.held_out import FoldFit

__all__ = ["Options", "diagnose"]

#: Called with (done, total, what).
Progress = Callable[[int, int, str], None]
_STEPS = 6


def diagnose(record: CampaignRecord, *, options: Options | None = None, progress: Progress | None = None) -> Verdict:
    """All of it, in the order of the report. Raises `ValueError` where the campaign has nothing to compare, and
    `ImplausibleRecordError` where a channel or a unit is mislabelled."""
    import scipy.linalg  # noqa: F401 - its own BLAS must be there to be limited
    from threadpoolctl import threadpool_limits

    # The matrices are many and small: threads would wait for each other, and take twice the time.
    with threadpool_limits(limits=1):
        return _diagnosed(record, options or Options(), progress or (lambda *_: None))


def _diagnosed(record: CampaignRecord, options: Options, tell: Progress) -> Verdict:
    from .conclusion import conclude
    from .inference.shares import gap_shares
    from .localisation.stages import stage_notes
    from .localise import localise_gap
    from .next_runs import next_runs
    from .plot_builder import pictures_of

    started = time.perf_counter()
    rng = np.random.default_rng(options.seed)
    stages, notes = stages_of(record, options)
    notes = (*notes, *_plausible(record, stages))
    gap = GapTable.of(record, stages, options.tolerance_scale)
    tell(1, _STEPS, "effects")
    posterior = Posterior.of(gap, stages, _kinds(options, stages))
    tell(2, _STEPS, "shares")
    metric = posterior.metric
    shares = gap_shares(posterior.library, posterior.weights, posterior.floor, rng)
    tell(3, _STEPS, "held out")
    held = _held_out(posterior, stages, options, rng)
    entries = tuple(entry for entry, _ in held)
    conclusion = conclude(posterior, shares, held[0][1] if held else None, options.unknown_map)
    tell(4, _STEPS, "where")
    place = localise_gap(gap, stages, rng) if options.where else Where()
    tell(5, _STEPS, "next experiment")
    planned = next_runs(posterior, stages, conclusion.causes, rng) if options.plan else ()
    tell(_STEPS, _STEPS, "done")
    return Verdict(
        campaign=record.name,
        simulator=" | ".join(stage.simulator for stage in stages),
        gap=metric.size(gap),
        where=place,
        causes=conclusion.causes,
        shrinkage=entries if options.shrink else (),
        effects=conclusion.effects,
        unexplained=conclusion.unexplained,
        path=conclusion.path,
        next_runs=planned,
        assumptions=(
            *record.assumptions,
            *notes,
            *stage_notes(stages),
            *_assumed(gap, options, conclusion.effects),
            *_poor_prediction(conclusion.causes[0], entries),
        ),
        seconds=time.perf_counter() - started,
        fits={name: common_effects(fit) for name, fit in conclusion.fits.items()},
        unknown_log_odds=posterior.log_odds_unknown,
        set_scores=posterior.set_scores(),
        pictures=pictures_of(gap, stages, fitted_effects(posterior.best)) if options.draw else Pictures(),
    )


def _held_out(
    posterior: Posterior, stages: Sequence[Stage], options: Options, rng: np.random.Generator
) -> list[tuple[Shrinkage, HeldOut]]:
    from .gap_reduction.measure import measure_reduction
    from .inference.held_out import fit_fold

    def fit(rows: NDArray[np.intp]) -> FoldFit:
        return fit_fold(posterior.library, rows)

    return measure_reduction(stages, fit, rng, posterior.metric.scales(posterior.gap), options.draw)


def _kinds(options: Options, stages: Sequence[Stage]) -> list[type[Effect]]:
    """The effects that are looked for. Raises `LookupError` for one that there is not, and `ValueError` where the
    campaign can show none of them."""
    table = catalogue()
    for name in (*(options.catalogue or ()), *options.without):
        if name not in table:
            raise LookupError(f"no effect {name!r}; there are: {', '.join(table)}")
    shown = {identity for stage in stages for identity in stage.shows}
    for name in options.catalogue or ():
        if name not in shown:
            raise ValueError(f"{name} cannot show in this campaign; these can: {', '.join(sorted(shown))}")
    wanted = [name for name in table if name in (options.catalogue or table) and name not in options.without]
    return [table[name] for name in wanted]


def _plausible(record: CampaignRecord, stages: Sequence[Stage]) -> tuple[str, ...]:
    from .plausibility import check

    return tuple(finding.message for finding in check(record, stages))


def _assumed(gap: GapTable, options: Options, effects: Sequence[EffectShare]) -> tuple[str, ...]:
    sentences = ["priors: every effect acts with the same probability, such that none acts with probability 0.2"]
    if options.unknown_map.source:
        sentences.append(f"the probability of unknown was learned on {options.unknown_map.source}")
    if gap.noise.assumed:
        sentences.append(
            "floor assumed: nothing was repeated, the scatter of one run is the sensors' data sheets', and the "
            "probabilities are not calibrated"
        )
    return (*sentences, *_at_limits(effects))


#: Held out, effects that take less of the gap than this do not predict what they have not seen.
_PREDICTS = 0.3


def _poor_prediction(first: Cause, entries: Sequence[Shrinkage]) -> tuple[str, ...]:
    """That the likeliest effects of the catalogue predict little where they were not fitted."""
    if first.effects[0] in (NONE, UNKNOWN):
        return ()
    return tuple(
        f"{first.effects[0]} is the likeliest cause of the catalogue, but what is chosen on other configurations takes "
        f"only {entry.fraction:.0%} of the gap where it was not fitted: a cause outside of the catalogue is possible"
        for entry in entries
        if entry.held_out_by == "configuration" and entry.fraction is not None and entry.fraction < _PREDICTS
    )


def _at_limits(effects: Sequence[EffectShare]) -> tuple[str, ...]:
    """A sentence for each parameter of a named effect that lies outside of its likely range."""
    sentences = []
    for row in effects:
        if not row.named:
            continue
        likely = {item.name: item.likely for item in catalogue()[row.effect].parameters()}
        for item in row.parameters:
            low, high = likely.get(item.name.split(" (")[0]) or (-np.inf, np.inf)
            if not low <= item.value <= high:
                sentences.append(
                    f"{row.effect}: {item.name} = {item.value:.3g} {item.unit}".rstrip()
                    + f" lies at the end of its likely range ({low:g} to {high:g}); it may stand for something else"
                )
    return tuple(sentences)
