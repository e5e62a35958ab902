"""What the window asks of a twin: the shot that a page or a script describes, and how it is answered.

What the first pages need is imported, and the first twin built, while nobody waits for it.
"""

from __future__ import annotations

import logging
import threading
from importlib import import_module
from typing import Annotated, Any, Literal

from fastapi import Depends, Query
from pydantic import BaseModel, ConfigDict, Field
from starlette.requests import Request

from ..twins.building import TwinRequest
from ..twins.twin_cache import TwinShelf
from ..web.dependencies import Word
from .predicting import ShotRequest, parse_factor


def _twins(request: Request) -> TwinShelf:
    shelf: TwinShelf = request.app.state.twins
    return shelf


Twins = Annotated[TwinShelf, Depends(_twins)]


class PredictionOptions(BaseModel):
    """A shot as `pyroshock predict` takes it, SI; the twin is that of a campaign's bench (none: the newest gun's).

    The bounds are orders of magnitude beyond any bench: between them an answer takes a second at most.
    """

    model_config = ConfigDict(extra="forbid")

    campaign: Word | None = None
    contact: Word | None = Field(None, description="a law of contact, or NAME@VERSION; none: the model in use")
    plate: Word | None = None
    q: Annotated[float, Field(gt=0.5, le=1000)] = 10.0
    adopted: bool = True
    coupled: bool = Field(False, description="contact law and plate solved together: thin plates, soft tips")
    chain_height_m: Annotated[float, Field(ge=-10, le=10)] = Field(
        0.0, description="by which the plate of a gun hangs higher: a multiple of 0.056, a link of its chain"
    )
    tank_pressure_pa: Annotated[float, Field(ge=1, le=1e8)] | None = None
    impact_velocity_m_s: Annotated[float, Field(ge=1e-3, le=1e4)] | None = None
    bullet_mass_kg: Annotated[float, Field(ge=1e-4, le=1e3)] | None = Field(None, description="none: the bench's")
    tip_material: Word = "steel"
    tip_radius_m: Annotated[float, Field(ge=1e-5, le=10)] = 0.045
    anvil_material: Word = "none"
    insulator: Word = "none"
    impact_position: Word = "#1"
    boundary_conditions: Literal["free", "fixed"] | None = None
    factor: list[Word] = Field([], max_length=50, description="NAME=VALUE of a factor that the model learned from, SI")
    valve_profile: Word | None = Field(None, description="of the gun's valve, such as '0:0 0.1:1': s, 0 shut to 1 open")
    draws: Annotated[int, Field(ge=2, le=1024)] = 64
    seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = 0

    def request(self) -> TwinRequest:
        return TwinRequest(
            campaign=self.campaign,
            contact=self.contact,
            plate=self.plate,
            q=self.q,
            adopted=self.adopted,
            coupled=self.coupled,
            chain_height_m=self.chain_height_m,
        )

    def shot(self) -> ShotRequest:
        names = ("bullet_mass_kg", "tip_material", "tip_radius_m", "tank_pressure_pa", "impact_velocity_m_s",
                 "anvil_material", "insulator", "impact_position", "boundary_conditions", "valve_profile")  # fmt: skip
        factors = dict(parse_factor(text) for text in self.factor)
        return ShotRequest(**{name: getattr(self, name) for name in names}, factors=factors)


Asked = Annotated[PredictionOptions, Query()]


def shown(question: PredictionOptions) -> dict[str, Any]:
    """What a link to this question carries."""
    return question.model_dump(exclude_defaults=True)


_log = logging.getLogger("pyroshock.web")
_HEAVY = (
    "scipy.stats",
    "scipy.optimize",
    "scipy.interpolate",
    "pyroshock.app.plan.quality",
    "pyroshock.app.train.comparing",
)


def warmed(twins: TwinShelf) -> threading.Thread:
    """Begin in a thread of its own; what fails here is told where it is asked for."""

    def work() -> None:
        try:
            for name in _HEAVY:
                import_module(name)
            twins.get(TwinRequest())
        except Exception as error:  # noqa: BLE001 - a page tells it to who asks
            _log.info("not warmed: %s", error)

    thread = threading.Thread(target=work, name="pyroshock warming", daemon=True)
    thread.start()
    return thread
