"""A force that pulls: no contact does, so the channel is another sensor's."""

from __future__ import annotations

import numpy as np

from ..record import CampaignRecord, Series
from .finding import Finding

#: A load cell and its filter ring to a third of the peak at worst (measured: 3 %); an accelerometer's record swings.
MOST_PULL = 0.5


def pulling_force(record: CampaignRecord) -> list[Finding]:
    """A refusal where the force falls as far below its rest as a contact cannot."""
    shares = [_pull(run.force) for run in record.runs if run.force is not None and run.force.values.size]
    if not shares or np.median(shares) < MOST_PULL:
        return []
    message = (
        f"force pulls {float(np.median(shares)):.0%} as much as it pushes, which no contact does: is it another "
        "sensor's channel? check the names in [channels.*] of campaign.toml"
    )
    return [Finding("refuse", "force", message)]


def _pull(force: Series) -> float:
    before = force.values[force.time_s < 0]
    rest = float(np.median(before)) if before.size else 0.0
    push = float(force.values.max()) - rest
    return (rest - float(force.values.min())) / push if push > 0 else 0.0
