"""Tables and series of a campaign as a file that the browser saves, and the whole campaign as a
file of its own."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

from fastapi import APIRouter, Query
from starlette.background import BackgroundTask
from starlette.requests import Request
from starlette.responses import FileResponse, Response

from ...files.spreadsheet_guard import guarding
from ...schema.conditions import get_campaign_id
from ...schema.transfer.export import export_campaign
from ..operations.faults import RequestError, read
from ..operations.impacts.table_export import EXPORT, TableExport
from ..operations.laboratory import Laboratory
from ..web.dependencies import Configured, Name, OpenStore
from ..web.forms import status_of_fault
from ..web.rendering import page

router = APIRouter()
#: What can be exported -> what the form calls it.
TABLES = {
    "impacts": "Impacts: factors, velocity and figures of the pulse",
    "shots": "Shots of the gun",
    "pulses": "Pulses: impacts with the points of the force",
    "channel-figures": "Figures of the acceleration channels",
    "series": "Series: all samples of all channels",
}
FORMATS = ("csv", "parquet")


@router.get("/campaigns/{name}/export")
def export(
    request: Request,
    name: Name,
    store: OpenStore,
    settings: Configured,
    what: str = "",
    format: str = "csv",  # the field's name in the address
    where: Annotated[str, Query(max_length=300)] = "",
    spreadsheet_guard: bool = True,
) -> Response:
    """The form; with `what`, the file. A fault stands beside its field. In CSV, texts that begin
    with = + - @ get an apostrophe unless `spreadsheet_guard=false`."""
    store.read(lambda session: get_campaign_id(session, name))
    field, fault, status = "", "", 422
    if what and format not in FORMATS:
        field, fault = "format", f"{format!r} is no format; expected one of {', '.join(FORMATS)}"
    elif what:
        try:
            table = read(TableExport, {"what": what, "campaign": name, "where": where}, "network")

            def write(out: Path) -> None:
                with guarding(spreadsheet_guard):
                    placed = table.model_copy(update={"out": out})
                    EXPORT.answer(placed, Laboratory(store, settings.db), lambda *_: None)

            return _saved(write, f"{name}-{what}.{format}")
        except RequestError as error:
            field, fault = error.faults[0].field or "where", error.faults[0].message
        except (ValueError, LookupError) as error:
            field, fault, status = (
                ("where" if where.strip() else "what"),
                str(error),
                status_of_fault(error),
            )
    return page(
        request,
        "export.html",
        status=status if fault else 200,
        campaign=name,
        tables=list(TABLES.items()),
        formats=FORMATS,
        what=what,
        chosen_format=format,
        where=where,
        field_at_fault=field,
        fault=fault,
    )


@router.get("/campaigns/{name}/copy")
def copy(name: Name, store: OpenStore) -> Response:
    """The whole campaign in one file, which `pyroshock db import` and `pyroshock campaigns restore`
    read."""
    store.read(lambda session: get_campaign_id(session, name))

    def write(out: Path) -> None:
        export_campaign(store, name, out)

    return _saved(write, f"{name}.pyroshock")


def _saved(write: Callable[[Path], None], name: str) -> Response:
    """A file that is written beside nothing else, sent, and removed."""
    folder = Path(tempfile.mkdtemp(prefix="pyroshock-export-"))
    try:
        out = folder / f"export{Path(name).suffix}"
        write(out)
    except BaseException:  # an interruption, too, leaves no file behind; it is raised again
        shutil.rmtree(folder, ignore_errors=True)
        raise
    done = BackgroundTask(shutil.rmtree, folder, ignore_errors=True)
    return FileResponse(out, filename=name, media_type="application/octet-stream", background=done)
