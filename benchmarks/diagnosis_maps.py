"""`python -m benchmarks.diagnosis_maps [--jobs 2] [--fit-only]`: constants that the diagnosis
cannot derive.

They say how much evidence counts, how the probability of `unknown` follows from it and from what is
predicted, and how far shares are off. The command adds a row for each development campaign to
docs/blind-check/development/maps.jsonl.gz, and prints the constants of
`diagnosis/inference/model_search.py`, `diagnosis/options.py` and `diagnosis/inference/shares.py`.
Families outside of the catalogue and laws are those of the splits development and calibration,
never the sealed ones; no other check draws these seeds.
"""

from __future__ import annotations

import argparse
import gzip
import json
import tempfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import fields
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pyroshock.diagnosis.diagnose import diagnose
from pyroshock.diagnosis.inference.posterior import UNKNOWN_PRIOR
from pyroshock.diagnosis.inference.shares import SHARE_ERROR
from pyroshock.diagnosis.options import Options, UnknownFigures, UnknownMap, entry_features
from pyroshock.diagnosis.reading import read_folder
from pyroshock.diagnosis.verdict import plain
from pyroshock.validation.case_plan import BENCHES
from pyroshock.validation.cases.attribution import shares
from pyroshock.validation.cases.case import GUN_AND_CONTACT
from pyroshock.validation.cases.draw import draw_case
from pyroshock.validation.cases.record import record_case
from pyroshock.validation.cause_figures import LEAST_SHARE

from .harness import ROOT

Floats = NDArray[np.float64]

ROWS = ROOT / "docs" / "blind-check" / "development" / "maps.jsonl.gz"
#: First number of every seed; the second is the place of the campaign in the list.
SEED = 26_113
DEVELOPMENT, CALIBRATION = "development", "calibration"
_STAGES, _CHAIN, _GUN, _BARREL = (
    ("gun", "hammer", "plate"),
    ("chain",),
    ("gun",),
    (GUN_AND_CONTACT,),
)
#: Campaigns by what is drawn: kinds, tier, cause (where the tier leaves it open), how many of each
#: kind.
PLAN = (
    (_STAGES, "strong", "unknown", 6), (_STAGES, "middle", "unknown", 3), (_STAGES, "strong",
    "catalogue", 4),
    (_STAGES, "middle", "catalogue", 3), (_STAGES, "strong", "none", 3), (_STAGES, "rough", "none",
    3),
    (_STAGES, "strong", "two", 4), (_STAGES, "realistic", "", 6), (_STAGES, "foreign one", "", 6),
    (_STAGES, "foreign two", "", 3), (_CHAIN, "strong", "unknown", 2), (_CHAIN, "strong", "none",
    1),
    (_CHAIN, "strong", "two", 1), (_CHAIN, "realistic", "", 3), (_CHAIN, "foreign one", "", 2),
    (_GUN, "strong", "catalogue", 10), (_GUN, "middle", "catalogue", 6), (_GUN, "strong", "two", 8),
    (_GUN, "foreign one", "", 14), (_GUN, "foreign two", "", 8), (("gun", "hammer"), "realistic",
    "", 16),
    (("plate",), "realistic", "", 6), (("hammer",), "foreign one", "", 8), (("hammer",),
    "foreign two", "", 8),
    (("hammer",), "strong", "unknown", 6), (("gun", "hammer"), "middle", "unknown", 4),
    (_STAGES, "outside", "", 6), (_STAGES, "null rough", "", 4), (_STAGES, "five at 2 to 5", "", 3),
    (_GUN, "one with traces", "", 14), (_GUN, "two with traces", "", 8), (_GUN, "gun with traces",
    "", 8),
    (_GUN, "outside", "", 4), (_GUN, "null rough", "", 8), (_BARREL, "full scale chain", "", 4),
)  # fmt: skip
#: The same by the second laws and outside causes of the split "calibration", which are farther from
#: the library's laws than those of development. Nothing but these constants is learned on them.
CALIBRATION_PLAN = (
    (_STAGES, "foreign one", "", 5), (("gun", "hammer"), "foreign two", "", 6), (_STAGES, "outside",
    "", 6),
    (_STAGES, "five at 2 to 5", "", 3), (_GUN, "one with traces", "", 10), (_GUN, "two with traces",
    "", 8),
    (_GUN, "gun with traces", "", 8), (_GUN, "gun without traces", "", 6), (_BARREL,
    "full scale chain", "", 4),
    (_STAGES, "foreign full scale", "", 2), (("gun", "hammer"), "null rough", "", 3),
)  # fmt: skip
#: Powers of the posterior that are compared, and the least probability that a set is given.
_TEMPERS = (1.0, 0.7, 0.5, 0.4, 0.3, 0.25, 0.2, 0.15, 0.1)
_LEAST_PROBABILITY = 1e-3
#: Prior of the numbers of the map, in the order of `UnknownFigures.features`.
_MEAN = np.array([0.0, 0.3, 3.0, 1.5, 0.0, 0.0])
_SD = np.array([2.0, 0.3, 3.0, 1.5, 1.0, 1.0])
#: The same for the first entry's, in the order of `options.entry_features`.
_ENTRY_MEAN = np.zeros(4)
_ENTRY_SD = np.full(4, 2.0)
#: Effects of a gap that is found exactly, at most: of more, most are too small.
_FOUND_EXACTLY = 2
#: Tiers whose true shares are compared: many effects act at once.
SHARE_TIERS = ("realistic", "gun with traces", "five at 2 to 5", "full scale chain")
#: Tiers whose effects follow laws that the library does not have.
SECOND_LAWS = (
    "foreign one", "foreign two", "one with traces", "two with traces", "gun with traces",
    "gun without traces",
    "five at 2 to 5", "full scale chain", "foreign full scale",
)  # fmt: skip
#: How often intervals are to hold the true share, and shares that are so small do not count.
_HELD, _COUNTED = 0.9, 0.05
_Z90 = 1.6449


class Campaign(NamedTuple):
    number: int
    kind: str
    tier: str
    cause: str
    split: str


def campaigns() -> list[Campaign]:
    rows = [
        (kind, tier, cause, split)
        for split, plan in ((DEVELOPMENT, PLAN), (CALIBRATION, CALIBRATION_PLAN))
        for kinds, tier, cause, count in plan
        for kind in kinds
        for _ in range(count)
    ]
    return [Campaign(number, *row) for number, row in enumerate(rows)]


def diagnosed(campaign: Campaign) -> dict[str, Any]:
    """The row of one campaign: its truth, odds, fraction held out, and shares beside the true
    ones."""
    rng = np.random.default_rng([SEED, campaign.number])
    if campaign.tier in BENCHES:
        case = BENCHES[campaign.tier].draw(campaign.kind, rng, campaign.split, campaign.number)
    else:
        gaps, rough = ("strong", True) if campaign.tier == "rough" else (campaign.tier, False)
        case = draw_case(
            campaign.kind, gaps, rng, cause=campaign.cause, split=campaign.split, rough=rough
        )
    options = Options(where=False, plan=False, rate_pulses=False)
    with tempfile.TemporaryDirectory(prefix="pyroshock-maps-") as place:
        label = record_case(case, Path(place) / "campaign", int(rng.integers(2**31)))
        verdict_of_case = diagnose(read_folder(Path(place) / "campaign"), options=options)
    verdict = verdict_of_case.as_json()
    known = next(c["effects"] for c in verdict["causes"] if c["effects"] != ["unknown"])
    first = {name: verdict["causes"][0][name] for name in ("effects", "probability")}
    row = campaign._asdict() | {"truth": list(label.cause), "first": first}
    row["known"] = known  # the likeliest entry but "unknown"
    row["families"] = {family.family: family.excess for family in verdict_of_case.gap.families}
    row["unknown_figures"] = plain(verdict_of_case.unknown_figures)
    row["true_shares"] = true = shares(label.shapley)
    if _is_found_exactly(row):
        return row | {"sets": verdict_of_case.set_scores}
    return row | {
        "shares": [_share_row(item, true.get(item["effect"], 0.0)) for item in verdict["effects"]]
    }


def temper(rows: Sequence[dict[str, Any]]) -> dict[float, float]:
    """By power of the posterior: the mean logarithm of the probability that it gives to the true
    set of effects, of campaigns with none, one or two of them."""
    used = [row for row in rows if row["truth"] != ["unknown"] and _is_found_exactly(row)]
    return {
        power: float(np.mean([_log_probability(row, power) for row in used])) for power in _TEMPERS
    }


def _weights(row: dict[str, Any], power: float) -> Floats:
    """Probabilities of the sets of effects, of a posterior to this power."""
    joint = np.array([evidence + prior for _, evidence, prior, _ in row["sets"]])
    weights = np.exp(power * (joint - joint.max()))
    return np.asarray(weights / weights.sum())


def _log_probability(row: dict[str, Any], power: float) -> float:
    true = frozenset() if row["truth"] == ["none"] else frozenset(row["truth"])
    same = [
        within if not true else (1 - within) * (true == frozenset(names))
        for names, _, _, within in row["sets"]
    ]
    share = float(_weights(row, power) @ same)
    return float(np.log(_LEAST_PROBABILITY + (1 - _LEAST_PROBABILITY) * share))


def unknown_map(rows: Sequence[dict[str, Any]]) -> Floats:
    """The likeliest numbers of the map of unknown."""
    used = [row for row in rows if row["unknown_figures"] is not None]
    x = np.array([UnknownFigures(**row["unknown_figures"]).features for row in used])
    y = np.array([float(row["truth"] == ["unknown"]) for row in used])
    return likeliest(x, y, _MEAN, _SD, _balanced(used))


def _balanced(rows: Sequence[dict[str, Any]]) -> Floats:
    """Weights (n,) of mean one, so that it does not matter how many campaigns of a tier were drawn:
    unknown causes have the share `UNKNOWN_PRIOR`, and the tiers of all others count alike."""
    groups = ["unknown" if row["truth"] == ["unknown"] else row["tier"] for row in rows]
    number = Counter(groups)
    share = {name: (1 - UNKNOWN_PRIOR) / (len(number) - ("unknown" in number)) for name in number}
    share["unknown"] = UNKNOWN_PRIOR
    return np.array([len(rows) * share[name] / number[name] for name in groups])


def likeliest(
    x: Floats, y: Floats, mean: Floats, sd: Floats, weights: Floats | float = 1.0
) -> Floats:
    """Parameters of a logit with a normal prior, of rows that count by their `weights` (Newton's
    steps)."""
    theta = mean.copy()
    for _ in range(200):
        p = 1 / (1 + np.exp(-np.clip(x @ theta, -30, 30)))
        slope = x.T @ (weights * (y - p)) - (theta - mean) / sd**2
        curvature = (x.T * (weights * p * (1 - p))) @ x + np.diag(1 / sd**2)
        theta = theta + np.clip(np.linalg.solve(curvature, slope), -0.5, 0.5)
    return theta


def entry_map(rows: Sequence[dict[str, Any]]) -> Floats:
    """The likeliest numbers of `first_entry_probability`: of campaigns with a gap that the
    catalogue explains."""
    used = [
        row for row in rows if row["truth"] != ["unknown"] and row["unknown_figures"] is not None
    ]
    x, y = [], []
    for row in used:
        effects = [] if row["known"] == ["none"] else row["known"][0].split("+")
        x.append(entry_features(effects, row["unknown_figures"]["fraction"]))
        y.append(float(any(_is_right(set(names.split("+")), row) for names in row["known"])))
    return likeliest(np.array(x), np.array(y), _ENTRY_MEAN, _ENTRY_SD)


def _is_right(effects: set[str], row: Mapping[str, Any]) -> bool:
    """Whether an answer is the set that acts, of whose effects those with little of the gap may be
    left out."""
    if effects == set(row["truth"]):
        return True
    true_shares = row.get("true_shares", {share[0]: share[2] for share in row.get("shares", ())})
    needed = {name for name, share in true_shares.items() if share >= LEAST_SHARE}
    return bool(needed) and needed <= effects <= set(row["truth"])


def _is_found_exactly(row: Mapping[str, Any]) -> bool:
    """Whether the set that acts is to be found exactly: of the many effects of a realistic bench
    most are too small."""
    return not row["tier"].startswith("realistic") and len(row["truth"]) <= _FOUND_EXACTLY


def first_entries(rows: Sequence[dict[str, Any]]) -> tuple[int, int, int]:
    """Of campaigns with effects by second laws: how many there are, in how many the first entry has
    the effect with the largest true share, and in how many it is `unknown`."""
    used = [row for row in rows if row["tier"] in SECOND_LAWS and "true_shares" in row]
    largest = [
        max(row["true_shares"], key=row["true_shares"].__getitem__, default="") for row in used
    ]
    entries = [row["first"]["effects"] for row in used]
    is_named = [
        any(name in names.split("+") for names in entry)
        for name, entry in zip(largest, entries, strict=True)
    ]
    return len(used), sum(is_named), entries.count(["unknown"])


def _share_row(item: dict[str, Any], true: float) -> list[Any]:
    """Effect, stated share, true share, ends of the interval, and the standard deviation of the
    posterior alone."""
    low, high = item["ci90"]
    posterior = float(np.sqrt(max(((high - low) / (2 * _Z90)) ** 2 - SHARE_ERROR**2, 0.0)))
    return [item["effect"], item["share"], true, low, high, posterior]


def share_error(rows: Sequence[dict[str, Any]]) -> tuple[float, float]:
    """Standard deviation of shares beyond their posterior's (`SHARE_ERROR`), by Shapley values on
    benches with many effects: the least with which intervals hold `_HELD` of the true shares, the
    mean over tiers; and how much the intervals of the rows hold."""
    counted = [
        (list(SHARE_TIERS).index(row["tier"]), *share[1:])
        for row in rows
        for share in row.get("shares", ())
        if row["tier"] in SHARE_TIERS and max(abs(share[1]), abs(share[2])) >= _COUNTED
    ]
    tier, mean, true, low, high, posterior = np.array(counted).T
    count = np.bincount(tier.astype(int))[tier.astype(int)]

    def held(inside: NDArray[np.bool_]) -> float:
        return float(np.sum(inside / count) / np.sum(1 / count))

    for error in np.arange(0.0, 1.001, 0.01):
        if held(np.abs(true - mean) <= _Z90 * np.sqrt(posterior**2 + error**2)) >= _HELD:
            return float(error), held((low <= true) & (true <= high))
    return 1.0, held((low <= true) & (true <= high))


def _rows(jobs: int) -> Iterator[dict[str, Any]]:
    done = {row["number"]: row for row in _stored_rows()}
    yield from done.values()
    with ProcessPoolExecutor(jobs) as pool, gzip.open(ROWS, "at", encoding="utf-8") as file:
        campaigns_to_do = [
            campaign for campaign in reversed(campaigns()) if campaign.number not in done
        ]
        campaign_of_future = {
            pool.submit(diagnosed, campaign): campaign for campaign in campaigns_to_do
        }
        for future in as_completed(campaign_of_future):
            if isinstance(
                error := future.exception(), ValueError
            ):  # a campaign that is refused has no answer
                print(*campaign_of_future[future], f"no row: {error}", flush=True)
                continue
            row = future.result()
            file.write(json.dumps(_rounded(row)) + "\n")
            file.flush()
            print(
                row["number"],
                row["kind"],
                row["truth"],
                row["first"]["effects"],
                row["known"],
                flush=True,
            )
            yield row


def _rounded(value: Any) -> Any:
    """Numbers to five digits: nothing that is learned depends on more."""
    if isinstance(value, float):
        return float(f"{value:.5g}")
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    return [_rounded(item) for item in value] if isinstance(value, list | tuple) else value


def _stored_rows() -> list[dict[str, Any]]:
    if not ROWS.exists():
        return []
    with gzip.open(ROWS, "rt", encoding="utf-8") as lines:
        return [json.loads(line) for line in lines]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--fit-only", action="store_true", help="from the rows that are there")
    options = parser.parse_args()
    rows = _stored_rows() if options.fit_only else list(_rows(options.jobs))
    names = zip(
        (item.name for item in fields(UnknownMap) if item.name != "source"),
        unknown_map(rows),
        strict=True,
    )
    print(
        f"UnknownMap({', '.join(f'{name}={value:.2f}' for name, value in names)}) "
        f"from {len(rows)} campaigns"
    )
    entry = ", ".join(f"{value:.2f}" for value in entry_map(rows))
    print(f"ENTRY_INTERCEPT, _NONE, _SEVERAL, _FRACTION = {entry}")
    for power, score in temper(rows).items():
        print(f"TEMPER = {power:g}: mean log probability of the true set {score:.3f}")
    count, named, unknown = first_entries(rows)
    print(
        f"second laws: the largest effect in the first entry of {named} of "
        f"{count}, unknown first in {unknown}"
    )
    error, held = share_error(rows)
    print(f"SHARE_ERROR = {error:.2f}; the intervals of the rows held {held:.0%}")


if __name__ == "__main__":
    main()
