"""The diagnosis of the gap between measurement and twin, as notebooks and the command line see
it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ...common.errors import argument_names
from ...common.frames import frame_of, titled_table
from ...figures.figure import DIMENSIONLESS, BarSeries, ColourRole, Plot, PlotAxis, as_floats
from ...figures.matplotlib_renderer import plot_on
from ..operation import Lines, Result, ResultTable
from ..sentence import Sentence

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from ....diagnosis.verdict import Verdict
    from ....schema.diagnoses import TwinVersion
    from ....twin.effects import Effect


@dataclass(frozen=True, eq=False)
class GapDiagnosis(Result):
    """Where the gap lies, what causes it, and how far it shrinks. `verdict` is the record behind
    it.

    `number` is that of the diagnosis in the store, None for one of a folder. `version` is the
    version of the bench's twin that adopted an effect of it, None where none was adopted. `folder`
    is where a diagnosis that is not stored was read from.
    """

    verdict: Verdict
    number: int | None = None
    version: TwinVersion | None = None
    folder: str = ""

    @property
    def sentence(self) -> str:
        """The answer in a few sentences."""
        return " ".join(item.text for item in self.sentences())

    def sentences(self) -> Sequence[Sentence]:
        """Which effects were considered where not all were, and the answer."""
        from .request import restrictions_among
        from .statements import answer

        restrictions = map(Sentence, restrictions_among(self.verdict.assumptions))
        return (*restrictions, *answer(self.verdict))

    def tables(self) -> Sequence[ResultTable | Lines]:
        """Size, effects, path, causes and places of the model error, and what to do next."""
        from .tables import tables

        return tables(self.verdict)

    def notes(self) -> Sequence[str]:
        """What was adopted."""
        from .adoption_notes import adoption_notes

        return () if self.version is None else tuple(adoption_notes(self.verdict, self.version))

    def stored_keys(self) -> dict[str, Any]:
        """The number of the diagnosis."""
        return {} if self.number is None else {"id": self.number}

    def address(self) -> str:
        """The page of a diagnosis that the store keeps."""
        return "" if self.number is None else f"/diagnoses/{self.number}"

    def summary(self) -> str:
        """The campaign and the answer."""
        from .statements import summary

        return f"{self.verdict.campaign}: {summary(self.verdict)}"

    def next_command(self) -> Sequence[str]:
        """What tells the causes apart, else the report; a folder is not in the store, and goes
        there first."""
        name = self.verdict.campaign
        if self.number is None:
            return ("ingest", self.folder) if self.folder else ()
        if self.verdict.next_runs:
            return ("plan", "discriminate", name)
        return ("report", f"diagnosis:{name}", "--out", f"{name}-diagnosis.html")

    @property
    def recommendations(self) -> list[str]:
        """What to do next, in sentences."""
        from .recommendations import next_steps

        return [step.text for step in next_steps(self.verdict)]

    @property
    def effects(self) -> pd.DataFrame:
        """An effect in each row: probability that it acts, share of the squared gap with its 90 %
        interval, gain on configurations that it was not fitted to, parameters as {name: value} in
        SI."""
        return frame_of(
            (
                {
                    "effect": effect.effect,
                    "probability": effect.inclusion,
                    "share": effect.share,
                    "share_low": effect.ci90[0],
                    "share_high": effect.ci90[1],
                    "held_out_gain": effect.held_out_gain,
                    "named": effect.named,
                    "credible_set": effect.credible_set,
                    "parameters": {
                        parameter.name: parameter.value for parameter in effect.parameters
                    },
                }
                for effect in self.verdict.effects
            ),
            ("effect", "probability", "share", "share_low", "share_high", "held_out_gain", "named"),
        )

    @property
    def sets(self) -> pd.DataFrame:
        """A set of effects in each row of which at least one acts and which these runs cannot tell
        apart, by falling share; an effect that is established by itself is a set of one."""
        return frame_of(
            (
                {
                    "effects": " or ".join(own.effects),
                    "probability": own.inclusion,
                    "share": own.share,
                    "share_low": own.ci90[0],
                    "share_high": own.ci90[1],
                    "held_out_gain": own.held_out_gain,
                    "settled_by": None if own.settled_by is None else own.settled_by.channel,
                }
                for own in self.verdict.named_sets
            ),
            (
                "effects",
                "probability",
                "share",
                "share_low",
                "share_high",
                "held_out_gain",
                "settled_by",
            ),
        )

    @property
    def causes(self) -> pd.DataFrame:
        """An entry of the answer in each row, by falling probability."""
        return frame_of(
            {"cause": " or ".join(cause.effects), "probability": cause.probability}
            for cause in self.verdict.causes
        )

    @property
    def gap(self) -> dict[str, Any]:
        """The size of the gap, of the noise and of the tolerance, in the unit that `metric`
        names."""
        return dict(self.to_json()["gap"])

    @property
    def stages(self) -> pd.DataFrame:
        """The share of the gap that arises in each stage, with its 90 % interval, and its own gap
        in tolerances."""
        return frame_of(
            (
                {
                    "stage": stage.name,
                    "share": stage.share,
                    "share_low": stage.ci90[0],
                    "share_high": stage.ci90[1],
                    "own": stage.own,
                }
                for stage in self.verdict.where.stage
            ),
            ("stage", "share", "share_low", "share_high", "own"),
        )

    @property
    def path(self) -> pd.DataFrame:
        """The gap after each effect was added, the largest share first; fractions on configurations
        not seen."""
        return frame_of(
            (
                {"added": step.added, "gap": step.after, "fraction": step.fraction}
                for step in self.verdict.path
            ),
            ("added", "gap", "fraction"),
        )

    @property
    def fraction(self) -> float | None:
        """The share of the reducible gap that is gone on configurations that the fit has not seen;
        None: not known."""
        return self.verdict.held_out_fraction

    @property
    def shrinkage(self) -> pd.DataFrame:
        """How far the gap shrinks on configurations that the fit has not seen with the effects of
        `path`, a row for each way of holding configurations out."""
        from .wording import held_out_name

        return frame_of(
            (
                {
                    "effects": held_out_name(entry, self.verdict),
                    "held_out_by": entry.held_out_by,
                    "before": entry.before,
                    "after": entry.after,
                    "fraction": entry.fraction,
                }
                for entry in self.verdict.shrinkage
            ),
            ("effects", "held_out_by", "before", "after", "fraction"),
        )

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What the diagnosis assumed, in sentences."""
        return tuple(map(argument_names, self.verdict.assumptions))

    @property
    def fitted(self) -> dict[str, tuple[Effect, ...]]:
        """Effects with the parameters that were fitted, by name ("gun.valve_flow", "a+b"):
        `store.twin(effects=...)` takes them."""
        from ...twins.adopted_effects import adoptable

        return {
            "+".join(effect.id for effect in effects): effects
            for effects in adoptable(self.verdict).values()
        }

    def to_frame(self) -> pd.DataFrame:
        """`effects`."""
        return self.effects

    def to_json(self) -> dict[str, Any]:
        """The report as `pyroshock diagnose --json` prints it."""
        from .diagnosing import report_json

        return report_json(self.verdict)

    def plot(self, ax: Axes | None = None) -> Axes:
        """The shares of the gap by set of effects, with their 90 % intervals, the causes at the
        top.

        Parameters:
            ax: The axes to draw on; by default new ones.
        """
        return plot_on(self.figure(), ax)

    def figure(self) -> Plot:
        """The shares of the gap by set of effects, with their 90 % intervals, as a figure."""
        sets = self.verdict.cause_sets
        members = {name for own in sets for name in own.effects}
        rows = [("named as a cause", own.name, own.share, own.ci90) for own in sets]
        rows += [
            ("not named", effect.effect, effect.share, effect.ci90)
            for effect in self.verdict.effects
            if effect.effect not in members and abs(effect.share) >= 0.005
        ]
        rows = rows[:12]
        series = []
        for kind, role in (("named as a cause", ColourRole.CAUSE), ("not named", ColourRole.OTHER)):
            chosen = [i for i, row in enumerate(rows) if row[0] == kind]
            if chosen:
                low, high = (as_floats([rows[i][3][side] for i in chosen]) for side in (0, 1))
                series.append(
                    BarSeries(
                        as_floats(chosen),
                        as_floats([rows[i][2] for i in chosen]),
                        low=low,
                        high=high,
                        horizontal=True,
                        name=kind,
                        role=role,
                    )
                )
        names = tuple(name for _, name, *_ in rows)
        quantity = "share of the squared gap, with its 90 % interval"
        return Plot(
            f"Gap of {self.verdict.campaign}",
            PlotAxis(quantity, DIMENSIONLESS),
            PlotAxis("effect", DIMENSIONLESS, categories=names, reversed=True),
            tuple(series),
            height=115 + 30 * max(len(names), 2),
        )

    def __repr__(self) -> str:
        return f"<{self.verdict.campaign}: {self.sentence}>"

    def _repr_html_(self) -> str:
        columns = ["effect", "probability", "share", "share_low", "share_high", "held_out_gain"]
        return titled_table(f"{self.verdict.campaign}: {self.sentence}", self.effects[columns])
