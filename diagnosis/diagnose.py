"""The diagnosis: where the gap between bench and twin lies, which effect causes it, how far it shrinks."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..twin.effects import Effect, catalogue
from .calibration import CalibrationMap, shipped
from .causes import causes, fits
from .chain import stages_of
from .evidence.scene import Scene
from .evidence.surface import Surface, surfaces
from .evidence.weighing import Weighed, weigh
from .gap import GapTable
from .metric import Metric
from .options import Options
from .own_design import own_map
from .pictures import Pictures
from .record import CampaignRecord
from .stages.base import Stage
from .verdict import NONE, UNKNOWN, Cause, Shrinkage, Verdict, Where

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
    from .drawing import pictures_of
    from .found import where
    from .localisation.stages import stage_notes
    from .next_runs import next_runs

    started = time.perf_counter()
    rng = np.random.default_rng(options.seed)
    stages, notes = stages_of(record, options)
    notes = (*notes, *_plausible(record, stages))
    gap = GapTable.of(record, stages, options.widened)
    tell(1, _STEPS, "effects")
    table = surfaces(stages, _kinds(options))
    tell(2, _STEPS, "causes")
    scene = Scene.of(gap, table)
    if options.mapped and options.calibrate:
        options = replace(options, map=own_map(scene, options.priors, options.calibrate, options.seed, tell))
    weighed = weigh(scene, options.priors, stages)
    found = causes(weighed, probabilities(weighed, options))
    tell(3, _STEPS, "where")
    place = where(gap, stages, rng) if options.where else Where()
    tell(4, _STEPS, "shrinkage")
    metric = Metric.of(gap)
    shrunk = _shrunk(gap, table, stages, metric, options, rng) if options.shrink else ()
    tell(5, _STEPS, "next experiment")
    planned = next_runs(weighed, stages, found, rng) if options.plan else ()
    tell(_STEPS, _STEPS, "done")
    return Verdict(
        campaign=record.name,
        simulator=" | ".join(stage.simulator for stage in stages),
        gap=metric.size(gap),
        where=place,
        causes=found,
        shrinkage=shrunk,
        next_runs=planned,
        assumptions=(
            *record.assumptions,
            *notes,
            *stage_notes(stages),
            *_assumed(gap, options),
            *_warned(found, shrunk),
        ),
        seconds=time.perf_counter() - started,
        fits=fits(weighed, found),
        pictures=pictures_of(gap, stages, found[0].fitted) if options.draw else Pictures(),
    )


def _kinds(options: Options) -> list[type[Effect]]:
    """The effects that are looked for. Raises `LookupError` for one that there is not."""
    known = catalogue()
    if options.catalogue is None:
        return list(known.values())
    if missing := [name for name in options.catalogue if name not in known]:
        raise LookupError(f"no effect {missing[0]!r}; there are: {', '.join(known)}")
    return [kind for name, kind in known.items() if name in options.catalogue]


def probabilities(weighed: Weighed, options: Options) -> dict[str, float]:
    """By hypothesis, largest first: evidence through the map that was learned, or as it stands."""
    return _map(weighed.scene.gap, options)(weighed.log_joint) if options.mapped else weighed.probability


def _map(gap: GapTable, options: Options) -> CalibrationMap:
    return options.map or shipped(gap.stages)


def chosen(weighed: Weighed, options: Options) -> tuple[Effect, ...]:
    """The effects of the likeliest hypothesis, fitted; () for none and unknown."""
    return weighed.effects(next(iter(probabilities(weighed, options))))


def choose(
    gap: GapTable, table: Sequence[Surface], options: Options
) -> Callable[[NDArray[np.intp]], tuple[Effect, ...]]:
    """What chooses cause and parameters on some of the configurations alone."""

    def on(rows: NDArray[np.intp]) -> tuple[Effect, ...]:
        scene = Scene.of(gap.only(rows), [surface.only(rows) for surface in table])
        return chosen(weigh(scene, options.priors, quick=True), options)

    return on


def _shrunk(
    gap: GapTable,
    table: Sequence[Surface],
    stages: Sequence[Stage],
    metric: Metric,
    options: Options,
    rng: np.random.Generator,
) -> tuple[Shrinkage, ...]:
    from .shrinkage.measure import shrinkage

    return shrinkage(stages, choose(gap, table, options), rng, metric.scales(gap))


def _plausible(record: CampaignRecord, stages: Sequence[Stage]) -> tuple[str, ...]:
    from .plausibility import check

    return tuple(finding.message for finding in check(record, stages))


#: Held out, a cause that takes less of the gap than this does not predict what it has not seen.
_PREDICTS = 0.3


def _warned(found: Sequence[Cause], shrunk: Sequence[Shrinkage]) -> tuple[str, ...]:
    """That the likeliest cause of the catalogue is not much of one: probabilities are among its hypotheses alone."""
    named = [name for name in found[0].effects if name not in (NONE, UNKNOWN)]
    held = [each.fraction for each in shrunk if each.held_out_by == "configuration" and each.fraction is not None]
    return tuple(
        f"{named[0]} is the likeliest cause of the catalogue, but what is chosen on other configurations takes only "
        f"{fraction:.0%} of the gap where it was not fitted: a cause outside of the catalogue is possible"
        for fraction in held
        if named and fraction < _PREDICTS
    )


def _assumed(gap: GapTable, options: Options) -> tuple[str, ...]:
    priors = options.priors
    found = [
        f"priors: none {priors.none:g}, single effects {priors.singles:g}, pairs {priors.pairs:g}, "
        f"unknown {priors.unknown:g}"
    ]
    if options.mapped:
        found.append(f"probabilities: evidence through a map of margins, learned on {_map(gap, options).source}")
    if gap.noise.assumed:
        found.append(
            "floor assumed: nothing was repeated, the scatter of one run is the sensors' data sheets', and the "
            "probabilities are not calibrated"
        )
    return tuple(found)
