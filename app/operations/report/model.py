"""A registered model as a report: what it is good for, how it compares with the model in use, its
figures by split, how it errs on the pulses held out, and what was decided of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ....array_types import Floats
from ....training.evaluation.metrics import METRICS, figures, reconstruct
from ....training.registry.listing import chosen, newest
from ....training.registry.records import Decision, Version
from ...common.number_format import format_interval, format_number, percent_with_range
from ...common.quantities import display_of
from ...documents.document import (
    Block,
    Bullets,
    Cell,
    ChartRow,
    Document,
    Paragraph,
    Section,
    Table,
)
from ...figures.agreement import MOST_POINTS, agreement_plot
from ...figures.figure import ColourRole, LineSeries, Plot, PlotAxis, PointSeries, category
from ..train.figures import side_by_side, version_row
from ..train.wording import (
    bounded,
    difference_sentence,
    share,
    share_range,
    share_with_range,
    unseen,
    version_sentences,
)

if TYPE_CHECKING:
    from ....dataset.table import PulseTable
    from ....training.models.base import ContactPrediction
    from ....training.registry.registry import Registry

    Read = Callable[[str], PulseTable]

_LABELS = {
    "force_nrmse": "rms error of the force, of its range",
    "force_rmse_n": "rms error of the force",
    "contact_time_error": "error of the contact time",
    "peak_force_error": "error of the peak force",
    "compression_time_error": "error of the compression time",
    "impulse_error": "error of the impulse",
    "compression_impulse_error": "error of the compression impulse",
    "cost": "cost (eq. 5.4, of 1000)",
}
_COVERED = {
    "force_covered": "force points inside the 90 % band",
    "time_covered": "contact times inside the 90 % band",
}


def model_document(registry: Registry, version: Version, read: Read) -> Document:
    """The report on a version; `read` gives a dataset's pulses by its hash, and may raise
    `LookupError`."""
    versions = registry.versions()
    siblings = of_all_splits(versions, version)
    floors = registry.floors(version.dataset.hash, version.seed)
    rows = [version_row(sibling, floors) for sibling in siblings]
    in_use, comparison = _beside_the_one_in_use(registry, versions, version, read)
    sections = (
        Section("Compared with the model in use", comparison),
        Section("Figures by split", [_figures(rows, siblings)]),
        pulses_section(registry, version, read),
        Section("Decisions", [_decisions(registry.decisions(), siblings)]),
        Section("Origin", [_origin(version)]),
    )
    return Document(
        kind="Model",
        title=version.label,
        lead=" ".join([*map(str, version_sentences(rows[0])), _force_sentence(version), in_use]),
        facts={
            "Dataset": version.dataset.name,
            "Predictors": f"those of a {version.dataset.predictor_set}",
            "Judged on": ", ".join(sibling.split for sibling in siblings),
        },
        sections=[section for section in sections if section.blocks],
        date=version.registered_at.date(),
    )


def of_all_splits(versions: Sequence[Version], version: Version) -> list[Version]:
    """`version` first, then the newest of the same model, dataset and seed on each other split."""
    same = (version.name, version.dataset.hash, version.seed)
    others = newest(
        version
        for version in versions
        if (version.name, version.dataset.hash, version.seed) == same
    )
    by_split = {
        version.split: version for version in sorted(others, key=lambda version: version.version)
    }
    by_split.pop(version.split, None)
    return [version, *(by_split[split] for split in sorted(by_split))]


def _force_sentence(version: Version) -> str:
    estimate = version.metrics["force_rmse_n"]
    return (
        f"The rms error of the force is "
        f"{_force_words(estimate.mean, (estimate.low, estimate.high))}."
    )


def _force_words(mean_n: float, ci90: Sequence[float] | None) -> str:
    """`1.2 kN (0.62 to 1.9 kN)`."""
    force = display_of("force_n")

    ends = None if ci90 is None else [force.scale * end for end in ci90]
    return _with_ends(force.scale * mean_n, ends, 2, force.unit)


def _with_ends(mean: float, ci90: Sequence[float] | None, digits: int, unit: str = "") -> str:
    """A mean with the ends of its interval, with the digits that it leaves; `digits` of one whose
    interval is not known."""
    ends = bounded(ci90)
    if not ends or not np.isfinite(ends).all():
        return f"{format_number(mean, digits)} {unit}".rstrip()
    value, low, high = format_interval(mean, *ends)
    return f"{f'{value} {unit}'.rstrip()} ({low} to {f'{high} {unit}'.rstrip()})"


def _beside_the_one_in_use(
    registry: Registry, versions: Sequence[Version], version: Version, read: Read
) -> tuple[str, list[Block]]:
    """A sentence that says whether it is in use, or how it compares with the version that is; and
    the differences."""
    kind = version.dataset.predictor_set
    if any(record.champion_of for record in versions if record.label == version.label):
        return f"It is the model in use for a {kind}.", []
    others = [record for record in versions if record.champion_of == kind]
    if not others:
        return f"No model is in use for a {kind}.", []
    champion = chosen(versions, others[0].label, version.split)
    try:
        result = side_by_side(registry, [champion, version], read)
    except (LookupError, ValueError) as error:
        return (
            f"It cannot be compared with {champion.label}, which is in use for a {kind}: {error}.",
            [],
        )
    means = {model["label"]: model["metrics"] for model in result["models"]}
    differences = {row["metric"]: row for row in result["differences"]}
    of_force = {label: metrics["force_nrmse"] for label, metrics in means.items()}
    sentence = difference_sentence(differences["force_nrmse"], of_force, version.split)
    return f"{champion.label} is in use for a {kind}. {sentence}", [
        _differences(version, champion, means, differences)
    ]


def _differences(
    version: Version,
    champion: Version,
    means: Mapping[str, Mapping[str, float]],
    differences: Mapping[str, Mapping[str, Any]],
) -> Table:
    rows: list[list[Cell]] = []
    for metric in ("force_nrmse", "peak_force_error", "contact_time_error", "impulse_error"):
        row = differences[metric]
        sign = 1.0 if row["a"] == version.label else -1.0
        between = share_range(sorted(sign * end for end in row["ci90"])) if row["ci90"] else None
        p_value = None if row["p_value"] is None else format_number(row["p_value"], 2)
        errors = [share(means[label][metric]) for label in (version.label, champion.label)]
        rows.append([_LABELS[metric], *errors, share(sign * row["difference"]), between, p_value])
    heads = (
        "figure",
        version.label,
        f"{champion.label} (in use)",
        "difference",
        "90 % interval",
        "p value",
    )
    caption = (
        "Mean errors on the pulses that both have held out, and their difference in per cent "
        f"points: below zero the error of {version.label} is smaller."
    )
    return Table(caption, heads, rows, main=(heads[0], heads[3], heads[5]))


def _figures(rows: Sequence[Mapping[str, Any]], versions: Sequence[Version]) -> Table:
    """A row for each figure; for each split its mean with the interval, and what repeated impacts
    differ by."""
    heads = ["figure"]
    cells: list[list[Cell]] = [[_LABELS[metric]] for metric in METRICS]
    for row in rows:
        split = f"{row['split']}: " if len(rows) > 1 else ""
        heads += [f"{split}error (90 % interval)", f"{split}repeated impacts"]
        for line, metric in zip(cells, METRICS, strict=True):
            figure = row["metrics"][metric]
            floor = next((value for value in figure["floor"].values() if value is not None), None)
            line += [
                _figure_words(metric, figure["mean"], figure["ci90"]),
                _figure_words(metric, floor, None),
            ]
    thesis = rows[0]["metrics"]
    if any(thesis[metric]["thesis"] is not None for metric in METRICS):
        heads.append("thesis")
        for line, metric in zip(cells, METRICS, strict=True):
            line.append(_figure_words(metric, thesis[metric]["thesis"], None))
    for metric, name in _COVERED.items():
        estimates = [version.metrics.get(metric) for version in versions]
        if any(estimates):
            words = [
                None if e is None else percent_with_range(e.mean, (e.low, e.high))
                for e in estimates
            ]
            shares: list[Cell] = [name, *(cell for text in words for cell in (text, None))]
            cells.append([*shares, *[None] * (len(heads) - len(shares))])
    caption = (
        "Means over the held-out pulses with 90 % intervals, and beside them by how much repeated "
        "impacts of the bench differ: no model can be expected to be better."
    )
    return Table(caption, heads, cells, main=heads[:2])


def _figure_words(metric: str, mean: float | None, ci90: Sequence[float] | None) -> str | None:
    if mean is None:
        return None
    if metric == "force_rmse_n":
        return _force_words(mean, ci90)
    if metric == "cost":
        return _with_ends(mean, ci90, 3)
    return share_with_range({"mean": mean, "ci90": ci90})


def pulses_section(registry: Registry, version: Version, read: Read) -> Section:
    """The charts; in their place the reason where the store has not the pulses, or the registry not
    the predictions."""
    from ....training.registry.evaluate import evaluate_held_out

    title = "On the pulses held out"
    try:
        judged = evaluate_held_out(registry, [version], read)
    except (LookupError, ValueError) as error:
        return Section(
            title,
            [
                Paragraph(
                    f"There is no chart, because the pulses cannot be read: {error}", quiet=True
                )
            ],
        )
    pulses, prediction = judged.pulses, judged.predictions[version.label]
    caption = (
        f"Predicted against measured values of {len(pulses)} "
        f"pulse{'' if len(pulses) == 1 else 's'}, on "
        f"{unseen(version.split)}. The dashed lines are 10 % off."
    )
    if len(pulses) > MOST_POINTS:
        caption += f" {MOST_POINTS} of them are drawn."
    bands = _coverage(pulses, prediction)
    charts = ChartRow([*agreement(pulses, prediction), *bands])
    blocks: list[Block] = [Paragraph(caption, quiet=True), charts]
    if not bands:
        blocks.append(
            Paragraph("The model gives no spread, so that there are no bands to judge.", quiet=True)
        )
    return Section(title, blocks)


def agreement(pulses: PulseTable, prediction: ContactPrediction) -> list[Plot]:
    """Predicted against measured peak force and contact time, logarithmic since relative errors
    count."""
    peak = figures(reconstruct(prediction.force_n), prediction.contact_time_s).peak_force_n
    pairs = {
        "peak_force_n": _clouds(pulses, "peak_force_n", pulses.peak_force_n, peak),
        "contact_time_s": _clouds(
            pulses, "contact_time_s", pulses.contact_time_s, prediction.contact_time_s
        ),
    }
    drawn = []
    for key, clouds in pairs.items():
        display = display_of(key)
        title = f"{display.label[0].upper()}{display.label[1:]}"
        x, y = (PlotAxis(name, display.unit, "log") for name in ("measured", "predicted"))
        drawn.append(agreement_plot(title, clouds, x, y, off=0.1))
    return drawn


def _clouds(pulses: PulseTable, key: str, measured: Floats, predicted: Floats) -> list[PointSeries]:
    scale = display_of(key).scale
    names = [
        f"{c} run {r}, repetition {k}"
        for c, r, k in zip(pulses.campaign, pulses.run, pulses.repetition, strict=True)
    ]
    clouds = []
    tips = np.unique(pulses.tip_material).tolist()
    for number, tip in enumerate(tips):
        rows = np.flatnonzero(pulses.tip_material == tip)
        clouds.append(
            PointSeries(
                name=f"{tip} tip" if len(tips) > 1 else "",
                role=category(number),
                opacity=0.8,
                x=scale * measured[rows],
                y=scale * predicted[rows],
                labels=tuple(names[i] for i in rows),
            )
        )
    return clouds


def _coverage(pulses: PulseTable, prediction: ContactPrediction) -> list[Plot]:
    """How many measurements central intervals hold, beside how many they promise to; none without a
    spread."""
    from ....training.evaluation.coverage import LEVELS, coverage

    pairs = (
        ("force", prediction.force_n - pulses.force_n, prediction.force_spread_n),
        (
            "contact time",
            prediction.contact_time_s - pulses.contact_time_s,
            prediction.contact_time_spread_s,
        ),
    )
    curves = [
        LineSeries(
            name=name,
            role=category(number),
            x=100 * LEVELS,
            y=100 * coverage(_scores(off, spread)),
        )
        for number, (name, off, spread) in enumerate(pairs)
        if spread is not None
    ]
    if not curves:
        return []
    equal = LineSeries(
        x=np.array([0.0, 100.0]),
        y=np.array([0.0, 100.0]),
        role=ColourRole.REFERENCE,
        width=1.3,
        silent=True,
    )
    x, y = PlotAxis("nominal coverage", "%"), PlotAxis("measured inside", "%")
    return [Plot("Coverage of the bands", x, y, (equal, *curves))]


def _scores(off: Floats, spread: Floats) -> Floats:
    """Errors in spreads; where a law is certain any error is beyond all of its intervals."""
    return np.divide(off, spread, out=np.where(off == 0, 0.0, np.inf), where=spread > 0)


def _decisions(decisions: Sequence[Decision], versions: Sequence[Version]) -> Table:
    """Promotions and refusals that a version was part of, the newest first."""
    labels = {version.label for version in versions}
    rows: list[list[Cell]] = [
        [
            f"{decision.when:%Y-%m-%d %H:%M}",
            _decision_words(decision),
            f"{decision.judged_on}, against {decision.judged_against}",
            decision.pulses,
            decision.reason,
            decision.who,
        ]
        for decision in decisions
        if {decision.candidate, decision.champion} & labels
    ]
    heads = ("when (UTC)", "decision", "judged on", "pulses", "reason", "by")
    caption, empty = (
        "Promotions and refusals that it was part of.",
        "It was neither promoted nor refused.",
    )
    return Table(caption, heads, rows, empty, main=heads[:2])


def _decision_words(decision: Decision) -> str:
    verb = "is promoted" if decision.promoted else "is refused"
    forced = " by force" if decision.promoted and decision.forced else ""
    before = f"{decision.champion} was in use" if decision.champion else "none was in use"
    return f"{decision.candidate} {verb}{forced}; {before} before"


def _origin(version: Version) -> Bullets:
    cost = version.cost
    return Bullets(
        (
            f"It was registered on {version.registered_at:%Y-%m-%d %H:%M} UTC, with the seed "
            f"{version.seed}. The training took {format_number(cost.seconds, 2)} s and "
            f"{format_number(cost.peak_memory_mb, 3)} MB of memory.",
            f"Hash of the dataset {version.dataset.name}: {version.dataset.hash}",
            f"SHA-256 of its files: {version.sha256}",
        ),
        "",
        quiet=True,
    )
