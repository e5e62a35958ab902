"""Fig. 4.7: both extractions of the test on which they differ most, against the moments of the true
contact.

The thesis cut the pulse by hand. The virtual bench knows: its sealed envelope has the moments of
every contact.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from pyroshock.app.figures.matplotlib_renderer import new_figure
from pyroshock.ingest.extraction.pulses import ExtractedPulse
from pyroshock.signals.channel import Channel

from .contact_differences import difference_percent
from .extraction_methods import extracted
from .picture import MEASURED, QUIET
from .virtual_campaign import HammerCampaign

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HIT = 0
WALK, MASK = ("while cycles", "#d55e00"), ("logical array", "#009e73")


@dataclass(frozen=True)
class Extracted:
    """One hit: its force, what either method made of it, and what happened (`start_s`,
    `contact_time_s`)."""

    test: int
    force: Channel
    walk: ExtractedPulse
    mask: ExtractedPulse
    truth: Mapping[str, Any]


def worst(campaign: HammerCampaign) -> Extracted:
    """The first hit of the test whose two contact times differ most; of test 1 in the thesis."""
    test = int(campaign.tests[np.argmax(difference_percent(campaign))])
    force, walk = extracted(campaign, test, "walk")
    _, mask = extracted(campaign, test, "mask")
    return Extracted(test, force, walk[HIT], mask[HIT], campaign.truth()[test][HIT])


def errors_percent(campaign: HammerCampaign) -> dict[str, NDArray[np.float64]]:
    """Of the contact time of every hit (n,), by either method."""
    found, truth = campaign.pulses("contact_time_s", "segmentation_difference"), campaign.truth()
    hits = zip(found["run"], found["repetition"], strict=True)
    true_s = np.array(
        [truth[int(run)][int(repetition) - 1]["contact_time_s"] for run, repetition in hits]
    )
    walk_s = found["contact_time_s"]
    mask_s = walk_s * (1 - found["segmentation_difference"])
    return {WALK[0]: 100 * (walk_s / true_s - 1), MASK[0]: 100 * (mask_s / true_s - 1)}


def draw(campaign: HammerCampaign) -> Figure:
    """Left the hit, and what each method and the truth call contact; right the errors of all
    hits."""
    figure = new_figure(11.0, 4.4)
    left, right = figure.subplots(1, 2, width_ratios=(2, 1))
    hit = worst(campaign)
    _draw_hit(left, hit)
    left.set_title(f"Test {hit.test}", fontsize=10)
    _draw_errors(right, campaign)
    right.set_title("All hits, mean and standard deviation", fontsize=10)
    figure.suptitle(campaign.note, fontsize=9)
    return figure


def _draw_hit(axes: Any, hit: Extracted) -> None:
    origin_s, period_s = hit.walk.start_s, hit.force.period_s
    samples = np.arange(hit.walk.contact.first - 6, hit.walk.contact.last + 7)
    time_ms = (samples * period_s - origin_s) * 1e3
    axes.plot(time_ms, hit.force.si[samples], "o--", color=MEASURED, ms=4, lw=0.8, label="force")
    stretches = (
        ("truth", "black", hit.truth["start_s"], hit.truth["contact_time_s"]),
        (*WALK, hit.walk.start_s, hit.walk.contact_time_s),
        (*MASK, hit.mask.start_s, hit.mask.contact_time_s),
    )
    for row, (label, colour, start_s, length_s) in enumerate(stretches, 1):
        ends_ms = (np.array([0.0, length_s]) + start_s - origin_s) * 1e3
        level = np.full(2, -0.06 * row * hit.walk.peak_force_n)
        axes.plot(
            ends_ms,
            level,
            "|-",
            color=colour,
            lw=3,
            ms=10,
            label=f"{label}: {length_s * 1e6:.0f} µs",
        )
    axes.axhline(0, color=QUIET, lw=0.6)
    axes.set_xlabel("time since the walk's first sample (ms)")
    axes.set_ylabel("force (N)")
    axes.legend(frameon=False, fontsize=8)


def _draw_errors(axes: Any, campaign: HammerCampaign) -> None:
    run, errors = campaign.pulses("contact_time_s")["run"], errors_percent(campaign)
    tips = list(dict.fromkeys(row["tip_material"] for row in campaign.rows))
    of_tip = [np.isin(run, campaign.tests_with(tip)) for tip in tips]
    for shift, (method, colour) in ((-0.1, WALK), (0.1, MASK)):
        mean = [errors[method][rows].mean() for rows in of_tip]
        spread = [errors[method][rows].std() for rows in of_tip]
        axes.errorbar(
            np.arange(len(tips)) + shift,
            mean,
            spread,
            fmt="o",
            color=colour,
            capsize=3,
            label=method,
        )
    axes.axhline(0, color=QUIET, lw=0.6)
    axes.set_xticks(range(len(tips)), tips)
    axes.set_ylabel("error of the contact time (%)")
