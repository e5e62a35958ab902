"""An impact deleted with its recording."""

from __future__ import annotations

from sqlalchemy import select
from sqlalchemy.orm import Session

from ....schema.campaigns import Campaign
from ....schema.impacts import Impact
from ....schema.person_roles import ADMINISTRATOR
from ....schema.removal.part import Part, recording_part
from ..fields import Presentation, request_field
from ..ingest.removal import discard_recording
from ..ingest.removed import DryRunnable, Reason
from ..ingest.runs import DiscardedRecording
from ..laboratory import Laboratory
from ..operation import Operation, Progress
from .impact import get_impact
from .showing import NamedImpact


class ImpactRemoval(DryRunnable, NamedImpact):
    """An impact whose recording is taken out of the store."""

    all_of_recording: bool = request_field(
        False, help="Delete the other impacts of the same recording, too."
    )
    reason: Reason = request_field(
        help="Say why. The store keeps the reason.", presentation=Presentation(metavar="TEXT")
    )


def recording_of_impact(session: Session, key: int, *, all_of_recording: bool) -> Part:
    """The recording that an impact came from.

    Raises `LookupError` for an unknown impact, `ValueError` for one without a recording, and for
    one whose recording holds other impacts, unless `all_of_recording`.
    """
    impact = get_impact(session, key)
    if impact.recording is None:
        raise ValueError(
            f"impact {key} came from a row without a recording; it is deleted "
            f"with its campaign only"
        )
    others = (
        select(Impact.id)
        .where(Impact.recording_id == impact.recording_id, Impact.id != key)
        .order_by(Impact.id)
    )
    keys = list(session.scalars(others))
    if keys and not all_of_recording:
        named = ", ".join(map(str, keys[:8])) + (" and more" if len(keys) > 8 else "")
        raise ValueError(
            f"recording {impact.recording.path!r} of impact {key} holds other impacts too: "
            f"{named}; they would be deleted with it; add --all-of-recording to delete all of them"
        )
    campaign = session.get_one(Campaign, impact.campaign_id).name
    return recording_part(session, campaign, impact.recording.path)


def _delete(request: ImpactRemoval, laboratory: Laboratory, _: Progress) -> DiscardedRecording:
    with laboratory.store.reading() as session:
        part = recording_of_impact(
            session, request.impact, all_of_recording=request.all_of_recording
        )
    stone = discard_recording(laboratory.store, laboratory.db, part, request.reason)
    return DiscardedRecording(stone, request.dry_run)


IMPACT_DELETE: Operation[ImpactRemoval, DiscardedRecording] = Operation(
    name="impact-delete",
    role=ADMINISTRATOR,
    request=ImpactRemoval,
    run=_delete,
    help="""Delete the impact with number IMPACT: its recording is taken out of the store, as by
`pyroshock runs discard`.

A recording is discarded as a whole. If it holds other impacts, the command refuses and names them,
unless --all-of-recording is given.""",
    example='pyroshock impacts delete 2 --reason "the plate had come loose" --dry-run',
    command=("impacts", "delete"),
    route=("POST", "/impacts/{impact}/delete"),
    absent={"form": "The page of an impact discards its recording as a whole."},
)
