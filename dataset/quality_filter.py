"""The quality verdicts, obeyed: which impacts a rule leaves out, and which check said so.

An impact answers for what was found on itself, and for what was found on the whole of its recording or of a channel
that its numbers come from: the force, and the impactor's accelerometer where the velocity was integrated.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from sqlalchemy import ColumnElement, select
from sqlalchemy.orm import Session

from ..schema.impacts import Impact
from ..schema.quality import QualityFinding
from ..schema.recordings import RecordedChannel
from ..schema.velocity_kinds import INTEGRATED, TARGET_MOTION_ADDED, velocity_kind
from ..signals.channel import on_impactor
from .rows import Row

#: A recording without one of its accelerometers; no number of its impacts comes from what is not there.
MISSING_CHANNEL = "missing-channel"
#: Rule -> severities that leave an impact out.
RULES: dict[str, tuple[str, ...]] = {"reject": ("reject",), "warning": ("reject", "warning"), "none": ()}


def verdicts(session: Session, campaigns: Sequence[int], rows: Iterable[Row], rule: str) -> dict[int, str]:
    """Impacts that `rule` leaves out: the impact's key -> "CHECK (SEVERITY)", the worst. `ValueError` for no rule."""
    if rule not in RULES:
        raise ValueError(f"quality rule is {rule!r}; expected one of {', '.join(RULES)}")
    findings = _findings(session, campaigns, RULES[rule]) if RULES[rule] else []
    of_impact: dict[int, str] = {}
    of_recording: dict[tuple[int, bool], str] = {}
    for impact, recording, force, velocity, text in reversed(findings):  # the worst is first, and stays
        if impact is not None:
            of_impact[impact] = text
        else:
            if force:
                of_recording[recording, False] = text
            if force or velocity:
                of_recording[recording, True] = text
    out = {}
    for row in rows:
        integrated = velocity_kind(row["velocity_source"]) in (INTEGRATED, TARGET_MOTION_ADDED)
        verdict = of_impact.get(row["impact_id"]) or of_recording.get((row["recording_id"], integrated))
        if verdict:
            out[row["impact_id"]] = verdict
    return out


_Finding = tuple[int | None, int, bool, bool, str]


def _findings(session: Session, campaigns: Sequence[int], severities: tuple[str, ...]) -> list[_Finding]:
    """(impact, recording, on the force or the recording, on the impactor's accelerometer, text), rejects first."""
    query = (
        select(
            QualityFinding.impact_id,
            QualityFinding.recording_id,
            QualityFinding.check,
            QualityFinding.severity,
            RecordedChannel.quantity,
            RecordedChannel.position,
        )
        .outerjoin(RecordedChannel, QualityFinding.channel_id == RecordedChannel.id)
        .where(QualityFinding.severity.in_(severities), _of_campaigns(campaigns))
    )
    rows = []
    for impact, recording, check, severity, quantity, position in session.execute(query):
        rides = quantity == "acceleration" and on_impactor(position)
        of_force = quantity in (None, "force") and check != MISSING_CHANNEL
        rows.append((impact, recording, of_force, rides, f"{check} ({severity})"))
    return sorted(rows, key=lambda finding: (finding[4].endswith("(warning)"), finding[4]))


def _of_campaigns(campaigns: Sequence[int]) -> ColumnElement[bool]:
    recordings = select(Impact.recording_id).where(Impact.campaign_id.in_(campaigns))
    return QualityFinding.recording_id.in_(recordings)
