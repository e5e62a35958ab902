"""Learns what the diagnosis cannot derive, on development campaigns: the map of unknown, and how far shares are off.

    python -m benchmarks.diagnosis_maps [--jobs 2] [--fit-only]

Writes a row for each campaign to docs/blind-check/development/maps.jsonl, and prints the constants of
`diagnosis/unknown_probability.py`, and how often true shares lie in their intervals with those of
`diagnosis/inference/shares.py`. Families outside of the catalogue and laws are
those of the development split alone; seeds are listed here.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

ROWS = Path(__file__).parent.parent / "docs" / "blind-check" / "development" / "maps.jsonl"
#: First number of every seed; the second is the place of the campaign in the list.
SEED = 26_113
SPLIT = "development"
#: Campaigns by what is drawn: kind, tier, cause, how many.
PLAN = (
    *((kind, "strong", "unknown", 7) for kind in ("gun", "hammer", "plate")),
    *((kind, "strong", "catalogue", 6) for kind in ("gun", "hammer", "plate")),
    *((kind, "middle", "catalogue", 3) for kind in ("gun", "hammer")),
    *((kind, "strong", "two", 3) for kind in ("gun", "hammer")),
    *((kind, "realistic", "", 5) for kind in ("gun", "hammer")),
)
#: Standard deviations of the prior of the map's numbers, about those of `UnknownMap`'s first guess.
_PRIOR = np.array([2.0, 0.3, 4.0])


class Campaign(NamedTuple):
    """One to be drawn."""

    number: int
    kind: str
    tier: str
    cause: str


def campaigns() -> list[Campaign]:
    rows = [(kind, tier, cause) for kind, tier, cause, count in PLAN for _ in range(count)]
    return [Campaign(number, *row) for number, row in enumerate(rows)]


def diagnosed(campaign: Campaign) -> dict[str, Any]:
    """The row of one campaign: its truth, odds, fraction held out, and shares beside the true ones."""
    from pyroshock.diagnosis.blind.answering import diagnosed as answer
    from pyroshock.diagnosis.options import Options
    from pyroshock.virtualbench.withheld.draw import draw_case
    from pyroshock.virtualbench.withheld.many import draw_realistic
    from pyroshock.virtualbench.withheld.record import record_case

    rng = np.random.default_rng([SEED, campaign.number])
    if campaign.tier == "realistic":
        case = draw_realistic(campaign.kind, rng)
    else:
        case = draw_case(campaign.kind, campaign.tier, rng, cause=campaign.cause, split=SPLIT)
    with tempfile.TemporaryDirectory(prefix="pyroshock-maps-") as place:
        label = record_case(case, Path(place) / "campaign", int(rng.integers(2**31)))
        options = Options(where=False, plan=False, draw=False)
        row = answer(Path(place) / "campaign", options)
    verdict = row["verdict"]
    held = [entry["fraction"] for entry in verdict["shrinkage"] if entry["held_out_by"] == "configuration"]
    true = _true_shares(label.shapley)
    return {
        **campaign._asdict(),
        "truth": list(label.cause),
        "first": verdict["causes"][0],
        "beyond_noise": verdict["gap"]["beyond_noise"],
        "odds": row["odds"],
        "fraction": held[0] if held else None,
        "shares": [
            [item["effect"], item["share"], true.get(item["effect"], 0.0), *item["ci90"]] for item in verdict["effects"]
        ],
        "cpu_s": row["cpu_s"],
    }


def _true_shares(table: Any) -> dict[str, float]:
    """Of one stage's Shapley values, summing to one."""
    values: dict[str, float] = next(iter(table.values()), {}) if table else {}
    whole = sum(values.values())
    return {name: value / whole for name, value in values.items()} if whole > 0 else {}


def unknown_map(rows: Sequence[dict[str, Any]]) -> Floats:
    """Intercept, slope of the compressed odds, and slope of 1/2 less the fraction: the likeliest ones (Newton)."""
    from pyroshock.diagnosis.unknown_probability import UnknownMap

    start = UnknownMap()
    first = np.array([start.intercept, start.odds, start.fraction])
    used = [row for row in rows if row["beyond_noise"] and row["odds"] is not None and row["fraction"] is not None]
    x = np.array([[1.0, np.arcsinh(row["odds"] / 2), 0.5 - np.clip(row["fraction"], -0.5, 1.0)] for row in used])
    y = np.array([float(row["truth"] == ["unknown"]) for row in used])
    theta = first.copy()
    for _ in range(100):
        p = 1 / (1 + np.exp(-np.clip(x @ theta, -30, 30)))
        slope = x.T @ (y - p) - (theta - first) / _PRIOR**2
        curvature = (x.T * (p * (1 - p))) @ x + np.diag(1 / _PRIOR**2)
        theta = theta + np.clip(np.linalg.solve(curvature, slope), -1.0, 1.0)
    return theta


def share_coverage(rows: Sequence[dict[str, Any]]) -> tuple[int, int]:
    """On realistic benches: how many of the true shares lie in their 90 % intervals, and how many there are, of effects
    whose true or stated share is at least 0.05."""
    pairs = [pair for row in rows if row["tier"] == "realistic" for pair in row["shares"]]
    counted = [pair for pair in pairs if max(pair[1], pair[2]) >= 0.05]
    return sum(low <= true <= high for _, _, true, low, high in counted), len(counted)


def _rows(jobs: int) -> Iterator[dict[str, Any]]:
    done = {json.loads(line)["number"]: json.loads(line) for line in _lines()}
    yield from done.values()
    with ProcessPoolExecutor(jobs) as pool, ROWS.open("a", encoding="utf-8") as file:
        work = [pool.submit(diagnosed, campaign) for campaign in campaigns() if campaign.number not in done]
        for future in as_completed(work):
            row = future.result()
            file.write(json.dumps(row) + "\n")
            file.flush()
            print(row["number"], row["kind"], row["truth"], row["first"]["effects"], row["fraction"], flush=True)
            yield row


def _lines() -> list[str]:
    return ROWS.read_text(encoding="utf-8").splitlines() if ROWS.exists() else []


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--fit-only", action="store_true", help="from the rows that are there")
    asked = parser.parse_args()
    rows = [json.loads(line) for line in _lines()] if asked.fit_only else list(_rows(asked.jobs))
    intercept, odds, fraction = unknown_map(rows)
    print(f"UnknownMap(intercept={intercept:.3f}, odds={odds:.3f}, fraction={fraction:.3f}) from {len(rows)} campaigns")
    held, count = share_coverage(rows)
    print(f"{held} of {count} true shares lie in their 90 % intervals")


if __name__ == "__main__":
    main()
