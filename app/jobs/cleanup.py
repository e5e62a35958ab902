"""What is removed once a job is over, by whoever ends it: an upload's folder, on the machine that it lies on."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from typing import Any

from sqlalchemy import select

from ...schema.jobs import ENDED, Job
from ...schema.session import Store
from .kinds.known import KINDS
from .queue import JobView, stop_job, this_host

_log = logging.getLogger("pyroshock.jobs")
#: Of jobs that ended while nobody could tidy up, so many are looked at.
_MOST = 200


def after(kind: str, arguments: Mapping[str, Any], host: str | None) -> None:
    """Tidy up after a job that is over; on another machine than the one that it was bound to nothing is done."""
    if host != this_host() or kind not in KINDS:
        return
    try:
        KINDS[kind].after(KINDS[kind].read(arguments))
    except (ValueError, OSError) as error:
        _log.warning("not tidied up after a job of kind %s: %s", kind, error)


def tidy_up(store: Store) -> None:
    """What jobs have left that were bound to this machine and ended elsewhere, or as their worker was killed."""
    columns = (Job.kind, Job.arguments, Job.host)
    ended = select(*columns).where(Job.state.in_(ENDED), Job.host == this_host()).order_by(Job.id.desc()).limit(_MOST)
    for kind, arguments, host in store.read(lambda session: session.execute(ended).all()):
        after(kind, arguments, host)


def stop(store: Store, key: int) -> JobView:
    """As `queue.stop_job`, and nothing is left of a job that had not begun."""
    stopped_job = stop_job(store, key)
    if stopped_job.ended:
        with store.reading() as session:
            job = session.get_one(Job, key)
            kind, arguments, host = job.kind, job.arguments, job.host
        after(kind, arguments, host)
    return stopped_job
