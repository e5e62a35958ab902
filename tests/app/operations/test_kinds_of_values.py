"""A value of a kind that a field was not written for is refused with the field's name: a list in
place of a mapping, a name that is a list."""

from __future__ import annotations

from typing import Any

import pytest
from pyroshock.app.operations.catalogue import operations
from pyroshock.app.operations.faults import RequestError, read

VALUES: tuple[Any, ...] = (
    1, -1, 1.5, True, "x", "a=b", [], [1], [[1]], [None], [["a", "b"]], [{"a": 1}], {"a": [1]},
    {"a": {"b": 1}}, {"a": "b"}, {"": None}, {"a": None},
)  # fmt: skip


@pytest.mark.parametrize("operation", list(operations()), ids=lambda declared: declared.name)
def test_a_value_of_any_kind_is_read_or_refused_with_its_field(operation: Any) -> None:
    for request in operation.requests():
        for name in request.model_fields:
            for value in VALUES:
                try:
                    read(request, {name: value}, "network")
                except RequestError as refusal:  # "": a rule of several fields together
                    named = {fault.field for fault in refusal.faults}
                    assert named <= {*request.model_fields, ""}
                    assert not any("wrong kind" in fault.message for fault in refusal.faults)
                except LookupError as absent:  # what a door answers with "not found"
                    assert type(absent) is LookupError and "; there are: " in str(absent)


def test_the_refusal_names_the_value() -> None:
    (plan,) = (declared for declared in operations() if declared.name == "plan")
    request = plan.requests()[0]
    with pytest.raises(RequestError) as refusal:
        read(request, {"method": "lhs", "name": "summer", "ranges": 1}, "network")
    (fault,) = refusal.value.faults
    assert fault.field == "ranges" and "ranges is 1;" in fault.message
