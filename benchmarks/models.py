"""`python -m benchmarks.models [SEED…]`: every model on 180 x 10 campaigns, into docs/measurements/model-figures.md.

A seed is a campaign of its own, simulated, ingested, frozen and trained on by the commands that a user types. On the
first, all models are trained and the clock runs; on the others those that the promises are about. Takes half an hour
on two cores. $PYROSHOCK_BENCH_FOLDER keeps campaigns and registries, and a repeat goes on from there.
"""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pyroshock.training.floors import floor_metrics
from pyroshock.training.model_storage import place_beside
from pyroshock.training.registry.registry import Registry
from pyroshock.training.thesis import thesis_figures

from .harness import PYROSHOCK, ROOT, work_folder

DOCUMENT = ROOT / "docs" / "measurements" / "model-figures.md"
SEEDS = ("11", "12", "13")
#: What the promises are about, and what they are held against.
PROMISED = ("coregional-gp", "hybrid", "single-pass", "gp", "hann")
#: Further draws of configurations to hold out: how many lie in a band depends on which 36 they are.
DRAWS = ("1", "2")
SPLITS = ("repetitions", "configurations", "treatments")
#: Tables 4.6 to 4.9 and 5.3: what the thesis reached on its own campaign.
NRMSE, TIME, IMPULSE = 0.048, 0.043, 0.031
OF_FLOOR, OF_HANN, LIMIT_S = 1.15, 1 / 6, 15 * 60
COVERAGE = (0.87, 0.93)

Row = dict[str, Any]


@dataclass(frozen=True)
class Campaign:
    """One seed's campaign: JSON rows of its models, floors by split and scope, seconds of the training."""

    seed: str
    rows: list[Row]
    floors: dict[str, dict[str, dict[str, float]]]
    seconds: float

    def of(self, model: str, split: str, seed: int = 0) -> Row:
        return next(row for row in self.rows if (row["model"], row["split"], row["seed"]) == (model, split, seed))

    def covered(self, model: str, split: str, what: str) -> list[float]:
        """The share within the 90 % band, for each draw of the split that was trained on."""
        rows = [row for row in self.rows if (row["model"], row["split"]) == (model, split)]
        return [float(row["coverage90"][what]) for row in rows if row.get("coverage90")]

    def metric(self, model: str, split: str, metric: str) -> float:
        return float(self.of(model, split)["metrics"][metric])


def pyroshock(folder: Path, *words: str) -> None:
    """A command as a user types it, told; its notes go to this terminal."""
    sys.stderr.write(f"$ pyroshock {' '.join(words)}\n")
    command = [sys.executable, *PYROSHOCK, *words]
    subprocess.run(command, cwd=folder, check=True, stdout=subprocess.DEVNULL)


def measured(seed: str, models: str, folder: Path) -> Campaign:
    """The campaign of a seed, from its plan to its registry; what is in the folder is not made again."""
    folder.mkdir(parents=True, exist_ok=True)
    db, frozen, clock = ("--db", "sqlite:///lab.db"), folder / "dataset.json", folder / "seconds.json"
    if not frozen.exists():
        pyroshock(folder, "plan", "factorial", "hammer", "--kind", "hammer", "--seed", seed, *db)
        pyroshock(folder, "simulate", "hammer", "--out", "hammer", "--seed", seed, *db)
        pyroshock(folder, "ingest", "hammer", *db)
        pyroshock(folder, "dataset", "build", "hammer", "--from", "hammer", "--json", str(frozen), *db)
    begin = time.perf_counter()
    train = ("train", "hammer", "--split", ",".join(SPLITS[:2]), "--json", str(folder / "rows.json"), *db)
    pyroshock(folder, *train, "--models", models)
    if not clock.exists():  # a repeat finds everything trained
        clock.write_text(json.dumps(time.perf_counter() - begin))
    promised = ("train", "hammer", "--models", ",".join(PROMISED), *db)
    pyroshock(folder, *promised, "--split", SPLITS[2])
    for draw in DRAWS:
        pyroshock(folder, *promised, "--split", "configurations", "--seed", draw)
    pyroshock(folder, "models", "--dataset", "hammer", "--json", str(folder / "rows.json"), *db)
    registry = Registry(place_beside(f"sqlite:///{folder / 'lab.db'}", {}))
    floors = registry.floors(json.loads(frozen.read_text())["hash"], 0)
    return Campaign(
        seed,
        json.loads((folder / "rows.json").read_text()),
        {
            split: {scope: _means(text, scope) for scope in ("configuration", "treatment")}
            for split, text in floors.items()
        },
        json.loads(clock.read_text()),
    )


def _means(text: str, scope: str) -> dict[str, float]:
    return {name: estimate.mean for name, estimate in floor_metrics(text, scope).items()}


@dataclass(frozen=True)
class Check:
    """A promise: what was asked, what was found (over campaigns), whether it holds in each."""

    asked: str
    found: Sequence[float]
    holds: bool

    def row(self) -> str:
        found = ", ".join(f"{value:.4g}" for value in self.found)
        return f"| {self.asked} | {found} | {'holds' if self.holds else '**lost**'} |"


def checks(campaigns: Sequence[Campaign]) -> list[Check]:
    found = []
    for model in ("coregional-gp", "hybrid"):
        for metric, limit in (("force_nrmse", NRMSE), ("contact_time_error", TIME), ("impulse_error", IMPULSE)):
            values = [each.metric(model, "repetitions", metric) for each in campaigns]
            found.append(Check(f"{model}: {metric} at most {limit}", values, max(values) <= limit))
            values = [
                each.metric(model, "repetitions", metric) / each.floors["repetitions"]["treatment"][metric]
                for each in campaigns
            ]
            found.append(
                Check(f"{model}: {metric} over its floor, at most {OF_FLOOR}", values, max(values) <= OF_FLOOR)
            )
        hann = [
            each.metric(model, "repetitions", "cost") / each.metric("hann", "repetitions", "cost") for each in campaigns
        ]
        found.append(Check(f"{model}: cost over the von Hann pulse's, at most 1/6", hann, max(hann) <= OF_HANN))
        for what in ("force_covered", "time_covered"):
            shares = [statistics.fmean(each.covered(model, "configurations", what)) for each in campaigns]
            asked = f"{model}: {what} by the 90 % band, mean of {len(DRAWS) + 1} draws of configurations, .87 to .93"
            found.append(Check(asked, shares, COVERAGE[0] <= min(shares) and max(shares) <= COVERAGE[1]))
    seconds = campaigns[0].seconds
    found.append(Check(f"all models, two splits: seconds, at most {LIMIT_S}", [seconds], seconds <= LIMIT_S))
    return found


def table(campaign: Campaign) -> list[str]:
    """Every model of a campaign, ranked by force NRMSE of the thesis's split, the floors among them."""
    models = list(dict.fromkeys(row["model"] for row in campaign.rows))
    lines = [(campaign.metric(name, "repetitions", "force_nrmse"), _line(campaign, name)) for name in models]
    for scope in ("configuration", "treatment"):
        of_split = campaign.floors
        cells = [f"{of_split[split][scope]['force_nrmse']:.4f}" for split in SPLITS[:2]] + ["—"]
        cells += [f"{of_split[split][scope]['contact_time_error']:.4f}" for split in SPLITS[:2]] + ["—"]
        cells += [f"{of_split[split][scope]['impulse_error']:.4f}" for split in SPLITS[:2]] + ["—"]
        cells += [f"{of_split['repetitions'][scope]['cost']:.0f}", "—", "—"]
        lines.append(
            (of_split["repetitions"][scope]["force_nrmse"], f"| *floor by {scope}* | " + " | ".join(cells) + " |")
        )
    head = (
        "| model | NRMSE rep. | conf. | thesis | time rep. | conf. | thesis | impulse rep. | conf. | thesis "
        "| cost rep. | cover conf. | s |"
    )
    return [head, "| --- " * (head.count("|") - 1) + "|", *(line for _, line in sorted(lines))]


def _line(campaign: Campaign, model: str) -> str:
    thesis = thesis_figures(model)
    cells = []
    for metric in ("force_nrmse", "contact_time_error", "impulse_error"):
        cells += [f"{campaign.metric(model, split, metric):.4f}" for split in SPLITS[:2]]
        cells.append(f"{thesis[metric].value:.4g}" if metric in thesis else "—")
    cells.append(f"{campaign.metric(model, 'repetitions', 'cost'):.0f}")
    coverage = campaign.of(model, "configurations").get("coverage90")
    cells.append(f"{coverage['force_covered']:.2f}" if coverage else "—")
    cells.append(f"{sum(row['seconds'] for row in campaign.rows if row['model'] == model):.1f}")
    return f"| `{model}` | " + " | ".join(cells) + " |"


def spread_table(campaigns: Sequence[Campaign]) -> list[str]:
    """The promised models over campaigns and splits: mean of the campaigns, least and greatest."""
    head = "| model | split | NRMSE | time | impulse | cost | force in the 90 % band | time in it |"
    lines = [head, "| --- " * (head.count("|") - 1) + "|"]
    for model in PROMISED:
        for split in SPLITS:
            rows = [campaign.of(model, split) for campaign in campaigns]
            metrics = ("force_nrmse", "contact_time_error", "impulse_error", "cost")
            cells = [_range([row["metrics"][metric] for row in rows]) for metric in metrics]
            for what in ("force_covered", "time_covered"):
                shares = [share for campaign in campaigns for share in campaign.covered(model, split, what)]
                cells += [_range(shares) if shares else "—"]
            lines.append(f"| `{model}` | {split} | " + " | ".join(cells) + " |")
    return lines


def _range(values: Sequence[float]) -> str:
    digits = ".0f" if max(values) > 1 else ".4f"
    mean = sum(values) / len(values)
    return f"{mean:{digits}} ({min(values):{digits}} to {max(values):{digits}})"


def document(campaigns: Sequence[Campaign], found: Sequence[Check]) -> str:
    seeds = ", ".join(campaign.seed for campaign in campaigns)
    return "\n".join(
        [
            "# Figures of the models",
            "",
            f"Written by `python -m benchmarks.models`: virtual 180 x 10 hammer campaigns of seeds {seeds}.",
            "Settings were chosen on another campaign; models.md tells what these prompted.",
            "The columns: [metrics.md](metrics.md). The models:",
            "[models.md](models.md).",
            "",
            f"## All models, campaign {campaigns[0].seed}",
            "",
            "Ranked by force NRMSE of the thesis's split (rep.), which flatters; beside it by configuration (conf.).",
            "",
            *table(campaigns[0]),
            "",
            f"## Over {len(campaigns)} campaigns",
            "",
            *spread_table(campaigns),
            "",
            "## Promised",
            "",
            f"| asked | campaigns {seeds} | |",
            "| --- | --- | --- |",
            *(check.row() for check in found),
            "",
        ]
    )


def main(seeds: Sequence[str]) -> int:
    with work_folder() as folder:
        campaigns = [
            measured(seed, "all" if number == 0 else ",".join(PROMISED), folder / f"models-{seed}")
            for number, seed in enumerate(seeds or SEEDS)
        ]
    found = checks(campaigns)
    DOCUMENT.write_text(document(campaigns, found), encoding="utf-8")
    sys.stdout.write("\n".join(check.row() for check in found) + f"\nwritten: {DOCUMENT}\n")
    return 0 if all(check.holds for check in found) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
