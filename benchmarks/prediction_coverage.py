"""Do the bands of promoted models hold? `python -m benchmarks.prediction_coverage [--seeds 7,8,9]
[--draws 200]`.

Benches whose laws of contact are not the twin's (`law_campaigns`) are hit at random configurations.
Models learn from these, the gate of `promote` judges each against a model in use, and the bands of
every model are then scored on fresh configurations, which neither model, calibration nor gate has
seen. With --law the contact law that was updated by the same pulses is a second reference. The
second figure is the null: of two equal models, one in use and one a candidate, the share that the
gate promotes.

Exit code 1 where the promoted models' mean coverage of a quantity is outside of 85 to 97 %, or
where more than 6 % of the equal models are promoted.
"""

from __future__ import annotations

import argparse
import sys
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from pyroshock.dataset.table import PulseTable
from pyroshock.schema.impacts import BEFORE_CONTACT
from pyroshock.training.evaluation.gate import NARROWEST, UPDATED_LAW, WIDEST, judge
from pyroshock.training.evaluation.unseen_configurations import (
    unseen_draws,
    unseen_scores,
    updated_law_draws,
)
from pyroshock.training.evaluation.unseen_scores import QUANTITIES, UnseenScores
from pyroshock.training.models.base import ContactModel
from pyroshock.training.models.catalogue import BuildOptions, entry_of

from .harness import table, table_row
from .law_campaigns import LawBench, drawn_pulses
from .shared_records import pulse_table

#: Which models are candidates: one of each kind that trains in seconds.
MODELS = ("linear", "ensemble", "hybrid")
BENCHES = (("gun", "first"), ("hammer", "development"), ("gun", "sealed"), ("hammer", "first"))
#: Of these, each seed takes so many, one after the other.
BENCHES_OF_SEED = 2
CONFIGURATIONS, REPETITIONS, FRESH = 28, 2, 40
#: A model may also be in use already: this one, of an earlier campaign of so many configurations.
EARLIER_MODEL, EARLIER_CONFIGURATIONS = "linear", 12
#: Of the null: models that are quick to refit.
NULL_MODELS = ("linear", "tree")
NULL_CONFIGURATIONS, MOST_BY_CHANCE = 20, 0.06


@dataclass(frozen=True)
class CoverageRow:
    """A candidate on one bench: what the gate said beside each reference, and shares inside the 90
    % bands on fresh configurations."""

    seed: int
    bench: str
    model: str
    verdicts: tuple[str, ...]
    coverage: tuple[float, ...]

    @property
    def promoted(self) -> bool:
        return "promoted" in self.verdicts


def coverage_rows(
    seeds: Sequence[int],
    models: Sequence[str] = MODELS,
    benches: int = BENCHES_OF_SEED,
    configurations: int = CONFIGURATIONS,
    fresh: int = FRESH,
    law: bool = False,
    tell: Callable[[str], None] = lambda _: None,
) -> Iterator[CoverageRow]:
    """Every model on every bench of every seed; with `law`, judged beside the contact law, too."""
    for seed in seeds:
        for number in range(benches):
            kind, laws = BENCHES[(seed * benches + number) % len(BENCHES)]
            rng = np.random.default_rng([seed, number])
            bench = LawBench.drawn(kind, laws, rng)
            learned = drawn_pulses(bench, configurations, REPETITIONS, rng, campaign="learned")
            earlier = drawn_pulses(
                bench, EARLIER_CONFIGURATIONS, REPETITIONS, rng, campaign="earlier"
            )
            names = {*learned.configuration.tolist(), *earlier.configuration.tolist()}
            unseen = drawn_pulses(bench, fresh, 1, rng, campaign="fresh", without=names)
            for row in _rows_of_bench(seed, bench, models, (learned, earlier, unseen), rng, law):
                shares = ", ".join(f"{share:.2f}" for share in row.coverage)
                tell(f"{row.seed} {row.bench} {row.model}: {' | '.join(row.verdicts)}: {shares}")
                yield row


def _rows_of_bench(
    seed: int,
    bench: LawBench,
    models: Sequence[str],
    campaigns: tuple[PulseTable, PulseTable, PulseTable],
    rng: np.random.Generator,
    law: bool,
) -> Iterator[CoverageRow]:
    learned, earlier, unseen = campaigns
    predictions = {
        name: unseen_draws(_fitted(name, learned, rng), learned, BEFORE_CONTACT) for name in models
    }
    in_use = unseen_draws(_fitted(EARLIER_MODEL, earlier, rng), earlier, BEFORE_CONTACT)
    references = {f"{EARLIER_MODEL}@0": in_use}
    if law:
        references[UPDATED_LAW] = updated_law_draws(learned, learned, BEFORE_CONTACT)
    judged = unseen_scores(learned, {**predictions, **references}, rng)
    # The fresh configurations are none that was learned from: every model answers as it is in use.
    answers = unseen_scores(unseen, predictions, rng)
    for place, name in enumerate(models):
        pairs = [_pair(judged, place, len(models) + number) for number in range(len(references))]
        yield CoverageRow(
            seed,
            str(bench),
            name,
            tuple(judge(pair, pair.p_value(rng)).verdict for pair in pairs),
            tuple(answers.inside[place].mean(axis=0).tolist()),
        )


def _pair(scores: UnseenScores, candidate: int, reference: int) -> UnseenScores:
    """Two of the predictions."""
    return UnseenScores(
        (scores.names[candidate], scores.names[reference]),
        (scores.crps[candidate], scores.crps[reference]),
        (scores.inside[candidate], scores.inside[reference]),
        scores.configuration,
        scores.folds,
    )


def _fitted(name: str, pulses: PulseTable, rng: np.random.Generator) -> ContactModel:
    return entry_of(name).make(BuildOptions()).fit(pulses, rng)


def promotions_by_chance(
    draws: int,
    seed: int,
    models: Sequence[str] = NULL_MODELS,
    configurations: int = NULL_CONFIGURATIONS,
) -> list[str]:
    """Verdicts on candidates that are equal to what is in use: both learned from the same
    configurations, each from its own repetitions, of a law in closed form. The bands need not hold:
    only what the comparison lets pass is counted."""
    verdicts = []
    for number in range(draws):
        rng = np.random.default_rng([seed, 1_000 + number])
        pulses = pulse_table(rng, repetitions=4)
        names = rng.choice(np.unique(pulses.configuration), configurations, replace=False)
        pulses = pulses.take(np.isin(pulses.configuration, names))
        name = models[number % len(models)]
        halves = [pulses.take(pulses.repetition <= 2), pulses.take(pulses.repetition > 2)]
        predictions = {
            f"{name}@{2 - place}": unseen_draws(_fitted(name, half, rng), half, BEFORE_CONTACT)
            for place, half in enumerate(halves)
        }
        scores = unseen_scores(pulses, predictions, rng)
        verdicts.append(
            "better" if scores.first_is_better and scores.p_value(rng) < 0.05 else "not better"
        )
    return verdicts


def report(seeds: Sequence[int], draws: int, law: bool = False) -> int:
    """Print both tables; 1 where a promise is lost."""
    begin = time.monotonic()
    rows = list(
        coverage_rows(seeds, law=law, tell=lambda line: print(line, file=sys.stderr, flush=True))
    )
    head = (
        "group",
        "candidates",
        *(f"{quantity}, mean (least to largest)" for quantity in QUANTITIES),
    )
    promoted = [row for row in rows if row.promoted]
    groups = {"promoted": promoted, "all candidates": rows}
    groups |= {
        f"promoted, {kind}": [row for row in promoted if row.bench.startswith(kind)]
        for kind in ("gun", "hammer")
    }
    groups |= {
        f"promoted, {name}": [row for row in promoted if row.model == name] for name in MODELS
    }
    lines = [
        table_row(name, str(len(group)), *_spreads(group))
        for name, group in groups.items()
        if group
    ]
    print(table(head, lines))
    for place, reference in enumerate((f"{EARLIER_MODEL}@0", *([UPDATED_LAW] if law else []))):
        counts = Counter(row.verdicts[place] for row in rows)
        print(
            f"\nbeside {reference}: "
            f"{', '.join(f'{verdict} {count}' for verdict, count in counts.items())}"
        )
    verdicts = promotions_by_chance(draws, seeds[0])
    by_chance = verdicts.count("better") / max(draws, 1)
    print(
        f"equal models promoted: {verdicts.count('better')} of {draws} "
        f"({by_chance:.1%}, at most {MOST_BY_CHANCE:.0%})"
    )
    print(f"{time.monotonic() - begin:.0f} s")
    means = np.mean([row.coverage for row in promoted], axis=0) if promoted else np.full(3, np.nan)
    held = bool(np.all((means >= NARROWEST) & (means <= WIDEST)))
    return 0 if held and by_chance <= MOST_BY_CHANCE else 1


def _spreads(rows: Sequence[CoverageRow]) -> list[str]:
    shares = np.array([row.coverage for row in rows])
    return [
        f"{column.mean():.3f} ({column.min():.2f} to {column.max():.2f})" for column in shares.T
    ]


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument(
        "--seeds", default="7,8,9", help="comma list; each draws benches of its own [7,8,9]"
    )
    parser.add_argument("--draws", type=int, default=200, help="pairs of equal models [200]")
    parser.add_argument(
        "--law", action="store_true", help="judge beside the updated contact law, too (an hour)"
    )
    options = parser.parse_args(arguments)
    warnings.filterwarnings("ignore")
    return report([int(seed) for seed in options.seeds.split(",")], options.draws, options.law)


if __name__ == "__main__":
    sys.exit(main())
