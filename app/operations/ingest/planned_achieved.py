"""Planned against achieved, and the bench, as the page of a campaign shows them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from ...common.number_format import format_number
from ...common.quantities import cell, display_of, heading, named_level, units

Rows = Sequence[dict[str, Any]]


def planned_achieved_rows(levels: Rows, achieved: Rows) -> list[dict[str, Any]]:
    """A row for each level of a factor that has several: its runs by state, what was recorded, and
    how far the recorded settings are from the planned ones. Quantities that no factor sets
    directly, such as the velocity, follow. Numbers of more than `_MOST_LEVELS` levels share a row.

    `levels` and `achieved` are those of `campaign_overview`. The deviation is that of the mean,
    with its worst run.
    """
    several = several_levels(levels)
    recorded = (
        "shots"
        if sum(row["shots"] for row in levels) > sum(row["impacts"] for row in levels)
        else "impacts"
    )
    rows = []
    for factor in several:
        of_factor = [row for row in levels if row["factor"] == factor]
        runs = [run for run in achieved if run["quantity"] == factor]
        for words, members in _level_groups(factor, of_factor, "level"):
            states = {
                state: sum(row[state] for row in members)
                for state in ("planned", "done", "discarded")
            }
            number = {recorded: sum(row[recorded] for row in members)}
            same = [
                run for run in runs if any(_same(run["planned"], row["level"]) for row in members)
            ]
            rows.append(_row(factor, words, states | number, same))
    others = [run for run in achieved if run["quantity"] not in several]
    for quantity in sorted({run["quantity"] for run in others}):
        runs = sorted(
            (run for run in others if run["quantity"] == quantity),
            key=lambda run: float(run["planned"]),
        )
        for words, members in _level_groups(quantity, runs, "planned"):
            number = {recorded: sum(run["recorded"] for run in members)}
            counts = {"planned": None, "done": len(members), "discarded": None, **number}
            rows.append(_row(quantity, words, counts, members))
    return rows


#: Levels of a number that have a row each.
_MOST_LEVELS = 8


def _level_groups(key: str, rows: Rows, column: str) -> Iterator[tuple[str, Rows]]:
    """Rows by their level in `column`, with the level in words; many numbers are one group."""
    by_level: dict[Any, list[dict[str, Any]]] = {}
    for row in rows:
        by_level.setdefault(row[column], []).append(row)
    numbers = [level for level in by_level if isinstance(level, int | float)]
    if len(numbers) <= _MOST_LEVELS or len(numbers) < len(by_level):
        yield from ((cell(key, level), members) for level, members in by_level.items())
    else:
        yield (
            f"{cell(key, min(numbers))} to {cell(key, max(numbers))} ({len(numbers)} levels)",
            rows,
        )


def _row(key: str, level: str, counts: dict[str, int | None], runs: Rows) -> dict[str, Any]:
    shown = {
        "setting": heading(key),
        "level": level,
        **counts,
        "mean_deviation": None,
        "worst": None,
    }
    if runs:
        worst = max(runs, key=lambda run: abs(run["deviation"]))
        shown["mean_deviation"] = _percent(sum(run["deviation"] for run in runs) / len(runs))
        deviation = _percent(worst["deviation"])
        shown["worst"] = deviation if deviation == "0.0 %" else f"{deviation} (run {worst['run']})"
    return shown


def _same(planned: float, level: object) -> bool:
    return isinstance(level, int | float) and abs(planned - level) <= 1e-9 * abs(planned)


def _percent(share: float) -> str:
    """With a sign, and without one for nothing: 0.0 %."""
    text = f"{100 * share:+.1f}"
    return ("0.0" if float(text) == 0 else text.replace("-", "−")) + " %"


def several_levels(levels: Rows) -> list[str]:
    """Factors that change within the campaign, in their order."""
    counts: dict[str, int] = {}
    for row in levels:
        counts[row["factor"]] = counts.get(row["factor"], 0) + 1
    return [factor for factor, count in counts.items() if count > 1]


def constant_settings(levels: Rows) -> list[str]:
    """Factors that have the same level in all runs: "tip radius 30 mm"."""
    by_factor: dict[str, list[Any]] = {}
    for row in levels:
        by_factor.setdefault(row["factor"], []).append(row["level"])
    return [
        named_level(factor, values[0]) for factor, values in by_factor.items() if len(values) == 1
    ]


def bench_facts(bench: dict[str, dict[str, Any]]) -> Iterator[tuple[str, str]]:
    """Label and value with its unit of each part of a bench that the store knows."""
    for part, figures in bench.items():
        for key, value in figures.items():
            if value is None:
                continue
            if key == "outline_m":
                yield f"{part.capitalize()}: corners", _corners(value)
            elif key == "measured_modes":
                yield (
                    f"{part.capitalize()}: modes",
                    "measured (modal table)" if value else "computed",
                )
            elif key == "tank_volume_m3":
                litres = units() == "bench"
                yield (
                    f"{part.capitalize()}: tank volume",
                    _with_unit(value * (1e3 if litres else 1), "L" if litres else "m³"),
                )
            else:
                display = display_of(key)
                text = (
                    _with_unit(value * display.scale, display.unit)
                    if isinstance(value, float)
                    else str(value)
                )
                yield f"{part.capitalize()}: {display.label}", text


def _with_unit(value: float, unit: str) -> str:
    return f"{format_number(value)} {unit}".strip()


def _corners(outline: Sequence[Sequence[float]]) -> str:
    """The size, and the corners one after another: "1000 mm × 600 mm; corners at x/y 0/100, 620/0
    mm"."""
    display = display_of("outline_m")
    points = [[coordinate * display.scale for coordinate in point] for point in outline]
    width, height = (max(column) - min(column) for column in zip(*points, strict=True))
    size = f"{_with_unit(width, display.unit)} × {_with_unit(height, display.unit)}"
    places = ", ".join("/".join(map(format_number, point)) for point in points)
    return f"{size} overall; x/y in {display.unit}: {places}"
