"""The quality of campaigns in words: how many recordings the checks reject, which impacts they
concern, and what to do about each kind of finding."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from ....schema.impacts import Impact
from ....schema.recordings import SET_ASIDE, STORED, QualityFinding, RecordedChannel, Recording
from ...common.quantities import in_shown_units


@dataclass(frozen=True)
class RecordingQuality:
    """Recordings of a campaign: those that are stored, and of these that a check rejects or warns
    of; and those that could not be read."""

    stored: int = 0
    rejected: int = 0
    warned: int = 0
    set_aside: int = 0

    @property
    def words(self) -> str:
        """For a cell of a table."""
        if not self.stored and not self.set_aside:
            return "no recordings"
        counts = {
            "rejected": self.rejected,
            "set aside": self.set_aside,
            "with warnings": self.warned,
        }
        return ", ".join(f"{count} {words}" for words, count in counts.items() if count) or "good"

    @property
    def sentence(self) -> str:
        """For the head of a campaign's page."""
        recordings = self.stored
        if not recordings and not self.set_aside:
            return "The campaign has no recordings, so that nothing could be checked."
        aside = (
            f"{self.set_aside} could not be read and "
            f"{'was' if self.set_aside == 1 else 'were'} set aside"
        )
        if not recordings:
            return f"{aside}; no recording is stored."
        accepted = recordings - self.rejected
        if self.rejected:
            text = f"{accepted} of {recordings} recordings {_are(accepted)} accepted, "
            text += f"{self.rejected} {_are(self.rejected)} rejected"
        else:
            text = (
                f"All {recordings} recordings are accepted"
                if recordings > 1
                else "The recording is accepted"
            )
        if self.warned:
            text += (
                f"; {self.warned} of the accepted recordings "
                f"{'has' if self.warned == 1 else 'have'} warnings"
            )
        return f"{text}; {aside}." if self.set_aside else f"{text}."


def _are(count: int) -> str:
    return "is" if count == 1 else "are"


def recording_quality(session: Session, campaigns: Sequence[int]) -> dict[int, RecordingQuality]:
    """By key of the campaign. A recording counts once, with its worst finding."""
    of_these = Recording.campaign_id.in_(campaigns)
    by_severity: dict[str, dict[int, set[int]]] = {}
    for severity in ("reject", "warning"):
        query = select(Recording.campaign_id, Recording.id).join(
            QualityFinding, QualityFinding.recording_id == Recording.id
        )
        keys = by_severity.setdefault(severity, {})
        for campaign, recording in session.execute(
            query.where(of_these, QualityFinding.severity == severity).distinct()
        ):
            keys.setdefault(campaign, set()).add(recording)
    counted = select(Recording.campaign_id, Recording.status, func.count()).where(of_these)
    counts: dict[tuple[int, str], int] = {}
    for campaign, status, count in session.execute(
        counted.group_by(Recording.campaign_id, Recording.status)
    ):
        counts[campaign, status] = count
    quality = {}
    for key in campaigns:
        rejected = by_severity["reject"].get(key, set())
        warned = by_severity["warning"].get(key, set()) - rejected
        stored, set_aside = (counts.get((key, status), 0) for status in (STORED, SET_ASIDE))
        quality[key] = RecordingQuality(stored, len(rejected), len(warned), set_aside)
    return quality


_LOOK = "Look at the impact, and discard its recording if the fault is real."
#: Check -> what it says in the words of a bench, and what to do about it.
_ADVICE: dict[str, tuple[str, str]] = {
    "clipping": (
        "The record is cut off at its extreme",
        "Choose a larger range of the amplifier; repeat the run.",
    ),
    "saturation": (
        "The sensor or amplifier saturates",
        "Choose a larger range or a stiffer sensor; repeat the run.",
    ),
    "zero-shift": (
        "The level after the shock differs from the level before it",
        "Check the mounting and the cable of the sensor; do not use its low frequencies.",
    ),
    "dropouts": (
        "Samples are missing or stand still",
        "Check the connection and the converter; repeat the run.",
    ),
    "placeholder": (
        "A sample is a placeholder, no reading",
        "Export the record again without placeholders, or mend the sample in the file.",
    ),
    "resampled-time": (
        "The time of the record was uneven, and it is resampled",
        "Record with an even sampling rate where the stated error matters.",
    ),
    "rest-level": ("The sensor does not rest at zero", "Check its offset and its mounting."),
    "noise-floor": (
        "Low lines of the spectrum show noise",
        "Use the spectrum above the frequency of the finding.",
    ),
    "no-shock": ("The channel shows no shock", "Check the sensor, its cable and the trigger."),
    "no-contact": (
        "The force shows no contact",
        "Check the force sensor and the trigger, or discard the recording.",
    ),
    "velocity": (
        "The integrated acceleration does not come to rest",
        "Do not use low frequencies of this channel.",
    ),
    "displacement": (
        "The integrated acceleration moves too far",
        "Do not use low frequencies of this channel.",
    ),
    "truncation": ("The record ends while the structure rings", "Record for longer."),
    "truncated-contact": (
        "The record begins or ends within the contact",
        "Set a longer record or an earlier trigger.",
    ),
    "balance": ("Positive and negative spectrum differ", "Check for zero shift and saturation."),
    "pre-trigger-noise": ("The record is noisy before the contact", "Check earthing and cables."),
    "few-samples": ("A contact has few samples", "Choose a higher sampling rate."),
    "sampling": (
        "The highest line is too fast for the sampling rate",
        "Choose a higher sampling rate.",
    ),
    "double-hit": ("The hammer touched twice", "Leave the impact out, or repeat it."),
    "missing-channel": (
        "A channel of campaign.toml is not in the file",
        "Correct campaign.toml, or record it.",
    ),
    "undeclared-channel": (
        "A channel is not declared in campaign.toml",
        "Declare it, if it is to be stored.",
    ),
    "threshold-raised": (
        "Noise hides the ends of a contact",
        "Extract the pulses again with a higher threshold.",
    ),
    "same-recording": (
        "The samples are those of another recording",
        "Check which of the two files is right.",
    ),
    "velocity-differs": (
        "The velocity of runs.csv is not the laser's",
        "Check the row, bullet_length_mm and the laser's sampling rate.",
    ),
    "pressure-differs": (
        "The tank pressure of runs.csv is not the recorded one",
        "Check the row, and the calibration of the transducer.",
    ),
    "no-rest-before-drop": (
        "The record begins within the drop of the tank's pressure",
        "Begin the recording earlier (a longer pre-trigger).",
    ),
    "no-impact-velocity": (
        "The velocity of an impact is unknown",
        "Add impact_velocity_m_s to runs.csv.",
    ),
}


@dataclass(frozen=True)
class FindingRow:
    """Findings of one cause and severity; `impacts` that they concern, by key, and the `runs` of
    these."""

    check: str
    cause: str
    severity: str
    findings: int
    channels: str
    impacts: tuple[int, ...]
    runs: tuple[int, ...]
    action: str


def list_finding_rows(
    session: Session, campaign: int, findings: Sequence[dict[str, Any]]
) -> list[FindingRow]:
    """Rows of the quality summary, from what `count_findings` gives; those without an advice of
    their own are named by their check."""
    rows = []
    for row in findings:
        check, severity = row["check"], row["severity"]
        cause, action = _ADVICE.get(check, (check.replace("-", " ").capitalize(), _LOOK))
        if severity == "note":
            action = "This is for information. " + action
        concerned = _impacts(session, campaign, check, severity)
        impacts, runs = tuple(concerned), tuple(sorted(set(concerned.values())))
        rows.append(
            FindingRow(
                check,
                cause,
                severity,
                row["findings"],
                row["channels"] or "",
                impacts,
                runs,
                action,
            )
        )
    return rows


def _impacts(session: Session, campaign: int, check: str, severity: str) -> dict[int, int]:
    """Impacts that findings name, or that are in the recordings that they are of, with the run of
    each."""
    named = (
        select(Impact.id, Impact.run)
        .join(
            QualityFinding,
            (QualityFinding.recording_id == Impact.recording_id)
            & (QualityFinding.impact_id.is_(None) | (QualityFinding.impact_id == Impact.id)),
        )
        .where(
            Impact.campaign_id == campaign,
            QualityFinding.check == check,
            QualityFinding.severity == severity,
        )
    )
    return dict(iter(session.execute(named.distinct().order_by(Impact.id))))


#: Check -> the key of its evidence that is larger the worse a finding is.
_EXTENT = {
    "clipping": "share",
    "saturation": "share",
    "velocity": "velocity_ratio",
    "displacement": "displacement_ratio",
    "zero-shift": "peak_share",
    "pre-trigger-noise": "sigma_to_peak",
    "truncation": "peak_share",
    "balance": "ratio_db",
    "sampling": "hidden_share",
}


def worst_finding(session: Session, campaign: int, row: FindingRow) -> str:
    """The finding of a row that goes furthest, of checks without such a number the first: where it
    is, and its message in the shown units."""
    query = (
        select(
            Recording.path,
            Impact.run,
            Impact.repetition,
            RecordedChannel.name,
            QualityFinding.message,
        )
        .select_from(QualityFinding)
        .join(Recording, QualityFinding.recording_id == Recording.id)
        .outerjoin(Impact, QualityFinding.impact_id == Impact.id)
        .outerjoin(RecordedChannel, QualityFinding.channel_id == RecordedChannel.id)
        .where(
            Recording.campaign_id == campaign,
            QualityFinding.check == row.check,
            QualityFinding.severity == row.severity,
        )
        .order_by(QualityFinding.id)
    )
    if row.check in _EXTENT:
        extent = QualityFinding.evidence[_EXTENT[row.check]].as_float()
        query = query.order_by(None).order_by(extent.desc().nulls_last(), QualityFinding.id)
    path, run, repetition, channel, message = session.execute(query.limit(1)).one()
    where = path if run is None else f"run {run}, repetition {repetition}"
    return f"{where}{f', {channel}' if channel else ''}: {in_shown_units(message)}"
