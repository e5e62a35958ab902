"""The reliability curve, drawn."""

from __future__ import annotations

from pathlib import Path

from ...schema.outputs import whole_file
from .score import Figures


def draw_reliability(tables: dict[str, Figures], path: Path) -> None:
    """Share right over probability said, with 95 % intervals, for each of some tables by name; as PNG or SVG."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5, 4.5), layout="constrained")
    axes = figure.subplots()
    axes.plot([0, 1], [0, 1], color="0.6", linewidth=1, label="what is said is so")
    for name, found in tables.items():
        bins = found.reliability.curve
        x, y = [b.probability for b in bins], [b.right.value or 0.0 for b in bins]
        low = [value - b.right.interval[0] for value, b in zip(y, bins, strict=True)]
        high = [b.right.interval[1] - value for value, b in zip(y, bins, strict=True)]
        axes.errorbar(x, y, yerr=[low, high], marker="o", capsize=2, label=f"{name} (ECE {found.reliability.ece:.3f})")
    axes.set(xlim=(0, 1), ylim=(0, 1), xlabel="probability said", ylabel="share right")
    axes.legend(loc="upper left", frameon=False)
    with whole_file(path) as partial:
        figure.savefig(partial, dpi=150)
