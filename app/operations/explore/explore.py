"""`explore`: any stored quantity against any other, coloured by a third."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..faults import read
from ..laboratory import Laboratory
from ..operation import Operation, Output, Progress, Result
from .request import Exploration

if TYPE_CHECKING:
    from .result import Explored


def with_view(request: Exploration, laboratory: Laboratory) -> Exploration:
    """The request with the fields of the view that it names; what it says itself goes before.

    Raises `LookupError` for a view that there is not.
    """
    if request.view is None:
        return request
    from .saved_views import get_view

    with laboratory.store.reading() as session:
        saved = dict(get_view(session, request.view).request)
    own = {name: getattr(request, name) for name in request.model_fields_set}
    return read(Exploration, {**saved, **own}, "stored")


def _explore(request: Exploration, laboratory: Laboratory, _: Progress) -> Explored:
    from .chart import axes_of, chart_data
    from .result import Explored
    from .rows import list_quantities, read_rows

    request = with_view(request, laboratory)
    axes = axes_of(request, list_quantities(laboratory, request.subject))
    # what tells the selected rows apart, which nobody reads where none is selected
    more: list[str] = []
    if request.has_selection and request.subject != "models":
        more = ["campaign", "run", "repetition"]
    rows = read_rows(request, laboratory, [*axes.names(), *more])
    return Explored(request, rows, chart_data(request, axes, rows))


EXPLORE: Operation[Exploration, Explored] = Operation(
    name="explore",
    request=Exploration,
    run=_explore,
    help="""Draw any stored quantity against any other, coloured by a third.

Rows are impacts, shots, records of channels or versions of models, filtered by the conditions that
lists take. A scatter states Spearman's correlation where it is established, a distribution its
quantiles, and a control chart the limits from the moving range and the points that break a rule. Of
many rows, those that lie close together are drawn as one mark; none is left out.""",
    example="pyroshock explore --x impact_velocity_m_s --y peak_force_n --colour tip_material \\\n"
    "    --plot force.png\n"
    "pyroshock explore --kind control --y contact_time_s --where tip_material=steel\n"
    "pyroshock explore --view force-by-velocity --select-x 0.5:0.8 --json",
    command=("explore",),
    route=("GET", "/explore"),
    outputs=(Output("plot", "Draw the chart into FILE (.png, .svg, .pdf).", Result.write_figure),),
    absent={"form": "It changes nothing; the page /explore draws it."},
)
