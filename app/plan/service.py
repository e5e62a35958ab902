"""Plans of campaigns as notebooks make and read them: `store.plan.lhs("summer", runs=105)`."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypedDict, Unpack, overload

from ...doe.plans import StoredPlan, list_plans, read_plan
from ...files.spreadsheet_guard import guarded_frame, guarding
from ...files.toml_text import read_toml_text
from ...schema.known_factors import BY_COLUMN, BY_NAME
from ...schema.session import Store
from ..common.errors import raises_library_errors
from ..common.frames import frame_of, si, step_bar, titled_table
from ..figures.matplotlib_renderer import plot_on

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from ...doe.designs.base import SurfaceWords, TwoLevelWords
    from ...doe.designs.pydoe import Alpha, Exchange, Face, LhsCriterion, OptimalCriterion
    from ...doe.merit.quality import Quality
    from ..common.frames import Quantity
    from ..figures.figure import Plot


class PlanSettings(TypedDict, total=False):
    """What every method of design takes.

    `kind`: "gun" (the default) or "hammer", whose shipped factors are varied. `factors`: a factors
    file in TOML, its path or its text, in their place. `ranges`: factors that become continuous,
    each with its lowest and highest value and, if wished, a step. A factor is named as in the store
    ("tank_pressure", numbers in SI) or as in tables ("tank_pressure_bar", numbers in bar); texts
    with units and quantities of pint go with both. `repetitions`: hits or shots of each run.
    `seed`: the same seed, the same plan; drawn and kept where it is left out. `gun`: a campaign
    folder whose gun fires the plan. `replicates`: copies of the whole design. `centre_points`: runs
    in the middle of all ordered factors. `order`: "split-plot" changes heavy parts seldom, "random"
    is full randomisation. `blocks`: visits of every heavy set-up, forwards and backwards in turn.
    """

    kind: Literal["gun", "hammer"]
    factors: str | os.PathLike[str] | None
    ranges: Mapping[str, Sequence[Quantity]]
    repetitions: int
    seed: int | None
    gun: str | os.PathLike[str] | None
    description: str | None
    replicates: int
    centre_points: int
    order: Literal["split-plot", "random"]
    blocks: int


class PlanQuality:
    """The quality of a design: balance, spread, changeovers, and what goes with time. `figures` has
    the numbers."""

    def __init__(self, stored: StoredPlan) -> None:
        from ...doe.merit.quality import quality

        self._stored = stored
        self._treatments = stored.treatments("planned", "done")
        self.figures: Quality = quality(stored.space, self._treatments)

    def to_frame(self) -> pd.DataFrame:
        """A row for each figure (index: its name), with its words, value, and whether less or more
        of it is better."""
        import pandas as pd

        from ...doe.merit.quality import FIGURES

        rows = [
            {"figure": name, "words": words, "value": getattr(self.figures, name), "better": better}
            for name, (words, better) in FIGURES.items()
        ]
        changes = [
            {
                "figure": f"changeovers_{name}",
                "words": f"changeovers, {name}",
                "value": count,
                "better": "less",
            }
            for name, count in self.figures.changeovers.items()
        ]
        return pd.DataFrame(rows + changes).set_index("figure")

    def plot(self, ax: Axes | None = None) -> Axes:
        """How far each pair of levels is from its share, on `ax` or on axes that are made."""
        return plot_on(self.figure(), ax)

    def figure(self) -> Plot:
        """How far each pair of levels is from its share, as a figure."""
        from ...doe.merit.pair_matrix import level_labels, pair_matrix
        from .figures import pairs_figure

        space = self._stored.space
        return pairs_figure(level_labels(space), pair_matrix(space, self._treatments))

    def __repr__(self) -> str:
        shown = ", ".join(
            f"{name} {getattr(self.figures, name):.4g}" for name in ("worst_pair", "d_efficiency")
        )
        return f"<PlanQuality of {self._stored.name!r}: {self.figures.runs} runs, {shown}>"

    def _repr_html_(self) -> str:
        return titled_table(f"Quality of plan {self._stored.name}", self.to_frame(), 40)


class PlannedDesign:
    """A plan of the store: its runs, their quality and their run sheet. `stored` is the plan of the
    database layer."""

    def __init__(self, stored: StoredPlan) -> None:
        self.stored = stored

    @property
    def name(self) -> str:
        return self.stored.name

    @property
    def method(self) -> str:
        """The method of design, with those of its options that are not the usual ones."""
        return self.stored.method

    @property
    def seed(self) -> int | None:
        return self.stored.seed

    def __len__(self) -> int:
        return len(self.stored.runs)

    def to_frame(self) -> pd.DataFrame:
        """A row for each run, in order of run: its state, its factors and what follows from them,
        numbers in SI.

        Columns of quantities end in their unit ("tank_pressure_pa"); `.attrs["units"]` has the unit
        of each.
        """
        from ..common.plan_tables import cells_of, settings_in_si

        own = {f.column: str(f.unit) for f in self.stored.space.factors if f.numbers is not None}
        rows = []
        for run in self.stored.runs:
            cells: dict[str, Any] = {
                "run": run.run,
                "status": run.status,
                "repetitions": run.repetitions,
            }
            for column, text in settings_in_si(cells_of(run)).items():
                cells[column] = float(text) if column in own else text
            rows.append(
                cells
                | {
                    "recorded": len(run.accepted),
                    "rejected": len(run.rejected),
                    "reason": run.reason,
                }
            )
        frame = frame_of(rows)
        frame.attrs["units"] |= {column: unit for column, unit in own.items() if column in frame}
        return frame

    @raises_library_errors
    def quality(self) -> PlanQuality:
        """Of the runs that are not discarded. Raises `InvalidValueError` where none is left."""
        return PlanQuality(self.stored)

    def aliases(self) -> list[str]:
        """What a two-level design cannot tell apart: "tip_radius = plate_material*insulator"; none
        of other designs."""
        from ...doe.merit.quality import alias_lines, aliases

        treatments = self.stored.treatments("planned", "done")
        return alias_lines(aliases(self.stored.space, treatments)) if len(treatments) else []

    @overload
    def sheet(self, path: None = None, *, spreadsheet_guard: bool = True) -> str: ...

    @overload
    def sheet(self, path: str | os.PathLike[str], *, spreadsheet_guard: bool = True) -> Path: ...

    @raises_library_errors
    def sheet(
        self, path: str | os.PathLike[str] | None = None, *, spreadsheet_guard: bool = True
    ) -> str | Path:
        """The run sheet: its text as CSV, or the path that it was written to, as .csv, .xlsx or
        .html by the suffix.

        In CSV a text that begins with = + - @ gets an apostrophe, so that no spreadsheet takes it
        for a formula; `spreadsheet_guard=False` leaves it as it is. Raises `InvalidValueError` for
        another suffix.
        """
        from ...doe.sheet import sheet_text, write_sheet

        with guarding(spreadsheet_guard):
            if path is None:
                return sheet_text(self.stored)
            write_sheet(self.stored, Path(path))
        return Path(path)

    @raises_library_errors
    def simulate(
        self,
        folder: str | os.PathLike[str],
        *,
        seed: int = 0,
        effects: Mapping[str, float] | None = None,
        echoes: bool = False,
        name: str | None = None,
        repetitions: int | None = None,
        trigger: str | float | None = None,
        pre_trigger: Quantity | None = None,
        jobs: int | None = None,
        progress: bool = True,
    ) -> Path:
        """Fire the plan on the virtual bench into a new campaign folder, as `pyroshock simulate`
        does.

        The folder is returned: `store.ingest(plan.simulate("summer"))`. The same `seed` gives the
        same files. `effects` are strengths by name ({"gun.blow_by": 3}): 0 takes an effect away, 1
        is a realistic bench's and the usual one. With `echoes` the edges of the plate act on what
        strikes it while it touches. `name` is the campaign's and `repetitions` the hits or shots of
        each run, both the plan's unless they are given. Of a gun, a recording begins `pre_trigger`
        ("300ms") before the share `trigger` of the tank's pressure is lost ("5%" or 0.05; "none": a
        recorder started by hand). `jobs` processes work at once, by default one for each core, at
        most 4.

        What was set and what really happened is in FOLDER.sealed.json beside the folder. Raises
        `InvalidValueError` for a folder that is not empty and for what cannot be fired.
        """
        from .rehearsal import simulate_plan

        with step_bar(self.name, "recordings", progress) as step:
            return simulate_plan(
                self.stored,
                Path(folder),
                seed=seed,
                effects=effects,
                echoes=echoes,
                name=name,
                repetitions=repetitions,
                trigger=trigger,
                pre_trigger=pre_trigger,
                jobs=jobs,
                progress=step,
            ).folder

    def plot(self, ax: Axes | None = None) -> Axes:
        """The levels of every factor from run to run, on `ax` or on axes that are made."""
        return plot_on(self.figure(), ax)

    def figure(self) -> Plot:
        """The levels of every factor from run to run, as a figure."""
        from .figures import run_order_figure

        title = f"{self.name}: {len(self)} runs"
        treatments = self.stored.treatments("planned", "done")
        return run_order_figure(self.stored.space, treatments, title)

    def __repr__(self) -> str:
        seed = "" if self.seed is None else f", seed {self.seed}"
        return f"<PlannedDesign {self.name!r}: {len(self)} runs, {self.method}{seed}>"

    def _repr_html_(self) -> str:
        return titled_table(repr(self)[1:-1], self.to_frame())


class PlanCollection:
    """The plans of a store, and the methods to make one. Each design is put in an order of run with
    few changeovers, gets its tank pressures, is held against the limits of the bench, and is stored
    under its name.

    All methods raise `InvalidValueError` for what the factors do not allow, a name in use, and runs
    beyond the bench.
    """

    def __init__(self, store: Store) -> None:
        self._store = store

    @raises_library_errors
    def list(self) -> pd.DataFrame:
        """A row for each plan, with its method and its counts of runs by state."""
        with self._store.reading() as session:
            return frame_of(list_plans(session), ("name", "kind", "method", "seed", "runs"))

    @raises_library_errors
    def open(self, name: str) -> PlannedDesign:
        """A stored plan. Raises `NotFoundError`, which names those there are."""
        with self._store.reading() as session:
            return PlannedDesign(read_plan(session, name))

    @raises_library_errors
    def make(
        self,
        name: str,
        *,
        method: str,
        runs: int | None = None,
        table: str | os.PathLike[str] | None = None,
        options: Mapping[str, Any] | None = None,
        **settings: Unpack[PlanSettings],
    ) -> PlannedDesign:
        """A plan by any method of `doe.designs.methods.METHODS`, with the `options` that it has
        there."""
        from .planning import make_plan

        given: dict[str, Any] = {key: value for key, value in settings.items() if value is not None}
        if "factors" in given:
            given["factors"] = _factors_text(given["factors"])
        if "gun" in given:
            given["gun"] = Path(given["gun"])
        given["ranges"] = {
            name: _range_of(name, limits) for name, limits in given.get("ranges", {}).items()
        }
        path = None if table is None else Path(table)
        return PlannedDesign(
            make_plan(self._store, method, name, runs=runs, table=path, options=options, **given)
        )

    def lhs(
        self,
        name: str,
        *,
        runs: int,
        criterion: Literal["balance"] | LhsCriterion = "balance",
        **settings: Unpack[PlanSettings],
    ) -> PlannedDesign:
        """A Latin hypercube: balanced in levels, pairs and triples, or the best by one of pyDOE3's
        criteria."""
        return self.make(
            name, method="lhs", runs=runs, options={"criterion": criterion}, **settings
        )

    def sobol(self, name: str, *, runs: int, **settings: Unpack[PlanSettings]) -> PlannedDesign:
        """The first points of a scrambled Sobol' sequence."""
        return self.make(name, method="sobol", runs=runs, **settings)

    def halton(self, name: str, *, runs: int, **settings: Unpack[PlanSettings]) -> PlannedDesign:
        """The first points of a shifted Halton sequence."""
        return self.make(name, method="halton", runs=runs, **settings)

    def factorial(
        self, name: str, *, levels: int = 3, **settings: Unpack[PlanSettings]
    ) -> PlannedDesign:
        """Every feasible treatment, with `levels` values of each continuous factor."""
        return self.make(name, method="factorial", options={"levels": levels}, **settings)

    def subset(
        self, name: str, *, reduction: int = 2, levels: int = 3, **settings: Unpack[PlanSettings]
    ) -> PlannedDesign:
        """About one in `reduction` of all treatments, in balance: a generalized subset design."""
        return self.make(
            name, method="subset", options={"reduction": reduction, "levels": levels}, **settings
        )

    def fractional_factorial(
        self,
        name: str,
        *,
        generators: str | None = None,
        resolution: int = 4,
        categorical: TwoLevelWords = "refuse",
        **settings: Unpack[PlanSettings],
    ) -> PlannedDesign:
        """Two levels a factor, by `generators` ("a b c ab") or the smallest of a resolution; see
        `aliases()`."""
        options = {"generators": generators, "resolution": resolution, "categorical": categorical}
        return self.make(name, method="fractional-factorial", options=options, **settings)

    def plackett_burman(
        self, name: str, *, categorical: TwoLevelWords = "refuse", **settings: Unpack[PlanSettings]
    ) -> PlannedDesign:
        """Two levels a factor in the next multiple of four runs; see `aliases()`."""
        return self.make(
            name, method="plackett-burman", options={"categorical": categorical}, **settings
        )

    def central_composite(
        self,
        name: str,
        *,
        face: Face = "ccf",
        alpha: Alpha = "orthogonal",
        centre: int = 4,
        cube: float = 0.5,
        categorical: SurfaceWords = "refuse",
        **settings: Unpack[PlanSettings],
    ) -> PlannedDesign:
        """Corners, stars and twice `centre` centre points, for a quadratic surface over factors
        with an order."""
        options = {
            "face": face,
            "alpha": alpha,
            "centre": centre,
            "cube": cube,
            "categorical": categorical,
        }
        return self.make(name, method="central-composite", options=options, **settings)

    def box_behnken(
        self,
        name: str,
        *,
        centre: int | None = None,
        categorical: SurfaceWords = "refuse",
        **settings: Unpack[PlanSettings],
    ) -> PlannedDesign:
        """Midpoints of edges and centre points, for a quadratic surface without runs at the corners
        of the range."""
        options = {"centre": centre, "categorical": categorical}
        return self.make(name, method="box-behnken", options=options, **settings)

    def optimal(
        self,
        name: str,
        *,
        runs: int,
        criterion: OptimalCriterion = "D",
        degree: int = 1,
        exchange: Exchange = "detmax",
        levels: int = 3,
        **settings: Unpack[PlanSettings],
    ) -> PlannedDesign:
        """The runs that serve a polynomial model of `degree` best, by the D, A or I criterion."""
        options = {"criterion": criterion, "degree": degree, "exchange": exchange, "levels": levels}
        return self.make(name, method="optimal", runs=runs, options=options, **settings)

    def from_table(
        self,
        name: str,
        *,
        table: str | os.PathLike[str] | pd.DataFrame,
        **settings: Unpack[PlanSettings],
    ) -> PlannedDesign:
        """Somebody else's design, in its order: a CSV file or a DataFrame with `run` and the
        columns of the factors."""
        if isinstance(table, str | os.PathLike):
            return self.make(name, method="import", table=table, **settings)
        with tempfile.TemporaryDirectory(prefix="pyroshock-table-") as scratch:
            path = Path(scratch) / "table.csv"
            guarded_frame(table).to_csv(path, index=False)
            return self.make(name, method="import", table=path, **settings)


def _factors_text(factors: str | os.PathLike[str]) -> str:
    """The text of a factors file; a text with a line end or a sign of equality is one."""
    if isinstance(factors, str) and ("\n" in factors or "=" in factors):
        return factors
    return read_toml_text(Path(factors))


def _range_of(name: str, limits: Sequence[Quantity]) -> tuple[float, ...]:
    """Limits and step in the unit of the factor's column."""
    factor = BY_NAME.get(name) or BY_COLUMN.get(name)
    if factor is None or factor.si_unit is None:
        return tuple(si(value, "", f"range of {name}") for value in limits)
    name_of_column = name == factor.column and name != factor.name

    def in_column(value: Quantity) -> float:
        has_unit = isinstance(value, str) or hasattr(value, "to")
        number = si(value, str(factor.si_unit), f"range of {name}")
        return number if name_of_column and not has_unit else number / factor.scale

    return tuple(map(in_column, limits))
