"""`materials`: what is known of tips, plates and anvils."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from ..command_line.common import db_option, note, open_command_store
from ..command_line.listed import Listing, listing_options
from ..command_line.nouns import NounGroup

if TYPE_CHECKING:
    from sqlalchemy.orm import Session


@click.group(cls=NounGroup, invoke_without_command=True)
@db_option
@listing_options
@click.pass_context
def materials(ctx: click.Context, db: str, listing: Listing) -> None:
    """List the known materials with their sources, or add one.

    \b
    Example:
        pyroshock materials --columns name,density_kg_m3
    """
    if ctx.invoked_subcommand is not None:
        return
    with open_command_store(db) as store, store.reading() as session:
        from sqlalchemy import select

        from ....schema.benches import Material

        rows = [
            {
                "name": m.name,
                "youngs_modulus_pa": m.youngs_modulus_pa,
                "poisson_ratio": m.poisson_ratio,
                "density_kg_m3": m.density_kg_m3,
                "yield_strength_pa": m.yield_strength_pa,
                "aliases": ", ".join(a.alias for a in m.aliases),
                "source": m.source,
            }
            for m in session.scalars(select(Material).order_by(Material.name))
        ]
    listing.show(rows, "no materials")


@materials.command()
@click.argument("name")
@db_option
@click.option(
    "--youngs-modulus",
    required=True,
    metavar="QUANTITY",
    help="Give Young's modulus, such as 69.9GPa.",
)
@click.option(
    "--poisson-ratio", required=True, type=float, help="Give Poisson's ratio, such as 0.33."
)
@click.option(
    "--density", required=True, metavar="QUANTITY", help="Give the density, such as 2700kg/m3."
)
@click.option(
    "--yield-strength",
    required=True,
    metavar="QUANTITY",
    help="Give the yield strength, such as 276MPa.",
)
@click.option("--source", required=True, help="Name the source of the values.")
def add(
    name: str,
    db: str,
    youngs_modulus: str,
    poisson_ratio: float,
    density: str,
    yield_strength: str,
    source: str,
) -> None:
    """Add a material. A name that exists is refused.

    \b
    Example:
        pyroshock materials add titanium --youngs-modulus 114GPa --poisson-ratio 0.34 \\
            --density 4430kg/m3 --yield-strength 880MPa --source "data sheet 12-7"
    """
    with open_command_store(db) as store:
        from ....schema.benches import Material, material_names
        from ...common.frames import parse_quantity

        if not -1 < poisson_ratio < 0.5:
            raise ValueError(
                f"--poisson-ratio is {poisson_ratio}; expected a number above -1 and below 0.5"
            )
        values = {
            "youngs_modulus_pa": parse_quantity(youngs_modulus, "Pa", "--youngs-modulus"),
            "density_kg_m3": parse_quantity(density, "kg/m^3", "--density"),
            "yield_strength_pa": parse_quantity(yield_strength, "Pa", "--yield-strength"),
        }
        for key, value in values.items():
            if value <= 0:
                raise ValueError(f"{key} is {value}; expected a value above zero")

        def add_row(session: Session) -> None:
            if material_names(session)(name):
                raise ValueError(
                    f"material {name!r} is known already; pyroshock materials lists it"
                )
            session.add(Material(name=name, poisson_ratio=poisson_ratio, source=source, **values))

        store.write(add_row)
    note(f"material {name} added")
