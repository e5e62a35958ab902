"""The rows of each subject with the columns that a chart needs, and the quantities that it can
draw."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from ...common.quantities import heading, key_of
from ..faults import Fault, RequestError, about
from ..laboratory import Laboratory
from .columns import Column, Value
from .request import Exploration

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

#: The place of a row in the order of recording: by date of the campaign, run and repetition.
ORDER = "recording_order"
PREDICTED = "predicted_velocity_m_s"
#: Of a shot whose run was predicted before it: the median of its velocity, and the rank of the
#: measured one among the predicted ones.
BEFORE_SHOT = ("expected_velocity_m_s", "velocity_rank")
#: What is computed of shots, and stored nowhere.
_OF_SHOTS = (PREDICTED, *BEFORE_SHOT)
#: Columns of a version of a model that are words, and those that are none of a quantity.
_MODEL_WORDS = ("model", "split", "dataset")


@dataclass(frozen=True)
class QuantityChoice:
    """A quantity that can be drawn: its key, and its words with the unit. `group` is the heading
    of a menu."""

    key: str
    words: str
    group: str


@dataclass(frozen=True, eq=False)
class SubjectRows:
    """Rows (n) in the order in which they are stored, with their columns.

    `keys` are the numbers of impacts or shots, the versions of models; `channels` names the channel
    of each row, where the rows are channels; `impacts` are the impacts of the rows, None where a
    row has none. `order` (n,) has the rows in the order of recording, `runs` (n,) numbers their
    runs and `configurations` (n,) their configurations.
    """

    subject: str
    columns: Mapping[str, Column]
    keys: Sequence[Any]
    impacts: Sequence[int | None]
    order: NDArray[np.intp]
    runs: NDArray[np.intp]
    configurations: NDArray[np.intp]
    channels: Sequence[str] = ()

    @property
    def count(self) -> int:
        """How many rows there are."""
        return len(self.keys)

    def label(self, row: int) -> str:
        """What a row is called: `impact 12`."""
        if self.subject == "models":
            return str(self.keys[row])
        word = "shot" if self.subject == "shots" else "impact"
        channel = f", {self.channels[row]}" if self.channels else ""
        return f"{word} {self.keys[row]}{channel}"

    def address(self, row: int) -> str:
        """The page that shows a row; empty where there is none."""
        if self.subject == "models":
            name, _, version = str(self.keys[row]).rpartition("@")
            return f"/models/{quote(name, safe='')}/{version}"
        return "" if self.impacts[row] is None else f"/impacts/{self.impacts[row]}"


def list_quantities(laboratory: Laboratory, subject: str) -> list[QuantityChoice]:
    """The quantities of a subject: figures, then factors, then words."""
    if subject == "models":
        figures, words = _model_columns()
        factors: Sequence[str] = ()
    else:
        from ....schema.value_columns import KINDS, factor_keys

        of_kind = KINDS[subject]
        words = [*of_kind.words, *of_kind.computed]
        with laboratory.store.reading() as session:
            stored_factors = factor_keys(session)
        left_out = {*stored_factors, "impact_id", *(("id",) if subject == "shots" else ())}
        figures = [name for name in of_kind.numbers if name not in left_out]
        figures += _OF_SHOTS if subject == "shots" else []
        factors = list(stored_factors)
    groups = (("Figures", figures), ("Factors", factors), ("Other", [*words, ORDER]))
    return [QuantityChoice(key, heading(key), group) for group, keys in groups for key in keys]


def checked_key(field: str, name: str, choices: Sequence[QuantityChoice]) -> str:
    """The key of a quantity that a field names, also by its heading. Raises `RequestError`."""
    keys = [choice.key for choice in choices]
    key = key_of(name, keys)
    if key not in keys:
        message = f"{field} is {name!r:.200}; expected one of {', '.join(keys)}"
        raise RequestError([Fault(field, message)])
    return key


def read_rows(request: Exploration, laboratory: Laboratory, names: Sequence[str]) -> SubjectRows:
    """The rows that match, with these columns. Raises as a listing with these conditions does."""
    wanted = list(dict.fromkeys(names))
    if request.subject == "models":
        return _model_rows(request, laboratory, wanted)
    with laboratory.store.reading() as session:
        if request.campaign is not None:
            from ....schema.conditions import get_campaign_id

            with about("campaign"):
                get_campaign_id(session, request.campaign)
        return _stored_rows(session, request, wanted)


def _stored_rows(session: Session, request: Exploration, names: list[str]) -> SubjectRows:
    from ....schema.value_columns import campaign_facts, read_columns

    kind = request.subject
    stored_names = [name for name in names if name not in (ORDER, *_OF_SHOTS)]
    of_shot = ["tank_pressure_pa", "bullet_mass_kg"] if PREDICTED in names else []
    of_kind = {"channels": ["channel"], "shots": ["impact_id"]}.get(kind, [])
    values = read_columns(
        session,
        kind,
        [*stored_names, *of_shot, *of_kind],
        request.campaign,
        request.conditions(),
        request.channel,
    )
    rank = {key: place for place, (_, key) in enumerate(_by_date(campaign_facts(session)))}
    dates = np.array([rank[campaign] for campaign in values["campaign_id"]], dtype=np.intp)
    run, repetition, key = (
        np.array(values[name], dtype=np.intp) for name in ("run", "repetition", "id")
    )
    order = np.lexsort((key, repetition, run, dates))
    if ORDER in names:
        places = np.empty(order.size, dtype=np.intp)
        places[order] = np.arange(1, order.size + 1)
        values[ORDER] = places.tolist()
    if PREDICTED in names:
        values[PREDICTED] = _predicted(session, values)
    if set(names) & set(BEFORE_SHOT):
        values |= _before_shot(session, values["id"])
    return SubjectRows(
        kind,
        {name: Column(name, values[name]) for name in names},
        values["id"],
        values["impact_id"] if kind == "shots" else values["id"],
        order,
        dates * (int(run.max(initial=0)) + 1) + run,
        np.array(values["configuration_id"], dtype=np.intp),
        values.get("channel", ()),
    )


def _by_date(facts: Mapping[int, tuple[str, str]]) -> list[tuple[str, int]]:
    """Campaigns in the order of their dates."""
    return sorted((date, key) for key, (date, _) in facts.items())


def _predicted(session: Session, values: Mapping[str, list[Any]]) -> list[Value]:
    """The velocity of the nominal gun for each shot."""
    from sqlalchemy import select

    from ....schema.campaigns import Campaign
    from ...common.nominal_velocity import with_predictions

    guns = dict(iter(session.execute(select(Campaign.id, Campaign.gun_id))))
    names = ("tank_pressure_pa", "bullet_mass_kg")
    shots = (
        {names[0]: pressure, names[1]: mass, "gun_id": guns[campaign]}
        for pressure, mass, campaign in zip(
            values[names[0]], values[names[1]], values["campaign_id"], strict=True
        )
    )
    return [shot[PREDICTED] for shot in with_predictions(session, shots)]


def _before_shot(session: Session, shots: Sequence[int]) -> dict[str, list[Any]]:
    """The columns `BEFORE_SHOT` of shots by their keys."""
    from ...common.run_forecasts import velocities_before

    compared = velocities_before(session, shots)
    pairs = [compared.get(key, (None, None)) for key in shots]
    return {name: [pair[place] for pair in pairs] for place, name in enumerate(BEFORE_SHOT)}


def _model_columns() -> tuple[list[str], list[str]]:
    from ...common.model_registry import models_extra

    with models_extra():
        from ....training.evaluation.metrics import METRICS
        from ....training.registry.listing import COVERED

    return ["version", *METRICS, *COVERED, "seconds", "seed"], list(_MODEL_WORDS)


def _model_rows(request: Exploration, laboratory: Laboratory, names: list[str]) -> SubjectRows:
    from ....schema.conditions import OPERATORS, UnknownFieldError
    from ...common.model_registry import models_extra, registry_at

    with models_extra():
        from ....training.registry.listing import flat_row, in_order

        registry = registry_at(laboratory.db)
        versions = [] if registry is None else in_order(registry.versions())[::-1]
    figures, words = _model_columns()
    columns_of_versions = [*figures, *words]
    rows = [
        {name: flat[name] for name in columns_of_versions}
        for flat in (flat_row(version) for version in versions)
    ]
    for condition in request.conditions():
        if condition.field not in columns_of_versions:
            raise UnknownFieldError(
                f"no column {condition.field!r}; known: {', '.join(columns_of_versions)}"
            )
        holds, wanted = OPERATORS[condition.operator], condition.value
        if condition.field in figures and isinstance(wanted, str):
            raise UnknownFieldError(
                f"{condition.field} is compared with {wanted!r}; expected a number"
            )
        rows = [
            row
            for row in rows
            if row[condition.field] is not None
            and holds(row[condition.field], str(wanted) if condition.field in words else wanted)
        ]
    labels = [f"{row['model']}@{row['version']}" for row in rows]
    columns: dict[str, Column] = {
        name: Column(name, [row[name] for row in rows]) for name in names if name != ORDER
    }
    if ORDER in names:
        columns[ORDER] = Column(ORDER, list(range(1, len(rows) + 1)))
    count = len(rows)
    return SubjectRows(
        "models",
        columns,
        labels,
        [None] * count,
        np.arange(count),
        np.arange(count),
        np.zeros(count, dtype=np.intp),
    )
