"""`plugins`: what other packages add."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from ..laboratory import Laboratory
from ..operation import Operation, Progress, Request, Rows

if TYPE_CHECKING:
    from ....plugins import Loaded


def _list(_: Request, __: Laboratory, ___: Progress) -> Rows:
    from ....ingest.readers import added_readers
    from ....plugins import EFFECTS, MODELS, READERS, PluginError, installed
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

    rows = [
        {
            "adds": plugin.kind,
            "name": plugin.name,
            "package": plugin.package,
            "version": plugin.version,
            "state": state(plugin.group, plugin.name),
        }
        for plugin in installed()
    ]
    return Rows(rows, "no installed package adds anything")


PLUGINS: Operation[Request, Rows] = Operation(
    name="plugins",
    request=Request,
    run=_list,
    help="""List the readers, effects and models that other installed packages add.

The column state names what keeps an entry from being used.""",
    example="pyroshock plugins --json",
    route=("GET", "/plugins"),
    listing=True,
    uses_store=False,
    answered_here=True,
)
