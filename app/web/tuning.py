"""From a prescribed spectrum to settings, as a job."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, Field

from ...doe.space import shipped_factors, space_from_text
from ...schema.session import Store
from ..targets import target_from_upload
from ..training import models_extra
from ..tuning import avoid_json, proposal_json
from ..tuning_session import Ask, session_of
from ..twins import TwinRequest
from .asking import signed
from .jobs import Job, Jobs, Result, Step
from .twins import Word

#: Proposals that are told.
SHOWN = 10


class Tuning(BaseModel):
    """As the options of `pyroshock tune`: `target` is the text of its CSV, `factors` the text of a factors file."""

    target: str = Field(max_length=260_000)
    tolerance: Word = ""
    measured: Annotated[list[Word], Field(max_length=20)] = []
    campaign: Word | None = None
    plate: Word | None = None
    contact: Word | None = None
    sensor: Word | None = None
    factors: Annotated[str, Field(max_length=200_000)] = ""
    share: Annotated[float, Field(gt=0, le=1)] = 1.0
    q: Annotated[float, Field(gt=0.5, le=1000)] = 10.0
    extrapolate: bool = False
    adopted: bool = True
    seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = 0


def tune_job(jobs: Jobs, store: Store, db: str, asked: Tuning) -> Job:
    """Queue a tuning; its result is `tune --json`, with the target, what to avoid, and notes.

    Raises `ValueError` for a target or factors that cannot be read.
    """
    target = target_from_upload(asked.target, "the specification", asked.tolerance or None)
    factors = space_from_text(asked.factors or shipped_factors("gun"))
    request = TwinRequest(
        campaign=asked.campaign or None,
        contact=asked.contact or None,
        plate=asked.plate or None,
        q=asked.q,
        frequency_hz=tuple(target.lines().tolist()),
        adopted=asked.adopted,
    )
    ask = Ask(
        target,
        request,
        factors,
        tuple(asked.measured),
        asked.sensor or None,
        None,
        asked.share,
        asked.extrapolate,
        asked.seed,
    )

    def work(step: Step) -> Result:
        step(0, 0, "building the twin")
        with models_extra():
            session = session_of(signed(store, "serve: tune"), db, ask)
        found = session.run(step)
        rows = [proposal_json(each, rank) for rank, each in enumerate(found.proposals[:SHOWN], 1)]
        goal = session.goal
        data: dict[str, Any] = {
            "proposals": rows,
            "avoid": [avoid_json(each) for each in found.avoid[:SHOWN]],
            "notes": list(session.notes),
            "frequency_hz": goal.frequency_hz.tolist(),
            "prescribed_m_s2": (10 ** (goal.level_db / 20)).tolist(),
            "lower_m_s2": (10 ** ((goal.level_db - goal.lower_db.clip(0, 200)) / 20)).tolist(),
            "upper_m_s2": (10 ** ((goal.level_db + goal.upper_db.clip(0, 200)) / 20)).tolist(),
            "twin": {"campaign": asked.campaign, "contact": asked.contact, "plate": asked.plate},
        }
        best = f"{rows[0]['probability_within']:.0%} that every line fits" if rows else "no setting"
        return Result(f"/tune/{job.key}", f"{len(rows)} proposals; the first: {best}", data)

    job = jobs.start("Tuning to a spectrum", work)
    return job
