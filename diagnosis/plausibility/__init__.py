"""Mistakes of labels and units, reported before a diagnosis: no physics may be made to explain
them."""

from __future__ import annotations

from collections.abc import Sequence

from ..observables.base import Stage
from ..record import CampaignRecord
from .channels import channel_findings, setting_findings, tensile_force
from .units import ImplausibleRecordError, LikelyMistake, absolute_pressure, unit_findings

__all__ = ["ImplausibleRecordError", "LikelyMistake", "check", "implausible"]


def implausible(record: CampaignRecord, stages: Sequence[Stage]) -> tuple[LikelyMistake, ...]:
    """Likely mistakes of labels and units in a record, refusals first.

    Parameters:
        record: The campaign.
        stages: Its nominal stages.
    """
    findings = [*setting_findings(record), *tensile_force(record)]
    if not findings:
        findings = [
            *unit_findings(record, stages),
            *channel_findings(record),
            *absolute_pressure(record, stages),
        ]
    return tuple(sorted(findings, key=lambda finding: finding.severity != "refuse"))


def check(record: CampaignRecord, stages: Sequence[Stage]) -> tuple[LikelyMistake, ...]:
    """The likely mistakes that are worth naming.

    Parameters:
        record: The campaign.
        stages: Its nominal stages.

    Raises:
        ImplausibleRecordError: For a record that cannot be what it says.
    """
    findings = implausible(record, stages)
    refusals = [finding.message for finding in findings if finding.severity == "refuse"]
    if refusals:
        raise ImplausibleRecordError(f"campaign {record.name!r}: {'; '.join(refusals)}")
    return findings
