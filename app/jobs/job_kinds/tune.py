"""From a prescribed spectrum to settings: nothing is stored but the answer, from which its page is
drawn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ...common.number_format import finite
from ..kind import Ending, JobForm, Kind, Result, RunningJob, ending_of

if TYPE_CHECKING:
    from ....twin.tune.tuner import Tuned
    from ...operations.tune.session import Ask, TuningSession


@dataclass(frozen=True)
class TuneArguments:
    """As the options of `pyroshock tune`: `target` is the text of its CSV, `factors` the text of a
    factors file."""

    target: str
    tolerance: str = ""
    measured: Sequence[str] = ()
    campaign: str | None = None
    plate: str | None = None
    contact: str | None = None
    sensor: str | None = None
    factors: str = ""
    share: float = 1.0
    q: float = 10.0
    extrapolate: bool = False
    adopted: bool = True
    seed: int = 0
    at_least: float = 0.5

    def ask(self) -> Ask:
        """Raises `ValueError` for a target or factors that cannot be read."""
        from ....doe.space import shipped_factors, space_from_form
        from ...operations.impacts.spectra import target_from_upload
        from ...operations.tune.session import Ask
        from ...twins.building import TwinRequest

        target = target_from_upload(self.target, "the specification", self.tolerance or None)
        request = TwinRequest(
            campaign=self.campaign or None,
            contact=self.contact or None,
            plate=self.plate or None,
            q=self.q,
            frequency_hz=tuple(target.lines().tolist()),
            adopted=self.adopted,
        )
        return Ask(
            target,
            request,
            space_from_form(self.factors or shipped_factors("gun")),
            measured=tuple(self.measured),
            sensor=self.sensor or None,
            share=self.share,
            extrapolate=self.extrapolate,
            seed=self.seed,
            at_least=self.at_least,
        )


def _do(work: RunningJob, arguments: TuneArguments) -> Ending:
    from ...common.model_registry import models_extra
    from ...operations.tune.session import session_of

    work.step(0, 0, "building the twin")
    with models_extra():
        session = session_of(work.store, work.db, arguments.ask())
    data = _answer(arguments, session, session.run(work.step))
    return ending_of(Result(f"/tune/{work.job}", data["attainability"]["sentence"], data))


def _answer(arguments: TuneArguments, session: TuningSession, tuning: Tuned) -> dict[str, Any]:
    """`tune --json`, with whether the target is met, the target, what to avoid, and notes."""
    from ....twin.tune.probability import DRAWS
    from ...operations.tune.bench_adapter import SHOWN, avoid_json, proposal_rows

    goal = session.goal
    return {
        "draws": DRAWS,
        "attainability": finite(tuning.attainability.as_json()),
        "proposals": proposal_rows(tuning),
        "avoid": [avoid_json(setting) for setting in tuning.avoid[:SHOWN]],
        "notes": list(session.notes),
        "frequency_hz": goal.frequency_hz.tolist(),
        "prescribed_m_s2": (10 ** (goal.level_db / 20)).tolist(),
        "lower_m_s2": (10 ** ((goal.level_db - goal.lower_db.clip(0, 200)) / 20)).tolist(),
        "upper_m_s2": (10 ** ((goal.level_db + goal.upper_db.clip(0, 200)) / 20)).tolist(),
        "twin": {
            "campaign": arguments.campaign,
            "contact": arguments.contact,
            "plate": arguments.plate,
        },
    }


def _form(arguments: TuneArguments) -> JobForm:
    fields: dict[str, str | list[str]] = {
        "text": arguments.target,
        "tolerance": arguments.tolerance,
    }
    fields |= {"measured": ",".join(arguments.measured), "at_least": f"{arguments.at_least:g}"}
    fields |= {"share": f"{arguments.share:g}", "campaign": arguments.campaign or ""}
    fields |= {"contact": arguments.contact or "", "plate": arguments.plate or ""}
    return JobForm("/tune", "tune", fields)


TUNE = Kind("tune", TuneArguments, _do, form=_form)
