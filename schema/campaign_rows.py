"""Which rows belong to a campaign, in every table that a campaign has rows in."""

from __future__ import annotations

from typing import Any

from sqlalchemy import ColumnElement, Select, and_, false, or_, select, union

from .attachments import PLAN, AttachedContent, AttachedPiece, Attachment
from .benches import Gun, Hammer, Material, MaterialAlias, ModalTable, Mode, ModeShape, Plate
from .campaigns import (
    Campaign,
    Configuration,
    ConfigurationLevel,
    Factor,
    FactorLevel,
    Plan,
    PlannedRun,
)
from .corrections import FactCorrection
from .diagnoses import Diagnosis
from .impacts import ChannelFigures, ExtractionSettingsRow, Impact, Pulse, Shot
from .notes import CAMPAIGN, IMPACT, RUN
from .recordings import QualityFinding, RecordedChannel, Recording, SeriesChunk
from .run_predictions import RunPrediction


def members_of_recording(campaign: int, recording: int) -> dict[str, ColumnElement[bool]]:
    """The rows of one recording with what they need of its campaign, as `members` has them; what
    was made from the campaign as a whole is left out."""
    chosen = members(campaign)
    channels = select(RecordedChannel.id).where(RecordedChannel.recording_id == recording)
    impacts = select(Impact.id).where(Impact.recording_id == recording)
    return chosen | {
        "recordings": Recording.id == recording,
        "channels": RecordedChannel.recording_id == recording,
        "series_chunks": SeriesChunk.channel_id.in_(channels),
        "impacts": Impact.recording_id == recording,
        "pulses": Pulse.impact_id.in_(impacts),
        "channel_figures": ChannelFigures.impact_id.in_(impacts),
        "shots": Shot.recording_id == recording,
        "quality_findings": QualityFinding.recording_id == recording,
        "diagnoses": false(),
        "fact_corrections": false(),
        "attachments": false(),
        "attached_contents": false(),
        "attached_pieces": false(),
        "run_predictions": false(),
    }


def members(campaign: int) -> dict[str, ColumnElement[bool]]:
    """The rows of the campaign with this key, as a condition on each table; the writers' are left
    open."""
    own = Campaign.id == campaign
    plates = select(Campaign.plate_id).where(own)
    tables = select(Plate.modal_table_id).where(Plate.id.in_(plates))
    modes = select(Mode.id).where(Mode.table_id.in_(tables))
    recordings = select(Recording.id).where(Recording.campaign_id == campaign)
    channels = select(RecordedChannel.id).where(RecordedChannel.recording_id.in_(recordings))
    impacts = select(Impact.id).where(Impact.campaign_id == campaign)
    plans = _plans(campaign)
    planned = select(PlannedRun.configuration_id).where(PlannedRun.plan_id.in_(plans))
    configurations = or_(
        Configuration.id.in_(_of_hits(campaign, "configuration_id")), Configuration.id.in_(planned)
    )
    chosen = ConfigurationLevel.configuration_id.in_(select(Configuration.id).where(configurations))
    levels = select(ConfigurationLevel.level_id).where(chosen)
    factors = select(FactorLevel.factor_id).where(FactorLevel.id.in_(levels))
    materials = or_(
        Material.id.in_(select(FactorLevel.material_id).where(FactorLevel.id.in_(levels))),
        Material.id.in_(select(Plate.material_id).where(Plate.id.in_(plates))),
    )
    pulses = Pulse.impact_id.in_(impacts)
    attached = _attached(campaign, plans)
    contents = select(Attachment.content_id).where(attached)
    return {
        "campaigns": own,
        "guns": Gun.id.in_(select(Campaign.gun_id).where(own)),
        "hammers": Hammer.id.in_(select(Campaign.hammer_id).where(own)),
        "plates": Plate.id.in_(plates),
        "modal_tables": ModalTable.id.in_(tables),
        "modes": Mode.table_id.in_(tables),
        "mode_shapes": ModeShape.mode_id.in_(modes),
        "materials": materials,
        "material_aliases": MaterialAlias.material_id.in_(select(Material.id).where(materials)),
        "configurations": configurations,
        "configuration_levels": chosen,
        "factor_levels": FactorLevel.id.in_(levels),
        "factors": Factor.id.in_(factors),
        "plans": Plan.id.in_(plans),
        "planned_runs": PlannedRun.plan_id.in_(plans),
        "run_predictions": RunPrediction.planned_run_id.in_(
            select(PlannedRun.id).where(PlannedRun.plan_id.in_(plans))
        ),
        "recordings": Recording.campaign_id == campaign,
        "channels": RecordedChannel.recording_id.in_(recordings),
        "series_chunks": SeriesChunk.channel_id.in_(channels),
        "impacts": Impact.campaign_id == campaign,
        "pulses": pulses,
        "channel_figures": ChannelFigures.impact_id.in_(impacts),
        "extraction_settings": ExtractionSettingsRow.id.in_(
            select(Pulse.settings_id).where(pulses)
        ),
        "shots": Shot.campaign_id == campaign,
        "quality_findings": QualityFinding.recording_id.in_(recordings),
        "diagnoses": Diagnosis.campaign_id == campaign,
        "fact_corrections": FactCorrection.campaign_id == campaign,
        "attachments": attached,
        "attached_contents": AttachedContent.id.in_(contents),
        "attached_pieces": AttachedPiece.content_id.in_(contents),
    }


def attached_to_campaign(campaign: int) -> ColumnElement[bool]:
    """The attachments of the campaign with this key and of its impacts, as a condition on
    `attachments`: those that go with it. What is attached to its plans and their runs stays with
    the plans."""
    name = select(Campaign.name).where(Campaign.id == campaign).scalar_subquery()
    return and_(Attachment.subject_kind.in_((CAMPAIGN, IMPACT)), Attachment.subject == name)


def attached_with_campaign(campaign: int) -> ColumnElement[bool]:
    """The attachments of the campaign with this key and of its impacts, and those of the plans that
    it was recorded by and of their runs, as a condition on `attachments`."""
    return _attached(campaign, _plans(campaign))


def _attached(campaign: int, plans: Select[Any]) -> ColumnElement[bool]:
    names = select(Plan.name).where(Plan.id.in_(plans))
    of_plans = and_(Attachment.subject_kind.in_((PLAN, RUN)), Attachment.subject.in_(names))
    return or_(attached_to_campaign(campaign), of_plans)


def _plans(campaign: int) -> Select[Any]:
    """The plans by which a campaign was recorded."""
    runs = _of_hits(campaign, "planned_run_id")
    return select(PlannedRun.plan_id).where(PlannedRun.id.in_(runs))


def _of_hits(campaign: int, column: str) -> Select[Any]:
    """What the campaign's impacts and shots point at."""
    both = union(
        *(
            select(getattr(table, column).label("key")).where(table.campaign_id == campaign)
            for table in (Impact, Shot)
        )
    ).subquery()
    return select(both.c.key).where(both.c.key.is_not(None))
