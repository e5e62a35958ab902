"""Long work: what was asked for, who does it, how far it is, and what came of it."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import CheckConstraint, Index, Text
from sqlalchemy.orm import Mapped, mapped_column

from .base import Base, HasId, PlainJson, WithProvenance, names_row, not_negative, one_of, positive

WAITING, RUNNING, DONE, FAILED, STOPPED = "waiting", "running", "done", "failed", "stopped"
STATES = (WAITING, RUNNING, DONE, FAILED, STOPPED)
ENDED = (DONE, FAILED, STOPPED)


class Job(HasId, WithProvenance, Base):
    """One piece of work. Whoever holds `attempt` while the state is running may write; all others
    are too late.

    No time of day decides anything: the times are for people to read.
    """

    __tablename__ = "jobs"
    __table_args__ = (
        CheckConstraint(one_of("state", STATES), "state_known"),
        CheckConstraint(
            "state <> 'running' OR (worker IS NOT NULL AND lease_s IS NOT NULL AND attempt > 0)",
            "running_with_worker"
        ),
        CheckConstraint(positive("lease_s"), "lease_positive"),
        CheckConstraint("(ended_at IS NOT NULL) = (state IN ('done', 'failed', 'stopped'))",
        "ended_when_over"),
        CheckConstraint("(error IS NOT NULL) = (state = 'failed')", "failed_with_error"),
        CheckConstraint("state <> 'done' OR address IS NOT NULL", "done_with_address"),
        *(CheckConstraint(not_negative(column), f"{column}_not_negative")
          for column in ("attempt", "deaths", "beat", "done", "total")),
        # "the next that waits", "what runs, and does it still": every worker, every second
        Index("ix_jobs_state_id", "state", "id"),
    )  # fmt: skip

    kind: Mapped[str]  # a key of `app.jobs.known_kinds.KINDS`
    label: Mapped[str] = mapped_column(info=names_row("job"))  # what people call it
    #: All that another process needs to do it again; up to the size of an imported plan, hence not
    #: in listings.
    arguments: Mapped[dict[str, Any]] = mapped_column(deferred=True)
    #: The one machine that has what the work needs, such as an uploaded folder; None: any.
    host: Mapped[str | None]
    state: Mapped[str] = mapped_column(default=WAITING)
    attempt: Mapped[int] = mapped_column(
        default=0
    )  # rises with each worker that takes it: the fencing number
    deaths: Mapped[int] = mapped_column(default=0)  # attempts whose worker fell silent
    worker: Mapped[str | None]  # host:process:random, of the last attempt
    lease_s: Mapped[float | None]  # a worker that is silent for so long has lost the job
    beat: Mapped[int] = mapped_column(default=0)  # its worker counts on while it lives
    stop_requested: Mapped[bool] = mapped_column(default=False)
    done: Mapped[int] = mapped_column(default=0)
    total: Mapped[int] = mapped_column(default=0)  # 0: not known
    what: Mapped[str] = mapped_column(Text, default="")
    error: Mapped[str | None] = mapped_column(Text)
    address: Mapped[str | None]  # where its result is to be seen, on a server of the store
    words: Mapped[str | None] = mapped_column(Text)
    result: Mapped[Any | None] = mapped_column(PlainJson(none_as_null=True), deferred=True)
    asked_at: Mapped[datetime]
    asked_by: Mapped[str | None]  # the name of the person, and how it is known (`person_roles`)
    asked_by_kind: Mapped[str | None]
    started_at: Mapped[datetime | None]  # the last attempt
    ended_at: Mapped[datetime | None]
