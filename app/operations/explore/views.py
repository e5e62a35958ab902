"""Save a view of the store by name; list, show, rename, delete and restore views."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any
from urllib.parse import quote

from pydantic import Field

from ....schema.person_roles import USER, Person
from ..faults import FieldError, about
from ..fields import Presentation, request_field
from ..form import texts_of
from ..laboratory import Laboratory
from ..operation import FormPage, Operation, Outcome, Progress, Request, Rows, same_fields
from .request import Exploration

if TYPE_CHECKING:
    from ....schema.saved_views import SavedView
    from .result import Explored

ViewName = Annotated[str, Field(min_length=1, max_length=200)]
_NAMED = Presentation(positional=True, metavar="NAME", completion="view_names")
_NO_FORM = {"form": "It changes nothing; the page /explore lists the views."}


class ViewSaving(Exploration):
    """A chart of stored rows that gets a name."""

    name: ViewName = request_field(
        help="Name the view.", presentation=Presentation(positional=True, metavar="NAME")
    )
    creator: str | None = request_field(
        None, max_length=200, help="Say who saves it; of who is signed in it is the name."
    )
    replace: bool = request_field(
        False, help="Replace a view of the same name, which can be restored afterwards."
    )


class ViewList(Request):
    """Which views are listed."""

    deleted: bool = request_field(False, help="List the deleted views, which can be restored.")


class NamedView(Request):
    """A view."""

    name: ViewName = request_field(help="Name the view.", presentation=_NAMED)


class ViewRenaming(NamedView):
    """A view that gets another name."""

    new_name: ViewName = request_field(
        help="Give the new name.", presentation=Presentation(positional=True, metavar="NEW_NAME")
    )


@dataclass(frozen=True)
class ListedViews(Rows):
    """Saved views with what they show."""

    def shortened(self, row: Mapping[str, Any]) -> dict[str, Any]:
        """A view as a line of a table."""
        return {name: value for name, value in row.items() if name != "request"}


def view_row(view: SavedView) -> dict[str, Any]:
    """A view as plain data: `shows` is what its chart shows, in words."""
    request = view.request
    axes = (request.get("y"), request.get("x"), request.get("colour"))
    return {
        "name": view.name,
        "shows": " ".join(
            [
                f"{request.get('kind', 'scatter')} of {request.get('subject', 'impacts')}:",
                ", ".join(str(axis) for axis in axes if axis) or "the usual quantities",
            ]
        ),
        "creator": view.creator,
        "saved_at": view.saved_at.isoformat(timespec="seconds"),
        "request": dict(request),
    }


def view_address(name: str) -> str:
    """The page of a view."""
    return f"/explore?view={quote(name, safe='')}"


def _done(name: str, words: str, page: str) -> Outcome:
    return Outcome((f"view {name} is {words}",), {"name": name}, page)


def _list(request: ViewList, laboratory: Laboratory, _: Progress) -> ListedViews:
    from .saved_views import list_view_rows

    with laboratory.store.reading() as session:
        rows = [view_row(view) for view in list_view_rows(session, deleted=request.deleted)]
    empty = (
        "no deleted views" if request.deleted else "no views yet; save one: pyroshock views save"
    )
    return ListedViews(rows, empty)


def _show(request: NamedView, laboratory: Laboratory, progress: Progress) -> Explored:
    from .explore import EXPLORE

    return EXPLORE.answer(Exploration(view=request.name), laboratory, progress)


def _save(request: ViewSaving, laboratory: Laboratory, progress: Progress) -> Outcome:
    from .explore import EXPLORE, with_view
    from .saved_views import add_view

    own = same_fields(request, Exploration)
    question = Exploration(**{name: own[name] for name in own if name in request.model_fields_set})
    whole = with_view(question, laboratory).model_copy(update={"view": None})
    EXPLORE.answer(whole, laboratory, progress)  # what cannot be drawn is not saved
    stated = texts_of(whole).keys()
    fields = {key: value for key, value in whole.model_dump(mode="json").items() if key in stated}
    creator = _creator(request, laboratory.person)
    with about("name"):
        laboratory.store.write(
            lambda session: add_view(
                session, request.name, creator, fields, replace=request.replace
            )
        )
    return _done(request.name, "saved", view_address(request.name))


def _creator(request: ViewSaving, person: Person) -> str | None:
    """The name of who is signed in; of others what they say. Raises `FieldError` for the name of
    somebody else."""
    if person.kind != USER:
        return request.creator
    if request.creator not in (None, person.name):
        raise FieldError(
            "creator",
            f"creator is {request.creator!r}; expected none, for you are signed in as "
            f"{person.name}",
        )
    return person.name


def _rename(request: ViewRenaming, laboratory: Laboratory, _: Progress) -> Outcome:
    from .saved_views import rename_view

    with about("new_name"):
        laboratory.store.write(lambda session: rename_view(session, request.name, request.new_name))
    return _done(request.name, f"renamed {request.new_name}", view_address(request.new_name))


def _lost(request: NamedView, laboratory: Laboratory) -> str:
    from .saved_views import get_view

    with laboratory.store.reading() as session:
        shows = view_row(get_view(session, request.name, "name"))["shows"]
    return f"view {request.name} ({shows})"


def _delete(request: NamedView, laboratory: Laboratory, _: Progress) -> Outcome:
    from .saved_views import delete_view

    laboratory.store.write(lambda session: delete_view(session, request.name))
    words = f"deleted; pyroshock views restore {request.name} has it again"
    return _done(request.name, words, "/explore#deleted-views")


def _restore(request: NamedView, laboratory: Laboratory, _: Progress) -> Outcome:
    from .saved_views import restore_view

    with about("name"):
        laboratory.store.write(lambda session: restore_view(session, request.name))
    return _done(request.name, "restored", view_address(request.name))


VIEW_LIST: Operation[ViewList, ListedViews] = Operation(
    name="view-list",
    request=ViewList,
    run=_list,
    help="List the saved views of the store with what each shows.",
    example="pyroshock views list",
    command=("views", "list"),
    route=("GET", "/views"),
    listing=True,
    absent=_NO_FORM,
)
VIEW_SHOW: Operation[NamedView, Explored] = Operation(
    name="view-show",
    request=NamedView,
    run=_show,
    help="Draw a saved view with the rows that the store has now, as `pyroshock explore --view`.",
    example="pyroshock views show force-by-velocity",
    command=("views", "show"),
    route=("GET", "/views/{name}"),
    absent=_NO_FORM,
)
VIEW_SAVE: Operation[ViewSaving, Outcome] = Operation(
    name="view-save",
    request=ViewSaving,
    run=_save,
    help="Save a chart of stored rows under a name. What is saved is the question: the view shows "
    "the rows that the store has when it is opened.",
    example="pyroshock views save force-by-velocity --x impact_velocity_m_s --y peak_force_n",
    command=("views", "save"),
    route=("POST", "/views"),
    form=FormPage("/explore", "save-view", "/explore/views"),
)
VIEW_RENAME: Operation[ViewRenaming, Outcome] = Operation(
    name="view-rename",
    request=ViewRenaming,
    run=_rename,
    help="Give a saved view another name.",
    example="pyroshock views rename force-by-velocity force",
    command=("views", "rename"),
    route=("POST", "/views/{name}/rename"),
    form=FormPage("/explore", "rename-view", "/explore/views/{name}/rename"),
)
VIEW_DELETE: Operation[NamedView, Outcome] = Operation(
    name="view-delete",
    request=NamedView,
    run=_delete,
    deletes=_lost,
    help="Delete a saved view. `pyroshock views restore NAME` has it again.",
    example="pyroshock views delete force-by-velocity --yes",
    command=("views", "delete"),
    route=("POST", "/views/{name}/delete"),
    form=FormPage("/explore/views/{name}/delete", "delete-view", "/explore/views/{name}/delete"),
)
VIEW_RESTORE: Operation[NamedView, Outcome] = Operation(
    name="view-restore",
    request=NamedView,
    run=_restore,
    help="Restore the view of this name that was deleted last.",
    example="pyroshock views restore force-by-velocity",
    command=("views", "restore"),
    route=("POST", "/views/{name}/restore"),
    form=FormPage("/explore", "restore-view", "/explore/views/{name}/restore"),
)
