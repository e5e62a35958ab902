"""the tables of a store, with the functions and roles of one on PostgreSQL

The first revision that a release reads is 0013: stores that were made before the first release
begin here, and keep their number. Tables are written out, and are not the models: a revision stays
as it is when a later one changes the models.
"""

from __future__ import annotations

from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0013"
down_revision = None
branch_labels = None
depends_on = None

_METADATA = sa.MetaData(
    naming_convention={
        "ix": "ix_%(table_name)s_%(column_0_N_name)s",
        "uq": "uq_%(table_name)s_%(column_0_N_name)s",
        "ck": "ck_%(table_name)s_%(constraint_name)s",
        "fk": "fk_%(table_name)s_%(column_0_name)s_%(referred_table_name)s",
        "pk": "pk_%(table_name)s",
    }
)


def upgrade() -> None:
    connection = op.get_bind()
    _METADATA.create_all(connection, checkfirst=False)
    if connection.dialect.name != "postgresql":
        return
    from pyroshock.schema.access.roles import act_as_owner, grant_roles, names_in, run

    names = names_in(connection)
    for function in _FUNCTIONS:
        run(connection, function, names)
    for signature in _SIGNATURES:
        run(connection, f"REVOKE ALL ON FUNCTION {{schema}}.{signature} FROM PUBLIC", names)
    # Without CREATEROLE there are no roles: `pyroshock db roles` says so, and makes them.
    if grant_roles(connection):
        act_as_owner(connection)


def _table(name: str, *parts: sa.schema.SchemaItem) -> None:
    """A table with the index of the rows that a transaction has still to seal."""
    key = [part.name for part in parts if isinstance(part, sa.Column) and part.primary_key]
    unsealed = _where("row_sha256 = 'unsealed'")
    sa.Table(name, _METADATA, *parts, sa.Index(f"ix_{name}_unsealed", *key, **unsealed))


def _id() -> sa.Column[int]:
    return sa.Column("id", sa.Integer(), primary_key=True)


def _writer() -> sa.Column[int]:
    return sa.Column("written_by_id", sa.Integer(), sa.ForeignKey("provenance.id"), nullable=False)


def _row_hash() -> sa.Column[str]:
    return sa.Column("row_sha256", sa.String())


def _where(condition: str) -> dict[str, Any]:
    return {"sqlite_where": sa.text(condition), "postgresql_where": sa.text(condition)}


_table(
    "provenance",
    sa.Column("software_version", sa.String(), nullable=False),
    sa.Column("command", sa.String(), nullable=False),
    sa.Column("user", sa.String(), nullable=False),
    sa.Column("host", sa.String(), nullable=False),
    sa.Column("started_at", sa.DateTime(timezone=True), nullable=False),
    _id(),
    _row_hash(),
)
_table(
    "configurations",
    sa.Column("fingerprint", sa.String(), nullable=False),
    _id(),
    _writer(),
    _row_hash(),
    sa.UniqueConstraint("fingerprint"),
)
_table(
    "dataset_snapshots",
    sa.Column("name", sa.String(), nullable=False),
    sa.Column("content_hash", sa.String(), nullable=False),
    sa.Column("frozen_at", sa.DateTime(timezone=True), nullable=False),
    sa.Column("definition", sa.JSON(), nullable=False),
    _id(),
    _writer(),
    _row_hash(),
    sa.CheckConstraint("length(content_hash) = 64", name="content_hash_length"),
    sa.UniqueConstraint("content_hash"),
    sa.UniqueConstraint("name"),
)
_table(
    "extraction_settings",
    sa.Column("fingerprint", sa.String(), nullable=False),
    sa.Column("code_version", sa.Integer(), nullable=False),
    sa.Column("settings", sa.JSON(), nullable=False),
    _id(),
    _writer(),
    _row_hash(),
    sa.CheckConstraint("code_version >= 1", name="code_version_positive"),
    sa.UniqueConstraint("fingerprint"),
)
_table(
    "factors",
    sa.Column("name", sa.String(), nullable=False),
    sa.Column("si_unit", sa.String()),
    sa.Column("description", sa.String()),
    _id(),
    _writer(),
    _row_hash(),
    sa.UniqueConstraint("name"),
)
_table(
    "guns",
    sa.Column("fingerprint", sa.String(), nullable=False),
    sa.Column("tank_volume_m3", sa.Double(), nullable=False),
    sa.Column("bore_diameter_m", sa.Double(), nullable=False),
    sa.Column("projectile_diameter_m", sa.Double(), nullable=False),
    sa.Column("travel_m", sa.Double(), nullable=False),
    sa.Column("friction_coefficient", sa.Double(), nullable=False),
    sa.Column("heat_capacity_ratio", sa.Double(), nullable=False),
    sa.Column("efficiency", sa.Double(), nullable=False),
    _id(),
    _writer(),
    _row_hash(),
    sa.CheckConstraint(
        "bore_diameter_m IS NULL OR bore_diameter_m > 0", name="bore_diameter_positive"
    ),
    sa.CheckConstraint("efficiency > 0 AND efficiency <= 1", name="efficiency_share"),
    sa.CheckConstraint(
        "friction_coefficient IS NULL OR friction_coefficient >= 0", name="friction_not_negative"
    ),
    sa.CheckConstraint("heat_capacity_ratio >= 1", name="heat_capacity_ratio_physical"),
    sa.CheckConstraint(
        "projectile_diameter_m IS NULL OR projectile_diameter_m > 0",
        name="projectile_diameter_positive",
    ),
    sa.CheckConstraint("projectile_diameter_m <= bore_diameter_m", name="projectile_fits_bore"),
    sa.CheckConstraint("tank_volume_m3 IS NULL OR tank_volume_m3 > 0", name="tank_volume_positive"),
    sa.CheckConstraint("travel_m IS NULL OR travel_m > 0", name="travel_positive"),
    sa.UniqueConstraint("fingerprint"),
)
_table(
    "hammers",
    sa.Column("fingerprint", sa.String(), nullable=False),
    sa.Column("mass_kg", sa.Double(), nullable=False),
    _id(),
    _writer(),
    _row_hash(),
    sa.CheckConstraint("mass_kg IS NULL OR mass_kg > 0", name="mass_positive"),
    sa.UniqueConstraint("fingerprint"),
)
_table(
    "jobs",
    sa.Column("kind", sa.String(), nullable=False),
    sa.Column("label", sa.String(), nullable=False),
    sa.Column("arguments", sa.JSON(), nullable=False),
    sa.Column("host", sa.String()),
    sa.Column("state", sa.String(), nullable=False),
    sa.Column("attempt", sa.Integer(), nullable=False),
    sa.Column("deaths", sa.Integer(), nullable=False),
    sa.Column("worker", sa.String()),
    sa.Column("lease_s", sa.Double()),
    sa.Column("beat", sa.Integer(), nullable=False),
    sa.Column("stop_requested", sa.Boolean(), nullable=False),
    sa.Column("done", sa.Integer(), nullable=False),
    sa.Column("total", sa.Integer(), nullable=False),
    sa.Column("what", sa.Text(), nullable=False),
    sa.Column("error", sa.Text()),
    sa.Column("address", sa.String()),
    sa.Column("words", sa.Text()),
    sa.Column("result", sa.JSON()),
    sa.Column("asked_at", sa.DateTime(timezone=True), nullable=False),
    sa.Column("started_at", sa.DateTime(timezone=True)),
    sa.Column("ended_at", sa.DateTime(timezone=True)),
    _id(),
    _writer(),
    _row_hash(),
    sa.CheckConstraint("attempt IS NULL OR attempt >= 0", name="attempt_not_negative"),
    sa.CheckConstraint("beat IS NULL OR beat >= 0", name="beat_not_negative"),
    sa.CheckConstraint("deaths IS NULL OR deaths >= 0", name="deaths_not_negative"),
    sa.CheckConstraint("done IS NULL OR done >= 0", name="done_not_negative"),
    sa.CheckConstraint("state <> 'done' OR address IS NOT NULL", name="done_with_address"),
    sa.CheckConstraint(
        "(ended_at IS NOT NULL) = (state IN ('done', 'failed', 'stopped'))", name="ended_when_over"
    ),
    sa.CheckConstraint("(error IS NOT NULL) = (state = 'failed')", name="failed_with_error"),
    sa.CheckConstraint("lease_s IS NULL OR lease_s > 0", name="lease_positive"),
    sa.CheckConstraint(
        "state <> 'running' OR (worker IS NOT NULL AND lease_s IS NOT NULL AND attempt > 0)",
        name="running_with_worker",
    ),
    sa.CheckConstraint(
        "state IN ('waiting', 'running', 'done', 'failed', 'stopped')", name="state_known"
    ),
    sa.CheckConstraint("total IS NULL OR total >= 0", name="total_not_negative"),
    sa.Index("ix_jobs_state_id", "state", "id"),
)
_table(
    "materials",
    sa.Column("name", sa.String(), nullable=False),
    sa.Column("youngs_modulus_pa", sa.Double(), nullable=False),
    sa.Column("poisson_ratio", sa.Double(), nullable=False),
    sa.Column("density_kg_m3", sa.Double(), nullable=False),
    sa.Column("yield_strength_pa", sa.Double(), nullable=False),
    sa.Column("source", sa.String(), nullable=False),
    _id(),
    _writer(),
    _row_hash(),
    sa.CheckConstraint("density_kg_m3 IS NULL OR density_kg_m3 > 0", name="density_positive"),
    sa.CheckConstraint("poisson_ratio > -1 AND poisson_ratio < 0.5", name="poisson_ratio_physical"),
    sa.CheckConstraint(
        "yield_strength_pa IS NULL OR yield_strength_pa > 0", name="yield_strength_positive"
    ),
    sa.CheckConstraint(
        "youngs_modulus_pa IS NULL OR youngs_modulus_pa > 0", name="youngs_modulus_positive"
    ),
    sa.UniqueConstraint("name"),
)
_table(
    "modal_tables",
    sa.Column("fingerprint", sa.String(), nullable=False),
    _id(),
    _writer(),
    _row_hash(),
    sa.UniqueConstraint("fingerprint"),
)
_table(
    "plans",
    sa.Column("name", sa.String(), nullable=False),
    sa.Column("kind", sa.String(), nullable=False),
    sa.Column("factors", sa.String(), nullable=False),
    sa.Column("method", sa.String(), nullable=False),
    sa.Column("seed", sa.Integer()),
    sa.Column("description", sa.String()),
    _id(),
    _writer(),
    _row_hash(),
    sa.CheckConstraint("kind IN ('hammer', 'gun')", name="kind_known"),
    sa.UniqueConstraint("name"),
)
_table(
    "registered_versions",
    sa.Column("label", sa.String(), nullable=False),
    sa.Column("name", sa.String(), nullable=False),
    sa.Column("version", sa.Integer(), nullable=False),
    sa.Column("dataset", sa.String(), nullable=False),
    sa.Column("dataset_hash", sa.String(), nullable=False),
    sa.Column("sha256", sa.String(), nullable=False),
    sa.Column("registry_address", sa.String(), nullable=False),
    sa.Column("registered_at", sa.DateTime(timezone=True), nullable=False),
    sa.Column("record", sa.JSON(), nullable=False),
    _id(),
    _writer(),
    _row_hash(),
    sa.CheckConstraint("length(dataset_hash) = 64", name="dataset_hash_length"),
    sa.CheckConstraint("length(sha256) = 64", name="sha256_length"),
    sa.CheckConstraint("version > 0", name="version_positive"),
    sa.UniqueConstraint("label", "sha256"),
    sa.Index("ix_registered_versions_dataset_hash", "dataset_hash"),
)
_table(
    "tombstones",
    sa.Column("kind", sa.String(), nullable=False),
    sa.Column("campaign", sa.String(), nullable=False),
    sa.Column("recording", sa.String()),
    sa.Column("content_hash", sa.String(), nullable=False),
    sa.Column("deleted_at", sa.DateTime(timezone=True), nullable=False),
    sa.Column("reason", sa.String(), nullable=False),
    sa.Column("counts", sa.JSON(), nullable=False),
    sa.Column("stood_on", sa.JSON(), nullable=False),
    _id(),
    _writer(),
    sa.Column("file_sha256", sa.String()),
    sa.Column("replaced_by", sa.String()),
    sa.Column("archive_path", sa.String()),
    sa.Column("archive_sha256", sa.String()),
    sa.Column("restored_at", sa.DateTime(timezone=True)),
    _row_hash(),
    sa.CheckConstraint(
        "archive_sha256 IS NULL OR (length(archive_sha256) = 64 AND kind = 'campaign')",
        name="archive_of_campaign",
    ),
    sa.CheckConstraint(
        "(archive_path IS NULL) = (archive_sha256 IS NULL)", name="archive_with_sha256"
    ),
    sa.CheckConstraint("length(content_hash) = 64", name="content_hash_length"),
    sa.CheckConstraint(
        "file_sha256 IS NULL OR (length(file_sha256) = 64 AND kind = 'recording')",
        name="file_sha256_of_recording",
    ),
    sa.CheckConstraint("kind IN ('campaign', 'recording')", name="kind_known"),
    sa.CheckConstraint("(kind = 'recording') = (recording IS NOT NULL)", name="recording_named"),
    sa.CheckConstraint(
        "replaced_by IS NULL OR (length(replaced_by) = 64 AND kind = 'recording')",
        name="replaced_by_of_recording",
    ),
    sa.CheckConstraint("length(reason) > 0", name="with_reason"),
)
_table(
    "factor_levels",
    sa.Column("factor_id", sa.Integer(), sa.ForeignKey("factors.id"), nullable=False),
    sa.Column("label", sa.String(), nullable=False),
    sa.Column("number", sa.Double()),
    sa.Column("material_id", sa.Integer(), sa.ForeignKey("materials.id")),
    _id(),
    _writer(),
    _row_hash(),
    sa.UniqueConstraint("factor_id", "label"),
)
_table(
    "material_aliases",
    sa.Column("material_id", sa.Integer(), sa.ForeignKey("materials.id"), nullable=False),
    sa.Column("alias", sa.String(), nullable=False),
    _id(),
    _writer(),
    _row_hash(),
    sa.UniqueConstraint("alias"),
    sa.Index("ix_material_aliases_material_id", "material_id"),
)
_table(
    "modes",
    sa.Column("table_id", sa.Integer(), sa.ForeignKey("modal_tables.id"), nullable=False),
    sa.Column("number", sa.Integer(), nullable=False),
    sa.Column("frequency_hz", sa.Double(), nullable=False),
    sa.Column("damping_ratio", sa.Double(), nullable=False),
    sa.Column("shape_impact_per_sqrt_kg", sa.Double(), nullable=False),
    _id(),
    _writer(),
    _row_hash(),
    sa.CheckConstraint("damping_ratio >= 0 AND damping_ratio < 1", name="damping_below_critical"),
    sa.CheckConstraint("frequency_hz >= 0", name="frequency_not_negative"),
    sa.UniqueConstraint("table_id", "number"),
)
_table(
    "planned_runs",
    sa.Column("plan_id", sa.Integer(), sa.ForeignKey("plans.id"), nullable=False),
    sa.Column("run", sa.Integer(), nullable=False),
    sa.Column("position", sa.Integer(), nullable=False),
    sa.Column("repetitions", sa.Integer(), nullable=False),
    sa.Column("configuration_id", sa.Integer(), sa.ForeignKey("configurations.id"), nullable=False),
    sa.Column("treatment", sa.JSON(), nullable=False),
    sa.Column("settings", sa.JSON(), nullable=False),
    sa.Column("status", sa.String(), nullable=False),
    sa.Column("reason", sa.String()),
    _id(),
    _writer(),
    _row_hash(),
    sa.CheckConstraint("status <> 'discarded' OR reason IS NOT NULL", name="discarded_with_reason"),
    sa.CheckConstraint("repetitions >= 1", name="repetitions_positive"),
    sa.CheckConstraint("status IN ('planned', 'done', 'discarded')", name="status_known"),
    sa.UniqueConstraint("plan_id", "position"),
    sa.UniqueConstraint("plan_id", "run"),
    sa.Index("ix_planned_runs_configuration_id", "configuration_id"),
    sa.Index("ix_planned_runs_plan_status", "plan_id", "status"),
)
_table(
    "plates",
    sa.Column("fingerprint", sa.String(), nullable=False),
    sa.Column("modal_table_id", sa.Integer(), sa.ForeignKey("modal_tables.id")),
    sa.Column("material_id", sa.Integer(), sa.ForeignKey("materials.id")),
    sa.Column("thickness_m", sa.Double()),
    sa.Column("outline_m", sa.JSON()),
    _id(),
    _writer(),
    _row_hash(),
    sa.CheckConstraint(
        "modal_table_id IS NOT NULL OR (material_id IS NOT NULL AND thickness_m IS NOT NULL)",
        name="described",
    ),
    sa.CheckConstraint("thickness_m IS NULL OR thickness_m > 0", name="thickness_positive"),
    sa.UniqueConstraint("fingerprint"),
)
_table(
    "campaigns",
    sa.Column("name", sa.String(), nullable=False),
    sa.Column("kind", sa.String(), nullable=False),
    sa.Column("date", sa.Date(), nullable=False),
    sa.Column("description", sa.String()),
    sa.Column("operator", sa.String()),
    sa.Column("gun_id", sa.Integer(), sa.ForeignKey("guns.id")),
    sa.Column("hammer_id", sa.Integer(), sa.ForeignKey("hammers.id")),
    sa.Column("plate_id", sa.Integer(), sa.ForeignKey("plates.id")),
    sa.Column("fingerprint", sa.String(), nullable=False),
    _id(),
    _writer(),
    _row_hash(),
    sa.Column("known_facts", sa.JSON()),
    sa.CheckConstraint("kind IN ('hammer', 'gun')", name="kind_known"),
    sa.UniqueConstraint("name"),
)
_table(
    "configuration_levels",
    sa.Column(
        "configuration_id", sa.Integer(), sa.ForeignKey("configurations.id"), primary_key=True
    ),
    sa.Column("level_id", sa.Integer(), sa.ForeignKey("factor_levels.id"), primary_key=True),
    sa.Column("factor_id", sa.Integer(), sa.ForeignKey("factors.id"), nullable=False),
    _writer(),
    _row_hash(),
    sa.UniqueConstraint("configuration_id", "factor_id"),
    sa.Index("ix_configuration_levels_level_id", "level_id"),
)
_table(
    "mode_shapes",
    sa.Column("mode_id", sa.Integer(), sa.ForeignKey("modes.id"), nullable=False),
    sa.Column("channel", sa.String(), nullable=False),
    sa.Column("shape_per_sqrt_kg", sa.Double(), nullable=False),
    _id(),
    _writer(),
    _row_hash(),
    sa.UniqueConstraint("mode_id", "channel"),
)
_table(
    "diagnoses",
    sa.Column("campaign_id", sa.Integer(), sa.ForeignKey("campaigns.id"), nullable=False),
    sa.Column("simulator", sa.String(), nullable=False),
    sa.Column("diagnosed_at", sa.DateTime(timezone=True), nullable=False),
    sa.Column("report", sa.JSON(), nullable=False),
    _id(),
    _writer(),
    sa.Column("details", sa.JSON()),
    _row_hash(),
    sa.Index("ix_diagnoses_campaign_id", "campaign_id"),
)
_table(
    "recordings",
    sa.Column("campaign_id", sa.Integer(), sa.ForeignKey("campaigns.id"), nullable=False),
    sa.Column("path", sa.String(), nullable=False),
    sa.Column("sha256", sa.String(), nullable=False),
    sa.Column("size_bytes", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
    sa.Column("format", sa.String(), nullable=False),
    sa.Column("status", sa.String(), nullable=False),
    sa.Column("reason", sa.String()),
    _id(),
    _writer(),
    _row_hash(),
    sa.CheckConstraint("status = 'stored' OR reason IS NOT NULL", name="set_aside_with_reason"),
    sa.CheckConstraint("length(sha256) = 64", name="sha256_length"),
    sa.CheckConstraint("status IN ('stored', 'set aside')", name="status_known"),
    sa.UniqueConstraint("campaign_id", "path"),
    sa.Index("ix_recordings_sha256", "sha256"),
)
_table(
    "channels",
    sa.Column(
        "recording_id",
        sa.Integer(),
        sa.ForeignKey("recordings.id", ondelete="CASCADE"),
        nullable=False,
    ),
    sa.Column("name", sa.String(), nullable=False),
    sa.Column("quantity", sa.String(), nullable=False),
    sa.Column("unit", sa.String(), nullable=False),
    sa.Column("sensitivity", sa.Double()),
    sa.Column("offset_v", sa.Double()),
    sa.Column("position", sa.String()),
    sa.Column("axis", sa.String()),
    sa.Column("full_scale", sa.Double()),
    sa.Column("si_unit", sa.String(), nullable=False),
    sa.Column("si_gain", sa.Double(), nullable=False),
    sa.Column("si_offset", sa.Double(), nullable=False),
    sa.Column("sampling_rate_hz", sa.Double(), nullable=False),
    sa.Column("start_s", sa.Double(), nullable=False),
    sa.Column("samples", sa.Integer(), nullable=False),
    sa.Column("dtype", sa.String(), nullable=False),
    sa.Column("chunk_samples", sa.Integer(), nullable=False),
    sa.Column("step", sa.Double()),
    sa.Column("sha256", sa.String(), nullable=False),
    sa.Column("header", sa.JSON(), nullable=False),
    _id(),
    _writer(),
    _row_hash(),
    sa.CheckConstraint("chunk_samples > 0", name="chunk_samples_positive"),
    sa.CheckConstraint("samples > 0", name="samples_positive"),
    sa.CheckConstraint(
        "sampling_rate_hz IS NULL OR sampling_rate_hz > 0", name="sampling_rate_positive"
    ),
    sa.CheckConstraint("sensitivity <> 0", name="sensitivity_not_zero"),
    sa.CheckConstraint("length(sha256) = 64", name="sha256_length"),
    sa.CheckConstraint("step IS NULL OR step > 0", name="step_positive"),
    sa.UniqueConstraint("recording_id", "name"),
    sa.Index("ix_channels_sha256", "sha256"),
)
_table(
    "impacts",
    sa.Column("campaign_id", sa.Integer(), sa.ForeignKey("campaigns.id"), nullable=False),
    sa.Column("run", sa.Integer(), nullable=False),
    sa.Column("repetition", sa.Integer(), nullable=False),
    sa.Column("configuration_id", sa.Integer(), sa.ForeignKey("configurations.id"), nullable=False),
    sa.Column("recording_id", sa.Integer(), sa.ForeignKey("recordings.id")),
    sa.Column("planned_run_id", sa.Integer(), sa.ForeignKey("planned_runs.id")),
    sa.Column("impact_velocity_m_s", sa.Double()),
    sa.Column("impact_velocity_u_m_s", sa.Double()),
    sa.Column("velocity_source", sa.String()),
    _id(),
    _writer(),
    _row_hash(),
    sa.CheckConstraint("repetition >= 1", name="repetition_positive"),
    sa.CheckConstraint("run >= 0", name="run_not_negative"),
    sa.CheckConstraint(
        "impact_velocity_m_s IS NULL OR impact_velocity_m_s >= 0", name="velocity_not_negative"
    ),
    sa.CheckConstraint(
        "impact_velocity_u_m_s IS NULL OR impact_velocity_u_m_s >= 0",
        name="velocity_u_not_negative",
    ),
    sa.CheckConstraint(
        "(impact_velocity_m_s IS NULL) = (velocity_source IS NULL)", name="velocity_with_source"
    ),
    sa.UniqueConstraint("campaign_id", "run", "repetition"),
    sa.Index("ix_impacts_campaign_id_id", "campaign_id", "id"),
    sa.Index("ix_impacts_configuration_id_id", "configuration_id", "id"),
    sa.Index("ix_impacts_planned_run_id", "planned_run_id"),
    sa.Index("ix_impacts_recording_id", "recording_id"),
)
_table(
    "twin_configurations",
    sa.Column("version", sa.Integer(), nullable=False),
    sa.Column("campaign_id", sa.Integer(), sa.ForeignKey("campaigns.id"), nullable=False),
    sa.Column("diagnosis_id", sa.Integer(), sa.ForeignKey("diagnoses.id")),
    sa.Column("adopted_at", sa.DateTime(timezone=True), nullable=False),
    sa.Column("reason", sa.String(), nullable=False),
    sa.Column("configuration", sa.JSON(), nullable=False),
    _id(),
    _writer(),
    _row_hash(),
    sa.CheckConstraint("version IS NULL OR version > 0", name="version_positive"),
    sa.UniqueConstraint("version"),
    sa.Index("ix_twin_configurations_campaign_id", "campaign_id"),
)
_table(
    "channel_figures",
    sa.Column("impact_id", sa.Integer(), sa.ForeignKey("impacts.id"), nullable=False),
    sa.Column("channel_id", sa.Integer(), sa.ForeignKey("channels.id"), nullable=False),
    sa.Column("largest", sa.Boolean(), nullable=False),
    sa.Column("rest_m_s2", sa.Double()),
    sa.Column("peak_acceleration_m_s2", sa.Double(), nullable=False),
    sa.Column("signed_peak_acceleration_m_s2", sa.Double(), nullable=False),
    sa.Column("peak_time_s", sa.Double(), nullable=False),
    sa.Column("pulse_start_s", sa.Double(), nullable=False),
    sa.Column("pulse_duration_s", sa.Double(), nullable=False),
    sa.Column("effective_duration_s", sa.Double(), nullable=False),
    sa.Column("energy_duration_s", sa.Double(), nullable=False),
    sa.Column("velocity_change_m_s", sa.Double(), nullable=False),
    sa.Column("record_velocity_change_m_s", sa.Double(), nullable=False),
    sa.Column("srs_frequency_hz", sa.JSON(), nullable=False),
    sa.Column("srs_maximax_m_s2", sa.JSON(), nullable=False),
    sa.Column("srs_peak_m_s2", sa.Double()),
    sa.Column("srs_peak_frequency_hz", sa.Double()),
    _id(),
    _writer(),
    _row_hash(),
    sa.CheckConstraint(
        "effective_duration_s IS NULL OR effective_duration_s >= 0",
        name="effective_duration_not_negative",
    ),
    sa.CheckConstraint(
        "energy_duration_s IS NULL OR energy_duration_s >= 0", name="energy_duration_not_negative"
    ),
    sa.CheckConstraint("peak_acceleration_m_s2 > 0", name="peak_acceleration_positive"),
    sa.CheckConstraint(
        "pulse_duration_s IS NULL OR pulse_duration_s >= 0", name="pulse_duration_not_negative"
    ),
    sa.UniqueConstraint("impact_id", "channel_id"),
    sa.Index("ix_channel_figures_channel_id", "channel_id"),
    sa.Index("uq_channel_figures_largest", "impact_id", unique=True, **_where("largest")),
)
_table(
    "pulses",
    sa.Column("impact_id", sa.Integer(), sa.ForeignKey("impacts.id"), nullable=False),
    sa.Column("settings_id", sa.Integer(), sa.ForeignKey("extraction_settings.id"), nullable=False),
    sa.Column("current", sa.Boolean(), nullable=False),
    sa.Column("extracted_at", sa.DateTime(timezone=True), nullable=False),
    sa.Column("start_s", sa.Double(), nullable=False),
    sa.Column("contact_time_s", sa.Double(), nullable=False),
    sa.Column("compression_time_s", sa.Double(), nullable=False),
    sa.Column("peak_force_n", sa.Double(), nullable=False),
    sa.Column("spline_peak_force_n", sa.Double(), nullable=False),
    sa.Column("impulse_n_s", sa.Double(), nullable=False),
    sa.Column("compression_impulse_n_s", sa.Double(), nullable=False),
    sa.Column("width_half_s", sa.Double(), nullable=False),
    sa.Column("width_tenth_s", sa.Double(), nullable=False),
    sa.Column("samples_in_contact", sa.Integer(), nullable=False),
    sa.Column("spline_nrmse", sa.Double(), nullable=False),
    sa.Column("segmentation_difference", sa.Double(), nullable=False),
    sa.Column("force_points_n", sa.JSON(), nullable=False),
    sa.Column("fine_period_s", sa.Double(), nullable=False),
    sa.Column("fine_force_n", sa.LargeBinary(), nullable=False),
    _id(),
    _writer(),
    _row_hash(),
    sa.CheckConstraint(
        "compression_time_s >= 0 AND compression_time_s <= contact_time_s",
        name="compression_within",
    ),
    sa.CheckConstraint(
        "contact_time_s IS NULL OR contact_time_s > 0", name="contact_time_positive"
    ),
    sa.CheckConstraint("peak_force_n IS NULL OR peak_force_n > 0", name="peak_force_positive"),
    sa.CheckConstraint("samples_in_contact >= 1", name="samples_positive"),
    sa.UniqueConstraint("impact_id", "settings_id"),
    sa.Index("ix_pulses_settings_id", "settings_id"),
    sa.Index("uq_pulses_current", "impact_id", unique=True, **_where("current")),
)
_table(
    "quality_findings",
    sa.Column("recording_id", sa.Integer(), sa.ForeignKey("recordings.id"), nullable=False),
    sa.Column("channel_id", sa.Integer(), sa.ForeignKey("channels.id")),
    sa.Column("impact_id", sa.Integer(), sa.ForeignKey("impacts.id")),
    sa.Column("check", sa.String(), nullable=False),
    sa.Column("severity", sa.String(), nullable=False),
    sa.Column("message", sa.String(), nullable=False),
    sa.Column("evidence", sa.JSON(), nullable=False),
    _id(),
    _writer(),
    _row_hash(),
    sa.CheckConstraint("severity IN ('note', 'warning', 'reject')", name="severity_known"),
    sa.Index("ix_quality_findings_channel_id", "channel_id"),
    sa.Index("ix_quality_findings_check", "check"),
    sa.Index("ix_quality_findings_impact_id", "impact_id"),
    sa.Index("ix_quality_findings_recording_id", "recording_id"),
)
_table(
    "series_chunks",
    sa.Column(
        "channel_id",
        sa.Integer(),
        sa.ForeignKey("channels.id", ondelete="CASCADE"),
        primary_key=True,
    ),
    sa.Column("number", sa.Integer(), primary_key=True),
    sa.Column("frame", sa.LargeBinary(), nullable=False),
    _writer(),
    _row_hash(),
)
_table(
    "shots",
    sa.Column("campaign_id", sa.Integer(), sa.ForeignKey("campaigns.id"), nullable=False),
    sa.Column("run", sa.Integer(), nullable=False),
    sa.Column("repetition", sa.Integer(), nullable=False),
    sa.Column("configuration_id", sa.Integer(), sa.ForeignKey("configurations.id"), nullable=False),
    sa.Column("recording_id", sa.Integer(), sa.ForeignKey("recordings.id")),
    sa.Column("planned_run_id", sa.Integer(), sa.ForeignKey("planned_runs.id")),
    sa.Column("impact_id", sa.Integer(), sa.ForeignKey("impacts.id")),
    sa.Column("tank_pressure_pa", sa.Double(), nullable=False),
    sa.Column("recorded_pressure_pa", sa.Double()),
    sa.Column("recorded_pressure_u_pa", sa.Double()),
    sa.Column("bullet_mass_kg", sa.Double(), nullable=False),
    sa.Column("bullet_length_m", sa.Double()),
    sa.Column("measured_velocity_m_s", sa.Double()),
    sa.Column("measured_velocity_u_m_s", sa.Double()),
    sa.Column("velocity_source", sa.String()),
    _id(),
    _writer(),
    _row_hash(),
    sa.CheckConstraint(
        "bullet_length_m IS NULL OR bullet_length_m > 0", name="bullet_length_positive"
    ),
    sa.CheckConstraint("bullet_mass_kg IS NULL OR bullet_mass_kg > 0", name="bullet_mass_positive"),
    sa.CheckConstraint("repetition >= 1", name="repetition_positive"),
    sa.CheckConstraint("run >= 0", name="run_not_negative"),
    sa.CheckConstraint(
        "tank_pressure_pa IS NULL OR tank_pressure_pa > 0", name="tank_pressure_positive"
    ),
    sa.CheckConstraint(
        "measured_velocity_m_s IS NULL OR measured_velocity_m_s >= 0", name="velocity_not_negative"
    ),
    sa.CheckConstraint(
        "measured_velocity_u_m_s IS NULL OR measured_velocity_u_m_s >= 0",
        name="velocity_u_not_negative",
    ),
    sa.CheckConstraint(
        "(measured_velocity_m_s IS NULL) = (velocity_source IS NULL)", name="velocity_with_source"
    ),
    sa.UniqueConstraint("campaign_id", "run", "repetition"),
    sa.Index("ix_shots_campaign_id_id", "campaign_id", "id"),
    sa.Index("ix_shots_configuration_id_id", "configuration_id", "id"),
    sa.Index("ix_shots_planned_run_id", "planned_run_id"),
    sa.Index("ix_shots_recording_id", "recording_id"),
)
_table(
    "snapshot_pulses",
    sa.Column("snapshot_id", sa.Integer(), sa.ForeignKey("dataset_snapshots.id"), primary_key=True),
    sa.Column("pulse_id", sa.Integer(), sa.ForeignKey("pulses.id"), primary_key=True),
    _writer(),
    _row_hash(),
    sa.Index("ix_snapshot_pulses_pulse_id", "pulse_id"),
)

#: What the software itself must change as an operator, who changes and deletes no recording,
#: calibration or sample: each function does so within what it checks. They run with their owner's
#: rights, name every object by its schema, and look up nothing else but in pg_catalog.
_FUNCTIONS = (
    """
CREATE FUNCTION {schema}.pyroshock_delete_set_aside(recording integer) RETURNS integer
LANGUAGE sql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
  WITH gone AS (
    DELETE FROM {schema}.recordings r WHERE r.id = $1 AND r.status = 'set aside'
    AND NOT EXISTS (SELECT FROM {schema}.channels c WHERE c.recording_id = r.id)
    RETURNING 1
  ) SELECT pg_catalog.count(*)::integer FROM gone
$$""",
    """
CREATE FUNCTION {schema}.pyroshock_replace_set_aside(
  recording integer, new_sha256 text, new_size bigint, new_format text, new_status text, \
new_reason text,
  new_writer integer, new_row_sha256 text
) RETURNS integer
LANGUAGE sql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
  WITH changed AS (
    UPDATE {schema}.recordings r SET sha256 = $2, size_bytes = $3, format = $4, status = $5, \
reason = $6,
      written_by_id = $7, row_sha256 = $8
    WHERE r.id = $1 AND r.status = 'set aside'
    AND NOT EXISTS (SELECT FROM {schema}.channels c WHERE c.recording_id = r.id)
    RETURNING 1
  ) SELECT pg_catalog.count(*)::integer FROM changed
$$""",
    # A whole chunk is known by its row's SHA-256, in the form of schema/row_hashes.py.
    """
CREATE FUNCTION {schema}.pyroshock_delete_damaged_chunks(channel integer) RETURNS integer
LANGUAGE sql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
  WITH gone AS (
    DELETE FROM {schema}.series_chunks s USING {schema}.channels c
    WHERE s.channel_id = $1 AND c.id = $1 AND (
      s.number < 0 OR s.number::bigint * c.chunk_samples >= c.samples
      OR s.row_sha256 IS DISTINCT FROM pg_catalog.encode(pg_catalog.sha256(pg_catalog.convert_to(
        'channel_id=integer ' || s.channel_id
        || E'\\nframe=bytes ' || pg_catalog.encode(pg_catalog.sha256(s.frame), 'hex')
        || E'\\nnumber=integer ' || s.number
        || COALESCE(E'\\nwritten_by_id=integer ' || s.written_by_id, ''), 'UTF8')), 'hex')
    )
    RETURNING 1
  ) SELECT pg_catalog.count(*)::integer FROM gone
$$""",
    """
CREATE FUNCTION {schema}.pyroshock_withdraw_force_sign(recording integer) RETURNS integer
LANGUAGE sql SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
  WITH gone AS (
    DELETE FROM {schema}.quality_findings f WHERE f.recording_id = $1 AND f."check" = 'force-sign' \
RETURNING 1
  ) SELECT pg_catalog.count(*)::integer FROM gone
$$""",
)
_SIGNATURES = (
    "pyroshock_delete_set_aside(integer)",
    "pyroshock_replace_set_aside(integer, text, bigint, text, text, text, integer, text)",
    "pyroshock_delete_damaged_chunks(integer)",
    "pyroshock_withdraw_force_sign(integer)",
)
