"""A plan made as a job: what would only be refused after the search is refused before."""

from __future__ import annotations

import secrets
from dataclasses import replace

from sqlalchemy import select

from ...doe.designs.methods import get_method
from ...doe.plans import PlanExistsError
from ...doe.space import space_from_form
from ...schema.campaigns import Plan
from ...schema.session import Store
from ..jobs.kinds.plan import PLAN, PlanArguments
from ..jobs.queue import JobView
from .jobs import Jobs

#: More runs than a laboratory fires in a year, and more than the search can balance in minutes.
MOST_RUNS = 2000
#: Nothing, what an address takes for a way up, and the page that makes plans.
_NO_NAMES = ("", ".", "..", "new")


def plan_job(jobs: Jobs, store: Store, wanted: PlanArguments) -> JobView:
    """Queue the making of a plan, with its seed drawn. Raises `ValueError` for what cannot be made."""
    _check(store, wanted)
    drawn = wanted.seed if wanted.seed is not None else secrets.randbelow(2**31)
    return jobs.ask(store, PLAN, f"Plan {wanted.name}", replace(wanted, seed=drawn))


def _check(store: Store, wanted: PlanArguments) -> None:
    if wanted.name.strip() in _NO_NAMES:
        raise ValueError(f"{wanted.name!r} cannot name a plan; expected a word or two")
    if wanted.runs is not None and not 1 <= wanted.runs <= MOST_RUNS:
        raise ValueError(f"{wanted.runs} runs; expected 1 to {MOST_RUNS}")
    if wanted.seed is not None and not 0 <= wanted.seed < 2**31:
        raise ValueError(f"seed is {wanted.seed}; expected 0 to {2**31 - 1}, or none to draw one")
    get_method(wanted.method).checked(wanted.options)
    if wanted.factors:
        space_from_form(wanted.factors)
    with store.reading() as session:
        if session.scalar(select(Plan.id).where(Plan.name == wanted.name)) is not None:
            raise PlanExistsError(f"plan {wanted.name!r} is in the store already; choose another name")
