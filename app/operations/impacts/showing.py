"""One impact with all that the store knows of it, and a channel of its recording."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from ...common.number_format import finite
from ...common.quantities import heading
from ...common.run_forecasts import rows_of_json
from ..fields import Key, Presentation, request_field
from ..laboratory import Laboratory
from ..operation import (
    Lines,
    Operation,
    Output,
    PlainData,
    Progress,
    Request,
    Result,
    ResultTable,
)
from .impact import PREDICTED, PREDICTION

if TYPE_CHECKING:
    from ...figures.figure import Figure, PlotGrid


class NamedImpact(Request):
    """One impact of the store."""

    impact: Key = request_field(
        help="Give the number of the impact, its `id` in the list.",
        presentation=Presentation(positional=True, metavar="IMPACT"),
    )


@dataclass(frozen=True, eq=False)
class ShownImpact(Result):
    """An impact: `facts` as `impact.impact_page` has them, and `signals`, its channels with their
    keys. `draw` reads its record."""

    facts: Mapping[str, Any]
    signals: Sequence[Mapping[str, Any]]
    draw: Callable[[], PlotGrid]

    def tables(self) -> Sequence[ResultTable | Lines]:
        """Its factors and figures, what was predicted of it before, then its pulses, figures of
        accelerations, findings and channels."""
        lists = {
            key: value
            for key, value in self.facts.items()
            if isinstance(value, list) and key != PREDICTED
        }
        plain = {
            key: value
            for key, value in self.facts.items()
            if key not in (*lists, PREDICTION, PREDICTED) and value is not None
        }
        wide = ("pulses", "channel_figures")
        return (
            ResultTable("", [plain], upright=True),
            *self._predicted(),
            *(
                ResultTable(heading(key), rows, "  none", key in wide)
                for key, rows in lists.items()
            ),
        )

    def _predicted(self) -> Sequence[ResultTable | Lines]:
        """What was predicted of its run before the shot, beside what was measured."""
        if PREDICTION not in self.facts:
            return ()
        return (
            Lines("Predicted before the shot", (self.facts[PREDICTION]["sentence"],)),
            ResultTable("", rows_of_json(self.facts[PREDICTED]), "nothing of it was measured"),
        )

    def figures(self) -> Sequence[Figure]:
        """Its record, and the contact with its pulse."""
        return (self.draw(),)

    def to_json(self) -> dict[str, Any]:
        """Its facts."""
        return dict(self.facts)

    def to_network_json(self) -> Any:
        """The same with the keys that `/channels` takes."""
        return finite({**self.facts, "signals": self.signals})


def _show(request: NamedImpact, laboratory: Laboratory, _: Progress) -> ShownImpact:
    from .impact import get_impact, impact_page, list_signals

    def draw() -> PlotGrid:
        from .impact_plot import impact_figure

        with laboratory.store.reading() as session:
            return impact_figure(session, request.impact)

    with laboratory.store.reading() as session:
        facts = impact_page(session, request.impact)
        recording = get_impact(session, request.impact).recording_id
        signals = [] if recording is None else list_signals(session, recording)
    return ShownImpact(facts, signals, draw)


IMPACT_SHOW: Operation[NamedImpact, ShownImpact] = Operation(
    name="impact-show",
    request=NamedImpact,
    run=_show,
    help="""Show the impact with number IMPACT: its factors, its findings and its pulse.

The versions of the pulse, the figures of each acceleration channel and the channels are listed,
too.""",
    example="pyroshock show 12 --plot impact-12.png",
    command=("impacts", "show"),
    route=("GET", "/impacts/{impact}"),
    outputs=(
        Output("plot", "Draw record and pulse into FILE (.png, .svg, .pdf).", Result.write_figure),
    ),
    absent={"form": "It changes nothing; the page of the impact shows it."},
)


class ChannelSpan(Request):
    """A channel between two instants."""

    channel: Key = request_field(help="Give the key of the channel, as an impact's `signals` do.")
    start_s: float | None = request_field(
        None, help="Begin at this time of the recording's clock. [default: its first sample]"
    )
    stop_s: float | None = request_field(
        None, help="End at this time of the recording's clock. [default: its last sample]"
    )
    points: Annotated[int, Field(ge=4, le=200_000)] = request_field(
        2000, help="Give at most about this number of samples."
    )


def _window(request: ChannelSpan, laboratory: Laboratory, _: Progress) -> PlainData:
    from .signals import channel_window

    with laboratory.store.reading() as session:
        window = channel_window(
            session, request.channel, request.start_s, request.stop_s, request.points
        )
    arrays = {"time_s": window.time_s.tolist(), "values": window.values.tolist()}
    return PlainData({**vars(window), **arrays})


CHANNEL_WINDOW: Operation[ChannelSpan, PlainData] = Operation(
    name="channel-window",
    request=ChannelSpan,
    run=_window,
    help="A channel between two instants in SI: every sample where they fit into `points`, else "
    "the extremes of buckets.",
    route=("GET", "/channels/{channel}"),
    absent={
        "command": "`pyroshock export series` writes the samples of channels.",
        "form": "The page of an impact draws its channels, and fetches what one zooms into.",
        "python": "`store.recording(12)` has the samples of each channel.",
    },
)
