"""What is known of tips, plates and anvils: the materials, and a new one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from pydantic import AfterValidator, Field, ValidationInfo

from ....schema.person_roles import ADMINISTRATOR
from ..fields import Presentation, quantity, request_field
from ..laboratory import Laboratory
from ..operation import Operation, Outcome, Progress, Request, Rows

if TYPE_CHECKING:
    from sqlalchemy.orm import Session


_CONSTANTS = (
    "name", "youngs_modulus_pa", "poisson_ratio", "density_kg_m3", "yield_strength_pa",
)  # fmt: skip


def _list(_: Request, laboratory: Laboratory, __: Progress) -> Rows:
    from sqlalchemy import select

    from ....schema.benches import Material

    with laboratory.store.reading() as session:
        rows = [
            {name: getattr(material, name) for name in _CONSTANTS}
            | {
                "aliases": ", ".join(alias.alias for alias in material.aliases),
                "source": material.source,
            }
            for material in session.scalars(select(Material).order_by(Material.name))
        ]
    return Rows(rows, "no materials")


MATERIAL_LIST: Operation[Request, Rows] = Operation(
    name="material-list",
    request=Request,
    run=_list,
    help="List the known materials with their sources.",
    example="pyroshock materials list --columns name,density_kg_m3",
    command=("materials", "list"),
    route=("GET", "/materials"),
    listing=True,
    answered_here=True,
)


def _positive(value: float, info: ValidationInfo) -> float:
    if value <= 0:
        raise ValueError(f"{info.field_name} is {value:g}; expected a value above zero")
    return value


def _property(words: str, example: str) -> Any:
    return request_field(
        help=f"Give {words}, such as {example}.",
        example=example,
        presentation=Presentation(metavar="QUANTITY"),
    )


_Pressure: Any = Annotated[quantity("Pa"), AfterValidator(_positive)]
_Density: Any = Annotated[quantity("kg/m^3"), AfterValidator(_positive)]


class NewMaterial(Request):
    """A material with its constants."""

    name: Annotated[str, Field(min_length=1, max_length=1000)] = request_field(
        help="Call the material so; a name that exists is refused.",
        presentation=Presentation(positional=True),
    )
    youngs_modulus: _Pressure = _property("Young's modulus", "69.9GPa")
    poisson_ratio: Annotated[float, Field(gt=-1, lt=0.5)] = request_field(
        help="Give Poisson's ratio, such as 0.33."
    )
    density: _Density = _property("the density", "2700kg/m3")
    yield_strength: _Pressure = _property("the yield strength", "276MPa")
    source: Annotated[str, Field(min_length=1, max_length=4000)] = request_field(
        help="Name the source of the values."
    )


def _add(request: NewMaterial, laboratory: Laboratory, _: Progress) -> Outcome:
    from ....schema.benches import Material, material_names

    def add_row(session: Session) -> None:
        if material_names(session)(request.name):
            raise ValueError(
                f"material {request.name!r} is known already; pyroshock materials lists it"
            )
        session.add(
            Material(
                name=request.name,
                youngs_modulus_pa=request.youngs_modulus,
                poisson_ratio=request.poisson_ratio,
                density_kg_m3=request.density,
                yield_strength_pa=request.yield_strength,
                source=request.source,
            )
        )

    laboratory.store.write(add_row)
    line = f"material {request.name} added"
    return Outcome((line,), {"name": request.name}, "/ask/material-list")


MATERIAL_ADD: Operation[NewMaterial, Outcome] = Operation(
    name="material-add",
    role=ADMINISTRATOR,
    request=NewMaterial,
    run=_add,
    help="Add a material. A name that exists is refused.",
    example="pyroshock materials add titanium --youngs-modulus 114GPa --poisson-ratio 0.34 \\\n"
    '    --density 4430kg/m3 --yield-strength 880MPa --source "data sheet 12-7"',
    command=("materials", "add"),
    route=("POST", "/materials"),
)
