"""`python -m benchmarks.models [SEED…]`: every model on 180 x 10 campaigns, into
docs/measurements/model-figures.md.

A seed is a campaign of its own, simulated, ingested, frozen and trained on by the commands that a
user types. On the first, all models are trained and the clock runs; on the others those that the
promises are about. Takes half an hour on two cores. $PYROSHOCK_BENCH_FOLDER keeps campaigns and
registries, and a repeat goes on from there.
"""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

from pyroshock.app.operations.train.tables import thesis_figures
from pyroshock.training.evaluation.floor import floor_metrics
from pyroshock.training.registry.model_storage import storage_for
from pyroshock.training.registry.registry import Registry

from .harness import PYROSHOCK, ROOT, table, table_row, work_folder

DOCUMENT = ROOT / "docs" / "measurements" / "model-figures.md"
SEEDS = ("11", "12", "13")
#: What the promises are about, and what they are compared with.
PROMISED = ("coregional-gp", "hybrid", "single-pass", "gp", "hann")
#: Further draws of configurations to hold out: how many lie in a band depends on which 36 they are.
DRAWS = ("1", "2")
SPLITS = ("repetitions", "configurations", "treatments")
#: Tables 4.6 to 4.9 and 5.3: what the thesis reached on its own campaign.
LIMITS = {"force_nrmse": 0.048, "contact_time_error": 0.043, "impulse_error": 0.031}
OF_FLOOR, OF_HANN, LIMIT_S, COVERAGE = 1.15, 1 / 6, 15 * 60, (0.87, 0.93)

Row = dict[str, Any]


@dataclass(frozen=True)
class Campaign:
    """One seed's campaign: JSON rows of its models, floors by split and scope, seconds of the
    training."""

    seed: str
    rows: list[Row]
    floors: dict[str, dict[str, dict[str, float]]]
    seconds: float

    def row(self, model: str, split: str) -> Row:
        return next(
            row
            for row in self.rows
            if (row["model"], row["split"], row["seed"]) == (model, split, 0)
        )

    def metric(self, model: str, split: str, metric: str) -> float:
        return float(self.row(model, split)["metrics"][metric])

    def covered(self, model: str, split: str, what: str) -> list[float]:
        """The share within the 90 % band, for each draw of the split that was trained on."""
        rows = [row for row in self.rows if (row["model"], row["split"]) == (model, split)]
        return [float(row["coverage90"][what]) for row in rows if row.get("coverage90")]


def measured(seed: str, models: str, folder: Path) -> Campaign:
    """The campaign of a seed, from its plan to its registry; what is in the folder is not made
    again."""
    folder.mkdir(parents=True, exist_ok=True)
    frozen, clock, rows = folder / "dataset.json", folder / "seconds.json", folder / "rows.json"

    def pyroshock(*words: str) -> None:
        sys.stderr.write(f"$ pyroshock {' '.join(words)}\n")
        command = [sys.executable, *PYROSHOCK, *words, "--db", "sqlite:///lab.db"]
        subprocess.run(command, cwd=folder, check=True, stdout=subprocess.DEVNULL)

    if not frozen.exists():
        pyroshock("plan", "factorial", "hammer", "--kind", "hammer", "--seed", seed)
        pyroshock("simulate", "hammer", "--out", "hammer", "--seed", seed)
        pyroshock("ingest", "hammer")
        pyroshock("dataset", "build", "hammer", "--from", "hammer", "--json", str(frozen))
    begin = time.perf_counter()
    pyroshock(
        "train", "hammer", "--split", ",".join(SPLITS[:2]), "--json", str(rows), "--models", models
    )
    if not clock.exists():  # a repeat finds everything trained
        clock.write_text(json.dumps(time.perf_counter() - begin))
    promised = ("train", "hammer", "--models", ",".join(PROMISED))
    pyroshock(*promised, "--split", SPLITS[2])
    for draw in DRAWS:
        pyroshock(*promised, "--split", "configurations", "--seed", draw)
    pyroshock("models", "--dataset", "hammer", "--json", str(rows))
    registry = Registry(storage_for(f"sqlite:///{folder / 'lab.db'}", {}))
    texts = registry.floors(json.loads(frozen.read_text())["hash"], 0)
    floors: dict[str, Any] = {split: {} for split in texts}
    for split, scope in product(texts, ("configuration", "treatment")):
        floors[split][scope] = {
            name: mean.mean for name, mean in floor_metrics(texts[split], scope).items()
        }
    return Campaign(seed, json.loads(rows.read_text()), floors, json.loads(clock.read_text()))


@dataclass(frozen=True)
class Check:
    """A promise, its values over campaigns, and whether it holds in each."""

    promise: str
    values: Sequence[float]
    holds: bool

    def row(self) -> str:
        values = ", ".join(f"{value:.4g}" for value in self.values)
        return table_row(self.promise, values, "holds" if self.holds else "**lost**")


def checks(campaigns: Sequence[Campaign]) -> list[Check]:
    results = []

    def at_most(promise: str, values: Sequence[float], limit: float) -> None:
        results.append(Check(promise, values, max(values) <= limit))

    for model in PROMISED[:2]:
        for metric, limit in LIMITS.items():
            values = [campaign.metric(model, "repetitions", metric) for campaign in campaigns]
            at_most(f"{model}: {metric} at most {limit}", values, limit)
            floors = [campaign.floors["repetitions"]["treatment"][metric] for campaign in campaigns]
            shares = [value / floor for value, floor in zip(values, floors, strict=True)]
            at_most(f"{model}: {metric} over its floor, at most {OF_FLOOR}", shares, OF_FLOOR)
        costs = [
            c.metric(model, "repetitions", "cost") / c.metric("hann", "repetitions", "cost")
            for c in campaigns
        ]
        at_most(f"{model}: cost over the von Hann pulse's, at most 1/6", costs, OF_HANN)
        for what in ("force_covered", "time_covered"):
            shares = [
                statistics.fmean(campaign.covered(model, "configurations", what))
                for campaign in campaigns
            ]
            promise = (
                f"{model}: {what} by the 90 % band, mean of {len(DRAWS) + 1} "
                f"draws of configurations, .87 to .93"
            )
            results.append(
                Check(promise, shares, COVERAGE[0] <= min(shares) and max(shares) <= COVERAGE[1])
            )
    at_most(f"all models, two splits: seconds, at most {LIMIT_S}", [campaigns[0].seconds], LIMIT_S)
    return results


def model_table(campaign: Campaign) -> str:
    """Every model of a campaign, ranked by force NRMSE of the thesis's split, the floors among
    them."""
    lines = []
    for scope in ("configuration", "treatment"):
        floors = [campaign.floors[split][scope] for split in SPLITS[:2]]
        cells = [
            cell
            for metric in LIMITS
            for cell in (*(f"{floor[metric]:.4f}" for floor in floors), "—")
        ]
        row = table_row(f"*floor by {scope}*", *cells, f"{floors[0]['cost']:.0f}", "—", "—")
        lines.append((floors[0]["force_nrmse"], row))
    for model in dict.fromkeys(row["model"] for row in campaign.rows):
        thesis, cells = thesis_figures(model), []
        for metric in LIMITS:
            cells += [f"{campaign.metric(model, split, metric):.4f}" for split in SPLITS[:2]]
            cells.append(f"{thesis[metric].value:.4g}" if metric in thesis else "—")
        coverage = campaign.row(model, "configurations").get("coverage90")
        cells += [f"{campaign.metric(model, 'repetitions', 'cost'):.0f}"]
        cells += [f"{coverage['force_covered']:.2f}" if coverage else "—"]
        cells += [f"{sum(row['seconds'] for row in campaign.rows if row['model'] == model):.1f}"]
        lines.append(
            (campaign.metric(model, "repetitions", "force_nrmse"), table_row(f"`{model}`", *cells))
        )
    head = ("model", "NRMSE rep.", "conf.", "thesis", "time rep.", "conf.", "thesis",
    "impulse rep.", "conf.", "thesis",
            "cost rep.", "cover conf.", "s")  # fmt: skip
    return table(head, (line for _, line in sorted(lines)))


def spread_table(campaigns: Sequence[Campaign]) -> str:
    """The promised models over campaigns and splits: mean of the campaigns, least and greatest."""
    head = (
        "model",
        "split",
        "NRMSE",
        "time",
        "impulse",
        "cost",
        "force in the 90 % band",
        "time in it",
    )
    rows = []
    for model in PROMISED:
        for split in SPLITS:
            cells = [
                _range([c.metric(model, split, metric) for c in campaigns])
                for metric in (*LIMITS, "cost")
            ]
            for what in ("force_covered", "time_covered"):
                shares = [
                    share
                    for campaign in campaigns
                    for share in campaign.covered(model, split, what)
                ]
                cells += [_range(shares) if shares else "—"]
            rows.append(table_row(f"`{model}`", split, *cells))
    return table(head, rows)


def _range(values: Sequence[float]) -> str:
    digits = ".0f" if max(values) > 1 else ".4f"
    return f"{statistics.fmean(values):{digits}} ({min(values):{digits}} to {max(values):{digits}})"


def document(campaigns: Sequence[Campaign], results: Sequence[Check]) -> str:
    seeds = ", ".join(campaign.seed for campaign in campaigns)
    return f"""# Figures of the models

`python -m benchmarks.models` wrote this page from virtual 180 x 10 hammer campaigns of seeds \
{seeds}.
The settings of the models were chosen on another campaign.
[metrics.md](../reference/metrics.md) explains the columns, and \
[models.md](../explanation/models.md) the models.

## All models, campaign {campaigns[0].seed}

The table ranks the models by force NRMSE of the thesis's split (rep.), which flatters.
The split by configuration (conf.) stands beside it.

{model_table(campaigns[0])}

## Over {len(campaigns)} campaigns

{spread_table(campaigns)}

## Promised

{table(("promise", f"campaigns {seeds}", ""), (check.row() for check in results))}
"""


def main(seeds: Sequence[str]) -> int:
    with work_folder() as folder:
        campaigns = [
            measured(seed, "all" if number == 0 else ",".join(PROMISED), folder / f"models-{seed}")
            for number, seed in enumerate(seeds or SEEDS)
        ]
    results = checks(campaigns)
    DOCUMENT.write_text(document(campaigns, results), encoding="utf-8")
    print(*(check.row() for check in results), f"\nwritten: {DOCUMENT}", sep="\n")
    return 0 if all(check.holds for check in results) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
