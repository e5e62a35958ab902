"""By what a row from elsewhere is known here, and what must agree where it is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Table

from ..tables import metadata

#: A row as it is stored, its references those of the store that takes it.
Row = Mapping[str, Any]


@dataclass(frozen=True)
class MergeRule:
    """How the rows of a table are merged.

    A row whose `key` (unique columns) is here stays as it is here, if `same` gives the same values
    for both: else it is another thing under one name. With an `owner` (a column), rows come in only
    along with a row that was new.
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
_ATTACHED_TO = ("subject_kind", "subject", "run", "repetition")
_PLANNED = ("position", "repetitions", "configuration_id", "treatment", "settings")

#: In the order of their references. A fingerprint vouches for a row's content
#: (`care.checks.fingerprints`).
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
    MergeRule(
        "campaigns",
        ("name",),
        same=columns("kind", "fingerprint"),
        advice="import it into a store of its own",
    ),
    MergeRule("plans", ("name",), same=columns("kind", "factors", "method", "seed")),
    MergeRule(
        "planned_runs",
        ("plan_id", "run"),
        same=columns(*_PLANNED),
        advice="import it into a store of its own",
    ),
    MergeRule("run_predictions", ("planned_run_id", "made_at")),
    MergeRule(
        "recordings", ("campaign_id", "path"), same=columns("status", "sha256"), advice=_OTHER_RUN
    ),
    MergeRule("channels", owner="recording_id"),
    MergeRule("series_chunks", owner="channel_id"),
    MergeRule("impacts", ("campaign_id", "run", "repetition"), same=_impact, advice=_OTHER_RUN),
    MergeRule("pulses", ("impact_id", "settings_id")),
    MergeRule("channel_figures", owner="channel_id"),
    MergeRule("shots", ("campaign_id", "run", "repetition"), same=_shot, advice=_OTHER_RUN),
    MergeRule("quality_findings", owner="recording_id"),
    MergeRule("fact_corrections", owner="campaign_id"),
    MergeRule("diagnoses", ("campaign_id", "simulator", "diagnosed_at")),
    MergeRule("attached_contents", ("sha256",)),
    MergeRule("attached_pieces", owner="content_id"),
    MergeRule("attachments", (*_ATTACHED_TO, "content_id", "attached_at"), same=columns("author")),
)


#: A dataset and an adopted effect are a laboratory's own choice, from campaigns of its own; a job
#: is a machine's, a tombstone tells of what that store no longer has, a model is in a registry of
#: its own, and a saved view and the pictures of the first page are of all that its store holds.
#: People, what they have done there, and what they have written beside the rows, are the
#: laboratory's own, too.
STAY_BEHIND = frozenset(
    {
        "dataset_snapshots",
        "snapshot_pulses",
        "twin_configurations",
        "jobs",
        "tombstones",
        "registered_versions",
        "saved_views",
        "home_pictures",
        "users",
        "password_hashes",
        "personal_tokens",
        "sign_on_identities",
        "audit_rows",
        "notes",
        "tags",
        "saved_filters",
    }
)
#: Follow from the rows that were taken: who wrote them, and how many there are.
WRITERS, COUNTS = "provenance", "campaign_counts"
