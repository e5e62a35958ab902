"""`impacts`, `shots`: what is in the store."""

from __future__ import annotations

import click

from .common import db_option, opened
from .completion import campaign_names
from .listed import Listing, listing_options

_CAMPAIGN = click.option("--campaign", metavar="NAME", help="Only of this campaign.", shell_complete=campaign_names)
_WHERE = click.option(
    "--where",
    multiple=True,
    metavar="CONDITION",
    help='FIELD=VALUE, also != < <= > >=; repeat to narrow ("tip_material=steel").',
)
_LIMIT = click.option("--limit", type=click.IntRange(1), help="At most this many rows.")


@click.command()
@db_option
@listing_options
@_CAMPAIGN
@_WHERE
@_LIMIT
def impacts(db: str, listing: Listing, campaign: str | None, where: tuple[str, ...], limit: int | None) -> None:
    """List impacts with their factors, the figures of the pulse in use, and those of the acceleration channel with the
    largest peak. Numbers are SI.

    \b
    Example:
        pyroshock impacts --campaign spring --where tip_material=steel --where "peak_force_n>1000"
        pyroshock impacts --where "peak_acceleration_m_s2>1000"
        pyroshock impacts --sort -peak_force_n --columns id,tip_material,peak_force_n --csv
    """
    with opened(db) as store, store.reading() as session:
        from itertools import islice

        from ...schema.listings import iter_impacts
        from ..filters import parse_where
        from ..pulses.impact import without_empty_figures

        rows = list(islice(iter_impacts(session, campaign, parse_where(where)), limit))
        listing.show(rows if listing.is_chosen else without_empty_figures(rows), "no impacts match")


@click.command()
@db_option
@listing_options
@_CAMPAIGN
@_WHERE
@_LIMIT
def shots(db: str, listing: Listing, campaign: str | None, where: tuple[str, ...], limit: int | None) -> None:
    """List shots of the gun: pressure (gauge), mass, measured velocity, and the nominal model's. Numbers are SI.

    \b
    Example:
        pyroshock shots --campaign first-shots
    """
    with opened(db) as store, store.reading() as session:
        from itertools import islice

        from ...schema.listings import iter_shots
        from ..filters import parse_where
        from ..predictions.nominal import with_predictions

        shots = iter_shots(session, campaign, parse_where(where))
        rows = list(islice(with_predictions(session, shots), limit))
        listing.show(rows, "no shots match")
