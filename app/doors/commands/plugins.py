"""`plugins`: what other packages add."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import click

from ..command_line.listed import Listing, listing_options


@click.command()
@listing_options
def plugins(listing: Listing) -> None:
    """List the readers, effects and models that other installed packages add.

    The column state names what keeps an entry from being used.

    \b
    Example:
        pyroshock plugins --json
    """
    from ....ingest.readers import added_readers
    from ....plugins import EFFECTS, MODELS, READERS, Loaded, PluginError, installed
    from ....training.models.catalogue import model_specs
    from ....training.models.serialization import added_kinds
    from ....twin.effects import added_effects

    def models() -> Loaded[Any]:
        model_specs()  # refuses a name that is taken
        return added_kinds()

    families: Mapping[str, Callable[[], Loaded[Any]]] = {
        READERS: added_readers,
        EFFECTS: added_effects,
        MODELS: models,
    }

    def state(group: str, name: str) -> str:
        try:
            return families[group]().failures.get(name, "usable")
        except PluginError as error:
            return str(error)

    listing.show(
        (
            {
                "adds": plugin.kind,
                "name": plugin.name,
                "package": plugin.package,
                "version": plugin.version,
                "state": state(plugin.group, plugin.name),
            }
            for plugin in installed()
        ),
        "no installed package adds anything",
    )
