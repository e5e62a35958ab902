"""Which rows belong to a campaign, by what a row from elsewhere is known here, and what must agree where it is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from sqlalchemy import ColumnElement, Select, Table, or_, select, union

from ..benches import Gun, Hammer, Material, MaterialAlias, ModalTable, Mode, ModeShape, Plate
from ..campaigns import Campaign, Configuration, ConfigurationLevel, Factor, FactorLevel, Plan, PlannedRun
from ..diagnoses import Diagnosis
from ..impacts import ChannelFigures, ExtractionSettingsRow, Impact, Pulse, Shot
from ..recordings import QualityFinding, RecordedChannel, Recording, SeriesChunk
from ..tables import metadata

#: A row as it is stored, its references those of the store that takes it.
Row = Mapping[str, Any]


@dataclass(frozen=True)
class MergeRule:
    """How the rows of a table are merged.

    A row whose `key` (unique columns) is here stays as it is here, if `same` gives the same values for both: else it
    is another thing under one name. With an `owner` (a column), rows come in only along with a row that was new.
    """

    table: str
    key: tuple[str, ...] = ()
    owner: str | None = None
    same: Callable[[Row], Mapping[str, Any]] = lambda _: {}
    advice: str = "one of the two needs another name"

    @property
    def of(self) -> Table:
        return metadata.tables[self.table]


def columns(*names: str) -> Callable[[Row], Mapping[str, Any]]:
    """These columns must agree."""
    return lambda row: {name: row[name] for name in names}


def _impact(row: Row) -> Mapping[str, Any]:
    """Reported velocities are the laboratory's word; others follow from the record."""
    velocity = row["impact_velocity_m_s"] if row["velocity_source"] == "reported" else None
    return {**columns("configuration_id", "recording_id")(row), "reported velocity": velocity}


def _shot(row: Row) -> Mapping[str, Any]:
    velocity = row["measured_velocity_m_s"] if row["velocity_source"] == "reported" else None
    agreed = columns("configuration_id", "recording_id", "tank_pressure_pa", "bullet_mass_kg")(row)
    return {**agreed, "reported velocity": velocity}


_OTHER_RUN = "a corrected run gets a number of its own; import into a store of its own to compare"
_CONSTANTS = ("youngs_modulus_pa", "poisson_ratio", "density_kg_m3", "yield_strength_pa")
_PLANNED = ("position", "repetitions", "configuration_id", "treatment", "settings")

#: In the order of their references. A fingerprint vouches for a row's content (`care.checks.fingerprints`).
RULES = (
    MergeRule("materials", ("name",), same=columns(*_CONSTANTS)),
    MergeRule("material_aliases", ("alias",)),
    MergeRule("guns", ("fingerprint",)),
    MergeRule("hammers", ("fingerprint",)),
    MergeRule("modal_tables", ("fingerprint",)),
    MergeRule("modes", owner="table_id"),
    MergeRule("mode_shapes", owner="mode_id"),
    MergeRule("plates", ("fingerprint",)),
    MergeRule("factors", ("name",), same=columns("si_unit")),
    MergeRule("factor_levels", ("factor_id", "label"), same=columns("number", "material_id")),
    MergeRule("configurations", ("fingerprint",)),
    MergeRule("configuration_levels", owner="configuration_id"),
    MergeRule("extraction_settings", ("fingerprint",)),
    MergeRule("campaigns", ("name",), same=columns("kind", "fingerprint"), advice="import it into a store of its own"),
    MergeRule("plans", ("name",), same=columns("kind", "factors", "method", "seed")),
    MergeRule("planned_runs", ("plan_id", "run"), same=columns(*_PLANNED), advice="import it into a store of its own"),
    MergeRule("recordings", ("campaign_id", "path"), same=columns("status", "sha256"), advice=_OTHER_RUN),
    MergeRule("channels", owner="recording_id"),
    MergeRule("series_chunks", owner="channel_id"),
    MergeRule("impacts", ("campaign_id", "run", "repetition"), same=_impact, advice=_OTHER_RUN),
    MergeRule("pulses", ("impact_id", "settings_id")),
    MergeRule("channel_figures", owner="channel_id"),
    MergeRule("shots", ("campaign_id", "run", "repetition"), same=_shot, advice=_OTHER_RUN),
    MergeRule("quality_findings", owner="recording_id"),
    MergeRule("diagnoses", ("campaign_id", "simulator", "diagnosed_at")),
)


#: A dataset and an adopted effect are a laboratory's own choice, from campaigns of its own; a job is a machine's, and a
#: tombstone tells of what that store no longer has.
STAY_BEHIND = frozenset({"dataset_snapshots", "snapshot_pulses", "twin_configurations", "jobs", "tombstones"})
#: Follows from the rows that were taken: who wrote them.
WRITERS = "provenance"


def members(campaign: int) -> dict[str, ColumnElement[bool]]:
    """The rows of the campaign with this key, as a condition on each table; the writers' are left open."""
    own = Campaign.id == campaign
    plates = select(Campaign.plate_id).where(own)
    tables = select(Plate.modal_table_id).where(Plate.id.in_(plates))
    modes = select(Mode.id).where(Mode.table_id.in_(tables))
    recordings = select(Recording.id).where(Recording.campaign_id == campaign)
    channels = select(RecordedChannel.id).where(RecordedChannel.recording_id.in_(recordings))
    impacts = select(Impact.id).where(Impact.campaign_id == campaign)
    runs = _of_hits(campaign, "planned_run_id")
    plans = select(PlannedRun.plan_id).where(PlannedRun.id.in_(runs))
    planned = select(PlannedRun.configuration_id).where(PlannedRun.plan_id.in_(plans))
    configurations = or_(Configuration.id.in_(_of_hits(campaign, "configuration_id")), Configuration.id.in_(planned))
    chosen = ConfigurationLevel.configuration_id.in_(select(Configuration.id).where(configurations))
    levels = select(ConfigurationLevel.level_id).where(chosen)
    factors = select(FactorLevel.factor_id).where(FactorLevel.id.in_(levels))
    materials = or_(
        Material.id.in_(select(FactorLevel.material_id).where(FactorLevel.id.in_(levels))),
        Material.id.in_(select(Plate.material_id).where(Plate.id.in_(plates))),
    )
    pulses = Pulse.impact_id.in_(impacts)
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
        "recordings": Recording.campaign_id == campaign,
        "channels": RecordedChannel.recording_id.in_(recordings),
        "series_chunks": SeriesChunk.channel_id.in_(channels),
        "impacts": Impact.campaign_id == campaign,
        "pulses": pulses,
        "channel_figures": ChannelFigures.impact_id.in_(impacts),
        "extraction_settings": ExtractionSettingsRow.id.in_(select(Pulse.settings_id).where(pulses)),
        "shots": Shot.campaign_id == campaign,
        "quality_findings": QualityFinding.recording_id.in_(recordings),
        "diagnoses": Diagnosis.campaign_id == campaign,
    }


def _of_hits(campaign: int, column: str) -> Select[Any]:
    """What the campaign's impacts and shots point at."""
    both = union(
        *(select(getattr(table, column).label("key")).where(table.campaign_id == campaign) for table in (Impact, Shot))
    ).subquery()
    return select(both.c.key).where(both.c.key.is_not(None))
