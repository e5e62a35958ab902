"""What all pictures share: a figure without a display, colours that colour-blind readers tell
apart, and test bands.

Figures as bytes, to be sent to another process or to the registry.
"""

from __future__ import annotations

from dataclasses import dataclass
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ...dataset.table import PulseTable, Texts

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


#: Okabe and Ito's palette without its yellow, which is lost on white.
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#000000")
MARKERS = ("o", "s", "^", "D", "v", "P", "X")
QUIET = "#8d99ae"

#: Names of metrics on axes; all are means over pulses.
LABELS = {
    "force_rmse_n": "force RMSE (N)",
    "force_nrmse": "force NRMSE (share of range)",
    "contact_time_error": "contact time error (relative)",
    "cost": "cost (eq. 5.4, of 1,000)",
    "peak_force_error": "peak force error (relative)",
    "compression_time_error": "compression time error (relative)",
    "impulse_error": "impulse error (relative)",
    "compression_impulse_error": "compression impulse error (relative)",
}


def new_figure(width: float, height: float) -> Figure:
    """A figure in inches that needs no display and no global state; `savefig` writes it."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained", dpi=150)


@dataclass(frozen=True, eq=False)
class PulseRuns:
    """The k runs of n pulses, in run order: `member` (n,) is the place of a pulse's run, `tip` and
    `label` are (k,)."""

    member: NDArray[np.intp]
    tip: Texts
    label: Texts

    def __len__(self) -> int:
        return len(self.tip)

    def mean(self, values: Floats) -> Floats:
        """Mean of pulses' values (n,) by test, (k,)."""
        counts = np.bincount(self.member, minlength=len(self))
        return np.asarray(np.bincount(self.member, values, len(self)) / counts)


def runs_of(pulses: PulseTable) -> PulseRuns:
    """Runs by campaign and number."""
    order = np.lexsort((pulses.run, pulses.campaign))
    campaign, run = pulses.campaign[order], pulses.run[order]
    new = np.ones(len(order), dtype=bool)
    new[1:] = (campaign[1:] != campaign[:-1]) | (run[1:] != run[:-1])
    member = np.empty(len(order), dtype=np.intp)
    member[order] = np.cumsum(new) - 1
    many = len(np.unique(campaign)) > 1
    label = [
        f"{name} {number}" if many else str(number)
        for name, number in zip(campaign[new], run[new], strict=True)
    ]
    return PulseRuns(member, pulses.tip_material[order][new], np.array(label))


def tip_colours(tips: Texts) -> dict[str, str]:
    """One colour a tip material, the same for the same set of materials."""
    return {str(tip): COLOURS[i % len(COLOURS)] for i, tip in enumerate(np.unique(tips))}


def tip_strip(figure: Figure, axes: Axes, runs: PulseRuns) -> None:
    """A strip of tip materials by test on `axes`, their names below the figure."""
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    colours = tip_colours(runs.tip)
    index = np.searchsorted(list(colours), runs.tip)[None, :]
    axes.imshow(
        index,
        aspect="auto",
        cmap=ListedColormap(list(colours.values())),
        vmin=-0.5,
        vmax=len(colours) - 0.5,
        extent=(-0.5, len(runs) - 0.5, 0, 1),
        interpolation="nearest",
    )
    axes.set_yticks([0.5], ["tip"])
    axes.tick_params(axis="y", length=0)
    number_tests(axes, runs)
    patches: list[Any] = [Patch(color=colour, label=tip) for tip, colour in colours.items()]
    figure.legend(handles=patches, loc="outside lower center", ncols=len(patches), frameon=False)


def number_tests(axes: Axes, runs: PulseRuns) -> None:
    """Some twelve run numbers along x."""
    step = max(1, round(len(runs) / 12))
    places = np.arange(0, len(runs), step)
    axes.set_xticks(places, [str(label) for label in runs.label[places]])
    axes.set_xlim(-0.5, len(runs) - 0.5)
    axes.set_xlabel("test, in run order")


def wide_range(values: Floats) -> bool:
    """Whether an axis of these (positive) values should be logarithmic."""
    positive = values[values > 0]
    return bool(positive.size and np.quantile(positive, 0.98) > 30 * np.quantile(positive, 0.02))


def png(figure: Figure) -> bytes:
    """The figure as PNG, without the date and the software's name: the same figure is the same
    bytes."""
    buffer = BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()
