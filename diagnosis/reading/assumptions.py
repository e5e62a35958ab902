"""Sentences for the report: what was taken for granted when a campaign was read."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...schema.campaigns import Campaign
from ..record import CampaignRecord
from .impacts import Hit
from .records import Records
from .settings import TRAVEL


def assumptions(campaign: Campaign, record: CampaignRecord, hits: Sequence[Hit], series: Records) -> tuple[str, ...]:
    """In the order of the chain: pressure, velocity, force, acceleration, plate."""
    return (
        *_pressure(hits),
        *_travel(record),
        *_velocity(hits),
        *_force(hits, series),
        *_acceleration(series),
        *_bench(campaign, record),
    )


def _pressure(hits: Sequence[Hit]) -> Iterator[str]:
    shots = [hit for hit in hits if hit.set_pressure_pa is not None]
    recorded = [hit for hit in shots if hit.recorded_pressure_pa is not None]
    if not shots:
        return
    if not recorded:
        yield "tank pressure: the set one, since none was recorded; gauge"
        return
    ratios = [(hit.recorded_pressure_pa or 0.0) / (hit.set_pressure_pa or 1.0) for hit in recorded]
    yield (
        f"tank pressure: as recorded in {len(recorded)} of {len(shots)} shots, in the median "
        f"{float(np.median(ratios)) - 1:+.1%} from the set one; gauge"
    )


def _travel(record: CampaignRecord) -> Iterator[str]:
    own = [run.travel_m for run in record.runs if run.travel_m is not None]
    if not own or record.gun is None:
        return
    columns = [name for name in TRAVEL if any(name in each.factors for each in record.configurations)]
    yield (
        f"travel to the vent holes: {min(own) * 1e3:g} to {max(own) * 1e3:g} mm, as the column {columns[0]} has it for "
        f"{len(own)} of {len(record.runs)} runs; [bench.gun] has {record.gun.travel_m * 1e3:g} mm"
    )


def _velocity(hits: Sequence[Hit]) -> Iterator[str]:
    integrated = [hit for hit in hits if hit.velocity_source == "integrated"]
    if integrated:
        shares = [(hit.velocity_u_m_s or 0.0) / hit.velocity_m_s for hit in integrated if hit.velocity_m_s]
        yield (
            f"impact velocity of {len(integrated)} of {len(hits)} hits: integrated from the impactor's acceleration "
            f"(standard uncertainty {float(np.median(shares)) if shares else 0.0:.1%} in the median), which reads the "
            "velocity lost in compression: too low by what a yielding plate moves meanwhile"
        )
    stand_in = sum(hit.velocity_source == "impact" for hit in hits)
    if stand_in:
        yield f"muzzle velocity of {stand_in} of {len(hits)} shots: that at the plate, since none was measured before"
    missing = sum(hit.velocity_m_s is None for hit in hits)
    if 0 < missing < len(hits):
        yield f"{missing} of {len(hits)} runs have no measured velocity"


def _force(hits: Sequence[Hit], series: Records) -> Iterator[str]:
    pulses = sum(hit.has_pulse for hit in hits)
    alone = len(series.rung_alone)
    if alone:
        yield (
            f"no force was recorded with {alone} of {len(hits)} hits: their accelerations are used from where they "
            "begin to ring"
        )
    silent = sum(hit.recording_id is not None and not hit.has_pulse for hit in hits)
    if silent and not alone:
        yield f"no contact force in the recordings of {silent} of {len(hits)} hits: what else they hold is not used"
    if series.chosen < pulses:
        yield f"series of {series.chosen} of {pulses} hits are used, evenly chosen in each configuration"
    if series.cells > 1:
        yield f"contact force: the sum of {series.cells} force channels"
    if series.turned:
        yield f"force shows compression as negative in {len(series.turned)} of {series.chosen} hits, and was turned"
    if series.double_hits:
        yield f"{len(series.double_hits)} of {series.chosen} hits are followed by a second touch"
    for channel, count in sorted(series.rejected.items()):
        yield f"{channel}: left out in {count} of {series.chosen} hits, since quality checks reject it there"


def _acceleration(series: Records) -> Iterator[str]:
    for channel in sorted(series.of_impactor):
        yield f"{channel} rides on the impactor: it says nothing of the plate"


def _bench(campaign: Campaign, record: CampaignRecord) -> Iterator[str]:
    if campaign.plate is None or campaign.plate.thickness_m is None:
        yield f"plate: {record.plate_thickness_m * 1e3:g} mm thick, since campaign.toml gives no thickness"
    if record.plate is not None and len(record.plate.impact_points) == 1:
        point = record.plate.impact_points[0]
        others = {str(each.factors.get("impact_position", point)) for each in record.configurations} - {point}
        if others:
            yield f"plate: hits at {', '.join(sorted(others))} too, and the modal table knows {point} alone"
