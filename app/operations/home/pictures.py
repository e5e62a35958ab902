"""Which pictures the first page shows, and in which order: the usual ones, and saved views."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ..faults import Fault, RequestError
from ..fields import Names, Presentation, request_field
from ..laboratory import Laboratory
from ..operation import FormPage, Operation, Outcome, Progress, Request, Rows

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

#: The usual pictures in their usual order -> what each shows.
PICTURES = {
    "recordings-by-day": "Recordings of the newest days, by the worst finding of the quality "
    "checks",
    "models-in-use": "Force error of the model in use and of its versions on the same pulses, "
    "with 90 % intervals",
    "errors-by-campaign": "Error of the twin on each campaign, by its newest diagnosis",
    "runs-by-plan": "Runs of each plan, unfinished plans first",
}
#: Stands before the name of a saved view.
VIEW = "view "
#: Pictures that one page takes.
MOST = 12


def list_choices(session: Session) -> dict[str, str]:
    """Every picture that the page can show -> what it shows."""
    from ..explore.saved_views import list_view_rows

    views = {
        f"{VIEW}{view.name}": f"The saved view {view.name}" for view in list_view_rows(session)
    }
    return {**PICTURES, **views}


def list_chosen(session: Session) -> list[str]:
    """The pictures that the page shows, in their order. A view that was deleted is left out."""
    from sqlalchemy import select

    from ....schema.home_pictures import HomePictureRow

    chosen = session.scalars(select(HomePictureRow.picture).order_by(HomePictureRow.position)).all()
    choices = list_choices(session)
    return [picture for picture in chosen or PICTURES if picture in choices]


def _list(_: Request, laboratory: Laboratory, __: Progress) -> Rows:
    with laboratory.store.reading() as session:
        chosen, choices = list_chosen(session), list_choices(session)
    rest = [picture for picture in choices if picture not in chosen]
    rows: list[Mapping[str, Any]] = [
        {
            "picture": picture,
            "position": chosen.index(picture) + 1 if picture in chosen else None,
            "shows": choices[picture],
        }
        for picture in (*chosen, *rest)
    ]
    return Rows(rows, "no pictures")


HOME_PICTURES: Operation[Request, Rows] = Operation(
    name="home-pictures",
    request=Request,
    run=_list,
    help="List the pictures of the first page in their order, and those that it could show.",
    example="pyroshock home list",
    command=("home", "list"),
    route=("GET", "/home/pictures"),
    listing=True,
    absent={"form": "It changes nothing; the first page shows the pictures."},
)


class HomeArrangement(Request):
    """The pictures of the first page."""

    pictures: Names = request_field(
        (),
        help="Show these pictures in this order: repeat the option, or give a list: a,b. A saved "
        'view is named "view NAME". [default: the usual pictures in their usual order]',
        presentation=Presentation(metavar="A,B"),
    )


def _arrange(request: HomeArrangement, laboratory: Laboratory, _: Progress) -> Outcome:
    from sqlalchemy import delete

    from ....schema.home_pictures import HomePictureRow

    def replace_rows(session: Session) -> None:
        _refuse_unknown(request.pictures, list_choices(session))
        session.execute(delete(HomePictureRow))
        session.add_all(
            HomePictureRow(picture=picture, position=position)
            for position, picture in enumerate(request.pictures, 1)
        )

    laboratory.store.write(replace_rows)
    with laboratory.store.reading() as session:
        chosen = list_chosen(session)
    line = f"the first page shows: {', '.join(chosen)}"
    return Outcome((line,), {"pictures": chosen}, "/")


def _refuse_unknown(pictures: Sequence[str], choices: Mapping[str, str]) -> None:
    for picture in pictures:
        if picture not in choices:
            message = f"pictures has {picture!r}; expected some of {', '.join(choices)}"
            raise RequestError([Fault("pictures", message)])
    if len(pictures) > MOST:
        message = f"pictures has {len(pictures)} pictures; expected at most {MOST}"
        raise RequestError([Fault("pictures", message)])


HOME_ARRANGE: Operation[HomeArrangement, Outcome] = Operation(
    name="home-arrange",
    request=HomeArrangement,
    run=_arrange,
    help="Choose and order the pictures of the first page. Without pictures the usual ones are "
    "shown again.",
    example="pyroshock home arrange --pictures runs-by-plan,models-in-use",
    command=("home", "arrange"),
    route=("POST", "/home/pictures"),
    form=FormPage("/", "arrange", "/home/pictures"),
)
