"""The diagnosis: where the gap between bench and twin lies, which effect causes it, how far it
shrinks.

Where the gap lies: every part of the answer that the campaign's channels allow.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ..parallel.phases import WHOLE, Phases
from ..parallel.task import one_thread
from ..twin.effects import Effect, catalogue
from .chain import stages_of
from .conclusion import Conclusion, conclude
from .gap import GapTable
from .gap_reduction import measure_reduction
from .inference.held_out import fit_fold
from .inference.posterior import HypothesisPosterior, common_effects, fitted_effects
from .inference.shares import gap_shares
from .known_facts import known_fact_sentences
from .localisation.drift import drift
from .localisation.error_map import error_map
from .localisation.factor_regions import factor_regions
from .localisation.stages import stage_notes, stage_shares
from .localisation.windows import amplitude_residual_db, frequency_bands, time_windows
from .next_runs import next_runs
from .observable_families import family_gaps
from .observables.base import Stage
from .observables.contact.stage import ContactObservables, pulse_residuals
from .options import Options
from .parameter_limits import exceeded_limit
from .plausibility import check
from .record import CampaignRecord
from .unseen_predictions import UnseenPredictions
from .verdict import NONE, UNKNOWN, FrequencyBand, Pictures, Shrinkage, TimeWindow, Verdict, Where
from .what_if_sets import what_if


def localise_gap(gap: GapTable, stages: Sequence[Stage], rng: np.random.Generator) -> Where:
    """By stage, factors, time, frequency, order of runs.

    Parameters:
        gap: The gap of the campaign.
        stages: The stages whose gap it is, in the order of the bench.
        rng: Random numbers of the samples and permutations behind intervals and p-values.
    """
    of = gap.record.configuration_of
    order = np.array([run.order for run in gap.record.runs])
    time, frequency = _of_pulses(stages, rng)
    return Where(
        stage=stage_shares(stages, rng),
        factors=factor_regions(gap.residuals, of, gap.record.configurations, gap.observables, rng),
        time=time,
        frequency=(*frequency, *_of_spectra(gap, rng)),
        drift=drift(
            gap.residuals, of, order, gap.observables, rng, configurations=gap.record.configurations
        ),
    )


def _of_pulses(
    stages: Sequence[Stage], rng: np.random.Generator
) -> tuple[tuple[TimeWindow, ...], tuple[FrequencyBand, ...]]:
    stage = next((stage for stage in stages if isinstance(stage, ContactObservables)), None)
    if stage is None:
        return (), ()
    pulses = pulse_residuals(stage)
    runs = np.isfinite(pulses.measured).all(axis=1) & np.isfinite(pulses.simulated).all(axis=1)
    of = stage.record.configuration_of[runs]
    windows = time_windows(
        pulses.time_s, pulses.measured[runs], pulses.simulated[runs], of, "force", rng
    )
    spectra = (pulses.spectrum_n_s(force[runs]) for force in (pulses.measured, pulses.simulated))
    lines, level = amplitude_residual_db(pulses.frequency_hz, *spectra)
    return windows, frequency_bands(lines, level, of, "force", rng) if lines.size else ()


def _of_spectra(gap: GapTable, rng: np.random.Generator) -> tuple[FrequencyBand, ...]:
    """Bands of the shock response spectra, by channel."""
    bands: list[FrequencyBand] = []
    lines: dict[str, dict[int, float]] = {}
    for column, item in enumerate(gap.observables):
        if item.unit == "dB" and item.frequency_hz is not None:
            lines.setdefault(item.channel, {})[column] = item.frequency_hz
    for channel, frequency_hz in lines.items():
        levels = gap.residuals[:, list(frequency_hz)]
        runs = np.isfinite(levels).all(axis=1)
        of = gap.record.configuration_of[runs]
        bands += frequency_bands(np.array([*frequency_hz.values()]), levels[runs], of, channel, rng)
    return tuple(bands)


__all__ = ["Options", "diagnose"]

#: Called with (done, total, what).
Progress = Callable[[int, int, str], None]
#: Called with the gap, the stages and the choices of fitted effects whose predictions are averaged,
#: with their weights: what the page draws.
Draw = Callable[[GapTable, Sequence[Stage], Sequence[tuple[Sequence[Effect], float]]], Pictures]
#: What the parts of a diagnosis cost, in per cent of all: of four campaigns with 5 to 48 shots, the
#: effects took 55 to 70 per cent, what is held out 18 to 24, and the sets
#: that a page shows 5 to 23.
_COSTS = {
    "reading": 5.0,
    "effects": 59.0,
    "shares": 3.0,
    "held out": 22.0,
    "where": 1.0,
    "next experiment": 1.0,
    "sets of effects": 9.0,
}
#: Names the random numbers of what is computed for the page.
_WHAT_IF = 1
#: Held out, effects that take less of the gap than this do not predict what they have not seen.
_PREDICTS = 0.3


def diagnose(
    record: CampaignRecord,
    *,
    options: Options | None = None,
    progress: Progress | None = None,
    draw: Draw | None = None,
) -> Verdict:
    """All of a diagnosis, in the order of the report.

    Parameters:
        record: The campaign.
        options: Tolerances, effects and parts of the diagnosis; by default `Options()`.
        progress: Receives the steps done, their number and what is being done.
        draw: Draws the pictures; by default there are none.

    Raises:
        ValueError: Where the campaign has nothing to compare.
        ImplausibleRecordError: Where a channel or a unit is mislabelled.
    """
    # The matrices are many and small: threads would wait for each other, and take twice the time.
    with one_thread():
        return _verdict(record, options or Options(), progress or (lambda *_: None), draw)


def _verdict(
    record: CampaignRecord, options: Options, progress: Progress, draw: Draw | None
) -> Verdict:
    started = time.perf_counter()
    rng = np.random.default_rng(options.seed)
    phases = Phases(progress, _COSTS)
    phases.begin("reading")
    stages, notes = stages_of(record, options)
    notes += tuple(finding.message for finding in check(record, stages))
    gap = GapTable.of(record, stages, options.tolerance_scale)
    phases.begin("effects")
    kinds = _effect_kinds(options, stages)
    posterior = HypothesisPosterior.of(gap, stages, kinds, phases.of("effects"))
    phases.begin("shares")
    shares = gap_shares(posterior.library, posterior.weights, posterior.floor, rng)
    scales = posterior.metric.scales(posterior.gap)
    tolerances = {name: gap.tolerance[gap.columns(name)] for name in gap.stages}
    fit = partial(fit_fold, posterior.library)
    held = measure_reduction(
        stages, fit, rng, scales, options.rate_pulses, tolerances, phases.of("held out")
    )
    entries = tuple(entry for entry, _ in held)
    by_configuration = held[0][1] if held else None
    predictions = (
        None if by_configuration is None else UnseenPredictions(posterior, by_configuration)
    )
    conclusion = conclude(
        posterior, shares, by_configuration, options.unknown_map, stages, predictions
    )
    phases.begin("where")
    where = localise_gap(gap, stages, rng) if options.where else Where()
    phases.begin("next experiment")
    runs = next_runs(posterior, stages, conclusion.causes, rng) if options.plan else ()
    if options.explore:
        phases.begin("sets of effects")
    # The last to fit sets and with random numbers of its own: the report does not depend on it.
    explored = (
        what_if(
            posterior,
            conclusion,
            by_configuration,
            predictions,
            np.random.default_rng([options.seed, _WHAT_IF]),
        )
        if options.explore
        else None
    )
    progress(WHOLE, WHOLE, "done")
    assumed = _assumptions(gap, options, conclusion, entries)
    return Verdict(
        campaign=record.name,
        simulator=" | ".join(stage.simulator for stage in stages),
        gap=replace(posterior.metric.size(gap), families=family_gaps(gap)),
        where=where,
        causes=conclusion.causes,
        shrinkage=entries if options.shrink else (),
        effects=conclusion.effects,
        unexplained=conclusion.unexplained,
        sets=conclusion.established.sets,
        path=conclusion.established.path,
        next_runs=runs,
        assumptions=(
            *record.assumptions,
            *notes,
            *stage_notes(stages),
            *known_fact_sentences(posterior),
            *assumed,
        ),
        seconds=time.perf_counter() - started,
        fits={name: common_effects(fit) for name, fit in conclusion.fits.items()},
        averaged=conclusion.established.averaged,
        unknown_figures=conclusion.unknown_figures,
        set_scores=posterior.set_scores(),
        pictures=draw(gap, stages, _drawn_choices(posterior, conclusion))
        if draw is not None
        else Pictures(),
        what_if=explored,
        error_map=error_map(gap, stages) if options.explore else None,
    )


def _drawn_choices(
    posterior: HypothesisPosterior, conclusion: Conclusion
) -> list[tuple[Sequence[Effect], float]]:
    """The effects that the established sets stand for, as they were fitted, with weights of sum
    one; the likeliest effects where no set is established."""
    choices = conclusion.established.drawn or ((posterior.best, 1.0),)
    return [(fitted_effects(fit), weight) for fit, weight in choices]


def _effect_kinds(options: Options, stages: Sequence[Stage]) -> list[type[Effect]]:
    """The effects that are looked for. Raises `LookupError` for one that there is not, and
    `ValueError` where the campaign can show none of them."""
    table = catalogue()
    for name in (*(options.catalogue or ()), *options.without):
        if name not in table:
            raise LookupError(f"no effect {name!r}; there are: {', '.join(table)}")
    detectable = {identity for stage in stages for identity in stage.shows}
    for name in options.catalogue or ():
        if name not in detectable:
            raise ValueError(
                f"{name} cannot show in this campaign; these can: {', '.join(sorted(detectable))}"
            )
    return [
        table[name]
        for name in table
        if name in (options.catalogue or table) and name not in options.without
    ]


def _assumptions(
    gap: GapTable, options: Options, conclusion: Conclusion, entries: Sequence[Shrinkage]
) -> Iterator[str]:
    """Priors, an assumed floor, parameters outside of their likely range, and effects that predict
    little."""
    yield (
        "priors: every effect acts with the same probability, such that none "
        "acts with probability 0.2"
    )
    if options.unknown_map.source:
        yield (
            f"the probabilities of unknown and of the first entry were learned on "
            f"{options.unknown_map.source}"
        )
    if gap.noise.assumed:
        yield (
            "floor assumed: nothing was repeated, the scatter of one run is the sensors' data "
            "sheets', and the probabilities are not calibrated"
        )
    measured = {(fact.effect, fact.parameter) for fact in gap.record.known_facts}
    for row in conclusion.effects:
        for item in row.parameters if row.named else ():
            exceeded = exceeded_limit(row.effect, item.parameter, item.value)
            if exceeded is not None and (row.effect, item.parameter) not in measured:
                where = "beyond" if exceeded.is_beyond else "at the end of"
                yield (
                    f"{row.effect}: {item.name} = "
                    f"{f'{item.value:.3g} {item.unit}'.rstrip()} lies {where} its range "
                    f"({exceeded.limit:g}); this is a miss of the law and not a value of the part"
                )
    first = conclusion.causes[0].effects[0]
    for entry in entries if first not in (NONE, UNKNOWN) else ():
        if (
            entry.held_out_by == "configuration"
            and entry.fraction is not None
            and entry.fraction < _PREDICTS
        ):
            yield (
                f"{first} is the likeliest cause of the catalogue, but what is chosen on other "
                f"configurations takes only {entry.fraction:.0%} of the gap where it was not "
                "fitted: a cause outside of the catalogue is possible"
            )
