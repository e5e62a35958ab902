"""Facts of stored campaigns that were added or corrected: what was stated before, what is stated
now, why, when, and by whom."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import CheckConstraint, ForeignKey
from sqlalchemy.orm import Mapped, mapped_column, relationship

from .base import Base, HasId, WithProvenance, names_row
from .campaigns import Campaign


class FactCorrection(HasId, WithProvenance, Base):
    """One fact that was added or corrected, of a campaign or of some of its runs.

    `fact` is called as campaign.toml and runs.csv call it: "bench.plate.thickness_m",
    "tip_radius_mm". `value` is the text that these files would have.
    """

    __tablename__ = "fact_corrections"
    __table_args__ = (
        CheckConstraint("length(reason) > 0", "with_reason"),
        CheckConstraint("length(fact) > 0", "fact_named"),
    )

    # "what was corrected of this campaign": its page, and those of what was made from it
    campaign_id: Mapped[int] = mapped_column(ForeignKey("campaigns.id"), index=True)
    fact: Mapped[str] = mapped_column(info=names_row("fact"))
    #: [{"value": text or null, "hits": [[run, repetition], ...]}, ...]: what was stated before, and
    #: of which impacts or shots; of a fact of the campaign the hits are empty.
    earlier: Mapped[list[Any]]
    value: Mapped[str]
    reason: Mapped[str]
    corrected_at: Mapped[datetime]
    campaign: Mapped[Campaign] = relationship()
