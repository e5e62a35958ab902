"""How results look in a notebook: axes that are given or made, and tables as HTML."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


def axes_or_new(ax: Axes | None, width: float = 7.0, height: float = 4.0) -> Axes:
    """The axes that were given, or those of a new figure that a notebook shows."""
    if ax is not None:
        return ax
    import matplotlib.pyplot as plt

    return plt.subplots(figsize=(width, height), layout="constrained")[1]


def titled_table(title: str, frame: pd.DataFrame, rows: int = 12) -> str:
    """HTML of a heading and of the first rows of a frame."""
    shown = frame.head(rows).to_html(border=0, max_cols=16)
    more = f"<p>{len(frame) - rows} further rows: use .to_frame()</p>" if len(frame) > rows else ""
    return f"<p><b>{escape(title)}</b></p>{shown}{more}"


def facts_table(title: str, facts: dict[str, Any]) -> str:
    """HTML of a heading and of names with their values."""
    cells = "".join(f"<tr><th>{escape(name)}</th><td>{escape(str(value))}</td></tr>" for name, value in facts.items())
    return f"<p><b>{escape(title)}</b></p><table>{cells}</table>"
