"""All plausibility checks of a record, and the refusal."""

from __future__ import annotations

from collections.abc import Sequence

from ..observables.base import Stage
from ..record import CampaignRecord
from .absolute import absolute_pressure
from .channels import channel_findings
from .finding import Finding, ImplausibleRecordError
from .settings import setting_findings
from .tensile_force import pulling_force
from .units import unit_findings


def implausible(record: CampaignRecord, stages: Sequence[Stage]) -> tuple[Finding, ...]:
    """Likely mistakes of labels and units in a record, refusals first; `stages` are its nominal ones."""
    found = [*setting_findings(record), *pulling_force(record)]
    if not any(one.severity == "refuse" for one in found):
        found += [*unit_findings(record, stages), *channel_findings(record), *absolute_pressure(record, stages)]
    return tuple(sorted(found, key=lambda one: one.severity != "refuse"))


def check(record: CampaignRecord, stages: Sequence[Stage]) -> tuple[Finding, ...]:
    """What is worth naming. Raises `ImplausibleRecordError` for a record that cannot be what it says."""
    found = implausible(record, stages)
    refused = [one.message for one in found if one.severity == "refuse"]
    if refused:
        raise ImplausibleRecordError(f"campaign {record.name!r}: {'; '.join(refused)}")
    return found
