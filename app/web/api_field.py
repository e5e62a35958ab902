"""A parameter or a field of a route of the API, as its page shows it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ApiField:
    """A parameter or a field of a body or an answer. `place`: "path", "query", "body" or "answer".

    `control` is what a form shows it as: "text", "number", "select", "lines" (a list, one value in
    each line) or "json"; `methods` are the designs that have it, of a plan.
    """

    name: str
    place: str
    type: str
    unit: str
    required: bool
    default: str
    text: str = ""
    bounds: str = ""
    control: str = "text"
    choices: tuple[str, ...] = ()
    limits: tuple[tuple[str, str], ...] = ()
    example: str = ""
    methods: tuple[str, ...] = ()

    @property
    def id(self) -> str:
        """Of its control, which is its own where several designs have fields of one name."""
        return "-".join(("try", self.name, *self.methods[:1]))
