"""Factors of a shot that a laboratory has of its own: what the contact model learned from, and
what no stage uses."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ....schema.session import Store
    from ....training.registry.contact_stage import RegisteredContact
    from ...twins.building import BuiltTwin

#: A factor as it is given: a number in SI, or a word.
Value = str | float
#: Sources of predictors that a factor of another name gives.
_SOURCES = {"plate_mass_kg": "plate.mass"}


def factor_value(text: str) -> Value:
    """A cell as a number where it reads as one. Raises `AmbiguousNumberError` for a number with two
    readings."""
    from ....files.delimited_text import parse_number
    from ....files.number_notation import AmbiguousNumberError

    try:
        return parse_number(text)
    except AmbiguousNumberError:
        raise
    except ValueError:
        return text


def is_used(built: BuiltTwin, factor: str) -> bool:
    """Whether a predictor of the twin's contact model is read from this factor."""
    contact = registered_contact(built)
    source = _SOURCES.get(factor, f"factor.{factor}")
    return contact is not None and source in contact.predictor_set.sources


def check_used(
    built: BuiltTwin, factors: Mapping[str, Value], boundary_conditions: str | None
) -> None:
    """Raises `ValueError` that names a factor that no stage uses, and the predictors of the contact
    model.

    A plate that hangs free is what all plates of the twin are, so that `free` is no contradiction.
    """
    given: dict[str, Value] = dict(factors)
    if boundary_conditions not in (None, "free"):
        given["boundary_conditions"] = str(boundary_conditions)
    ignored = {name: value for name, value in given.items() if not is_used(built, name)}
    if ignored:
        words = ", ".join(f"{name} = {value}" for name, value in ignored.items())
        raise ValueError(
            f"{words}: no stage of this twin uses it{_why(ignored)}; {_contact_inputs(built)}"
        )


def store_factors(store: Store | None) -> frozenset[str]:
    """Names of all factors that campaigns of a store have."""
    from sqlalchemy import select

    from ....schema.campaigns import Factor

    if store is None:
        return frozenset()
    with store.reading() as session:
        return frozenset(session.scalars(select(Factor.name)))


def looks_like_factor(column: str, of_store: Collection[str]) -> bool:
    """Whether a column of a table is a factor: one of the store, or one of the thesis's that is
    misspelt, or a travel.

    Other columns are labels of their rows.
    """
    from ....ingest.folder.column_names import TRAVEL, resembled

    return column in of_store or column in TRAVEL or resembled(column) is not None


def registered_contact(built: BuiltTwin) -> RegisteredContact | None:
    """The registered model that answers for the contact; None where a law does."""
    from ....training.registry.contact_stage import RegisteredContact

    contact = built.twin.contact
    return contact if isinstance(contact, RegisteredContact) else None


def answering_contact(built: BuiltTwin, wanted: str | None) -> str:
    """The contact that answers, by a name that stays the same when another model is put in use:
    "gp@2" of the model in use, else the law that was asked for, or `prior`."""
    from ...twins.building import PRIOR

    contact = registered_contact(built)
    if contact is not None:
        return contact.registered.version.label
    return wanted or PRIOR


def _why(ignored: Collection[str]) -> str:
    from ....ingest.folder.column_names import resembled

    if "boundary_conditions" in ignored:
        return " (its plate hangs free)"
    resembled_column = next(
        (column for name in ignored if (column := resembled(name)) is not None), None
    )
    return "" if resembled_column is None else f" (it resembles the column {resembled_column})"


def _contact_inputs(built: BuiltTwin) -> str:
    contact = registered_contact(built)
    if contact is None:
        return (
            f"the contact is the law {built.twin.contact.label!r}; --contact NAME@VERSION "
            f"chooses a model that learned from it"
        )
    names = ", ".join(predictor.name for predictor in contact.predictor_set.predictors)
    return f"the predictors of {contact.label} are {names}"
