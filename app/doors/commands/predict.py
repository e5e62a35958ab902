"""`predict`: what a shot will do, with 90 % bands; with `--plan` or `--shots` every shot of a plan
or of a table, on this machine or a cluster."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from ...common.number_format import format_interval
from ...common.progress import progress_bar
from ...common.quantities import display_of
from ..command_line.common import (
    Function,
    db_option,
    json_option,
    note,
    open_if_exists,
    print_table,
    spreadsheet_guard_option,
    worker_options,
    write_json,
)
from ..command_line.completion import campaign_names, contact_models, material_names, plan_names
from ..command_line.next_step import suggest_next

if TYPE_CHECKING:
    from ....parallel.executor import ExecutorConfig
    from ....schema.session import Store
    from ...operations.predict.batch import PredictedShot, ShotRow
    from ...operations.predict.predicting import ShotRequest
    from ...twins.building import TwinRequest


MANY = (
    click.option(
        "--plan",
        metavar="NAME",
        default=None,
        help="Predict every run of a plan in place of one shot.",
        shell_complete=plan_names,
    ),
    click.option(
        "--shots",
        type=click.Path(exists=True, dir_okay=False, path_type=Path),
        default=None,
        metavar="FILE.csv",
        help="Predict every row of a table with the columns of runs.csv.",
    ),
    click.option(
        "--out",
        type=click.Path(path_type=Path),
        metavar="FILE",
        help="Write the predicted figures to FILE.csv or FILE.parquet.",
    ),
    click.option(
        "--spectra",
        type=click.Path(path_type=Path),
        metavar="FILE",
        help="Write the predicted spectra to FILE.csv or FILE.parquet.",
    ),
    spreadsheet_guard_option,
)
#: Of a table on a screen: what names a shot, and what matters of it.
_SHOWN = ("run", "repetition", "tip_material", "bullet_mass_kg", "tank_pressure_bar")
_FIGURES = ("velocity_m_s", "contact_time_s", "peak_force_n")


@dataclass(frozen=True)
class Many:
    """Where the shots stand, and where what is foretold of them goes."""

    plan: str | None
    shots: Path | None
    out: Path | None
    spectra: Path | None

    @property
    def asked(self) -> bool:
        """Whether there is a table. Raises `ValueError` for options that go with one, without
        it."""
        if self.plan is None and self.shots is None and (self.out or self.spectra):
            raise ValueError(
                "--out and --spectra go with --plan or --shots; one shot prints, or --json FILE"
            )
        return self.plan is not None or self.shots is not None

    def rows(self, store: Store | None) -> list[ShotRow]:
        """Raises `ValueError` for plan and file at once, `LookupError` for a plan without a
        store."""
        from ...operations.predict.batch import rows_of_file, rows_of_plan

        if self.plan is None:
            assert self.shots is not None
            return rows_of_file(self.shots)
        if self.shots is not None:
            raise ValueError("--plan and --shots: expected one of them")
        if store is None:
            raise LookupError(f"no plan {self.plan!r}: there is no store")
        return rows_of_plan(store, self.plan)

    def tell(self, shots: list[PredictedShot], json_to: str | None) -> None:
        """Into the files that were asked for; as JSON or a table where no file takes the
        figures."""
        from ...common.number_format import finite
        from ...operations.predict.batch import write_figures, write_spectra

        if self.spectra is not None:
            note(f"written: {self.spectra}, {write_spectra(self.spectra, shots)} lines")
        if self.out is not None:
            note(f"written: {self.out}, {write_figures(self.out, shots)} shots")
        if json_to is not None:
            write_json(
                [finite({**shot.figures, "srs": list(shot.spectrum)}) for shot in shots], json_to
            )
        elif self.out is None:
            print_table((_short(shot) for shot in shots), "")


def refuse_typed(*names: str) -> None:
    """Options that a table takes the place of would be passed over in silence. Raises `ValueError`
    that names them."""
    source = click.get_current_context().get_parameter_source
    typed = [
        f"--{name.replace('_', '-')}"
        for name in names
        if source(name) is ParameterSource.COMMANDLINE
    ]
    if typed:
        raise ValueError(f"{', '.join(typed)}: of one shot; with --plan or --shots leave it out")


def _short(shot: PredictedShot) -> dict[str, object]:
    row: dict[str, object] = {name: shot.figures[name] for name in _SHOWN if name in shot.figures}
    for name in _FIGURES:
        shown = display_of(name)
        numbers = (
            shown.scale * shot.figures[f"predicted_{name}{end}"] for end in ("", "_low", "_high")
        )
        mean, low, high = format_interval(*numbers)
        row |= {name: mean, f"{shown.label} 90 %": f"{low} to {high}"}
    return row | {name: shot.figures[name] for name in ("rests_on_shots", "extrapolation")}


#: Options of what the operator sets; `tune` and `predict` spell them alike.
_SET = (
    click.option(
        "--tank-pressure",
        metavar="5bar",
        default=None,
        help="Set the gauge pressure in the tank of the gun. [default: 5bar]",
    ),
    click.option(
        "--velocity",
        metavar="20m/s",
        default=None,
        help="Set the velocity of the bullet before contact, in place of the gun.",
    ),
    click.option(
        "--bullet-mass",
        metavar="0.5kg",
        default=None,
        help="Set the mass of the bullet. [default: 0.5kg, or the hammer of a hammer campaign]",
    ),
    click.option(
        "--tip",
        metavar="MATERIAL",
        default="steel",
        show_default=True,
        help="Name the material of the tip.",
        shell_complete=material_names,
    ),
    click.option(
        "--tip-radius",
        metavar="45mm",
        default="45mm",
        show_default=True,
        help="Set the radius of the ball of the tip.",
    ),
    click.option(
        "--plate",
        metavar="MATERIAL",
        default=None,
        help="Name the material of the plate. [default: that of the bench]",
        shell_complete=material_names,
    ),
    click.option(
        "--anvil",
        shell_complete=material_names,
        metavar="MATERIAL|none",
        default="none",
        show_default=True,
        help="Name the material of the anvil on the plate, or `none` if the "
        "bullet strikes the plate.",
    ),
    click.option(
        "--insulator",
        type=click.Choice(("none", "polymeric")),
        default="none",
        show_default=True,
        help="Choose the insulator on the anvil. It needs an anvil.",
    ),
    click.option(
        "--impact-position",
        metavar="'#1'",
        default="#1",
        show_default=True,
        help="Choose the point where the bullet strikes the plate.",
    ),
    click.option(
        "--boundary-conditions",
        type=click.Choice(("free", "fixed")),
        default=None,
        help="Say how the plate is held. [default: free]",
    ),
    click.option(
        "--factor",
        "factors",
        multiple=True,
        metavar="NAME=VALUE",
        help=(
            "Set a factor that the model learned from, in SI: plate_mass_kg, or a factor of your "
            "own. The option can be repeated."
        ),
    ),
)
#: Of `predict` alone: `tune` looks for no way of the valve.
_VALVE = click.option(
    "--valve-profile",
    metavar="FILE.csv|'0:0 0.1:1'",
    default=None,
    help=(
        "Set the position of the gun's valve over time, by points of seconds and position, "
        "where 0 is shut and 1 is open. [default: as the effects say]"
    ),
)
_MADE_OF = (
    click.option(
        "--campaign",
        metavar="NAME",
        default=None,
        help="Take the bench of this campaign. [default: the newest gun campaign]",
        shell_complete=campaign_names,
    ),
    click.option(
        "--bench",
        type=click.Path(path_type=Path),
        default=None,
        help="Describe gun and plate by a TOML file with the tables [gun] and [plate].",
    ),
    click.option(
        "--modes",
        type=click.Path(path_type=Path),
        default=None,
        help="Read the measured modes of the plate from a CSV file.",
    ),
    click.option(
        "--contact",
        metavar="LAW|prior|registered|MODEL@VERSION",
        default=None,
        help="Choose the contact model. [default: the model in use, else prior]",
        shell_complete=contact_models,
    ),
    click.option(
        "--effect",
        "effects",
        multiple=True,
        metavar="ID[:NAME=VALUE,...]",
        help="Add an effect to the nominal twin. The option can be repeated.",
    ),
    click.option(
        "--coupled",
        is_flag=True,
        help=(
            "Solve contact and plate together, which matters for thin plates and soft tips. The "
            "contact is prior or hertz."
        ),
    ),
    click.option(
        "--no-adopted",
        is_flag=True,
        help="Leave out the effects that were adopted for the bench after a diagnosis.",
    ),
    click.option(
        "--impact-at",
        multiple=True,
        metavar="X,Y",
        help=(
            "Place the impact points #1, #2 and so on upon the outline of "
            "the plate, in m. The option can be repeated."
        ),
    ),
    click.option(
        "--sensor-at",
        multiple=True,
        metavar="X,Y",
        help=(
            "Place the sensors acceleration_1, acceleration_2 and so on upon the plate, in m. The "
            "option can be repeated."
        ),
    ),
    click.option(
        "--q",
        type=click.FloatRange(0.5, min_open=True),
        default=10.0,
        show_default=True,
        help="Set Q of the oscillators of the spectrum.",
    ),
    click.option(
        "--frequencies",
        metavar="LOW:HIGH:PER_OCTAVE",
        default=None,
        help="Set the frequencies of the spectrum in Hz, as low:high:per_octave. "
        "[default: 100:10000:6]",
    ),
)


def _with(options: tuple[Any, ...]) -> Callable[[Function], Function]:
    def add(function: Function) -> Function:
        for option in reversed(options):
            function = option(function)
        return function

    return add


@click.command()
@_with(_SET)
@_VALVE
@_with(_MADE_OF)
@click.option(
    "--chain-height",
    metavar="112mm",
    default=None,
    help="Say by how much the chain lifts the plate; a link is 56 mm.",
)
@click.option(
    "--draws",
    type=click.IntRange(0),
    default=64,
    show_default=True,
    help="Set the number of random draws that the bands are computed from.",
)
@click.option(
    "--seed",
    type=click.IntRange(0),
    default=0,
    show_default=True,
    help="Set the seed of the random draws.",
)
@click.option(
    "--plot",
    type=click.Path(path_type=Path),
    default=None,
    metavar="FILE",
    help="Draw the prediction into FILE (.png, .svg, .pdf).",
)
@_with(MANY)
@worker_options("Set the number of processes, for many shots.")
@db_option
@json_option
def predict(
    draws: int,
    seed: int,
    plot: Path | None,
    plan: str | None,
    shots: Path | None,
    out: Path | None,
    spectra: Path | None,
    executor: ExecutorConfig,
    db: str,
    json_to: str | None,
    **asked: Any,
) -> None:
    """Predict velocity, force, acceleration and shock response spectrum of one shot, with 90 %
    bands.

    The first line says what the bands rest on. If a quantity lies beyond the shots that the model
    learned from, their range stands beside the number. Without a store, the bench that ships with
    the software is taken. The contact model is the one in use for the kind of the campaign. A
    factor that no stage uses is an error.

    \b
    Example:
        pyroshock predict --tank-pressure 5bar --bullet-mass 0.5kg --tip steel pyroshock predict
        --velocity 8m/s --tip steel --effect plate.damping:factor=2 --plot shot.png pyroshock
        predict --plan slow-valve --draws 8 --out predicted.csv
    """
    many = Many(plan, shots, out, spectra)
    progress = progress_bar(
        "Predicting the shots" if plan or shots else "Predicting the shot", "shots"
    )
    with open_if_exists(db) as store:
        from ...common.model_registry import models_extra

        if many.asked:
            refuse_typed(*_SETTING, "plot")
            from ...operations.predict.batch import bench_of_rows, predict_batch

            with models_extra(), progress as step:
                bench, rows, remarks = bench_of_rows(
                    store, db, _request(asked), many.rows(store), draws, seed
                )
                predicted_shots = predict_batch(bench, rows, executor, step)
            for remark in remarks:
                note(remark)
            many.tell(predicted_shots, json_to)
            if plan is not None:
                suggest_next("plan", "sheet", plan, "--out", f"{plan}.html")
            return
        from ...operations.predict.predicting import domain_warnings, predict_shot, prediction_json
        from ...operations.predict.tables import quantity_rows, spectrum_rows
        from ...twins.building import twin_of

        request = _request(asked)
        with models_extra(), progress:
            built = twin_of(store, db, request)
            prediction = predict_shot(built, _shot(asked), draws=draws, seed=seed)
        for remark in built.notes:
            note(remark)
        if plot is not None:
            from ...figures.matplotlib_renderer import write_figure
            from ...operations.predict.figures import prediction_figure

            write_figure(prediction_figure(prediction), plot)
            note(f"written: {plot}")
        if json_to is not None:
            write_json(prediction_json(built, prediction), json_to)
            return
        if prediction.rests_on.sentence:
            click.echo(f"{prediction.rests_on.sentence}\n")
        print_table(quantity_rows(prediction), "")
        click.echo()
        print_table(spectrum_rows(prediction), "no plate: no spectrum")
        click.echo()
        print_table(
            ({"stage": stage, "answered": answer} for stage, answer in prediction.models.items()),
            "",
        )
        for warning in domain_warnings(prediction):
            note(warning)
        suggest_next("validate", asked["campaign"] or "CAMPAIGN")


_SETTING = ("tank_pressure", "velocity", "bullet_mass", "tip", "tip_radius", "anvil", "insulator",
"impact_position",
            "boundary_conditions", "factors", "valve_profile", "chain_height")  # fmt: skip


def _request(options: dict[str, Any]) -> TwinRequest:
    """What the twin is made of."""
    from ...operations.predict.arguments import option_name, twin_request

    return twin_request(
        option_name,
        campaign=options["campaign"],
        modes=options["modes"],
        bench=options["bench"],
        contact=options["contact"],
        effects=options["effects"],
        impact_points=tuple(_point(text, "--impact-at") for text in options["impact_at"]),
        sensors=tuple(_point(text, "--sensor-at") for text in options["sensor_at"]),
        plate=options["plate"],
        q=options["q"],
        frequencies=options["frequencies"],
        adopted=not options["no_adopted"],
        chain_height=options["chain_height"] or 0.0,
        coupled=options["coupled"],
    )


def _shot(words: dict[str, Any]) -> ShotRequest:
    from ...operations.predict.arguments import option_name, shot_of
    from ...operations.predict.predicting import parse_factor

    return shot_of(
        option_name,
        tank_pressure=words["tank_pressure"] or None,
        velocity=words["velocity"] or None,
        bullet_mass=words["bullet_mass"] or None,
        tip=words["tip"],
        tip_radius=words["tip_radius"],
        anvil=words["anvil"],
        insulator=words["insulator"],
        impact_position=words["impact_position"],
        boundary_conditions=words["boundary_conditions"],
        valve_profile=words["valve_profile"],
        factors=dict(parse_factor(text) for text in words["factors"]),
    )


def _point(text: str, name: str) -> tuple[float, float]:
    try:
        x, y = map(float, text.split(","))
    except ValueError as error:
        raise ValueError(f"{name} is {text!r}; expected X,Y in m, such as 0.47,0.28") from error
    return x, y
