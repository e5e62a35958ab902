"""Charts of a campaign: what its plan asked for, and what became of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..table_format import HEADINGS, heading
from .base import Figure, figure, line, points


def achieved_figure(rows: Sequence[Mapping[str, Any]], quantity: str) -> Figure:
    """Achieved (mean, least and largest of a run) over planned, of one quantity of `achieved.achieved_settings`."""
    quantity_rows = [row for row in rows if row["quantity"] == quantity]
    scale = HEADINGS.get(quantity, ("", 1.0))[1]
    planned = [row["planned"] * scale for row in quantity_rows]
    mean = [row["mean"] * scale for row in quantity_rows]
    bars = {
        "type": "data",
        "symmetric": False,
        "array": [row["largest"] * scale - m for row, m in zip(quantity_rows, mean, strict=True)],
        "arrayminus": [m - row["least"] * scale for row, m in zip(quantity_rows, mean, strict=True)],
        "color": "c0/0.5",
    }
    names = [f"{row['plan']}, run {row['run']}" for row in quantity_rows]
    ends = [min(planned + mean), max(planned + mean)]
    return figure(
        [
            line(ends, ends, "as planned", "quiet", dash="dash"),
            points(planned, mean, "runs", "c0", error_y=bars, text=names),
        ],
        f"planned {heading(quantity)}",
        "achieved",
        showlegend=False,
    )
