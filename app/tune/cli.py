"""`tune`: from a prescribed spectrum back to settings of the bench."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..cli.common import db_option, json_option, note, open_command_store, print_table, write_json
from ..cli.completion import campaign_names, contact_models, material_names
from ..cli.next_step import suggest_next
from ..cli.options import split_names
from ..common.number_format import percent
from ..common.progress import progress_bar

if TYPE_CHECKING:
    from .service import TunedSettings


@click.command()
@click.option(
    "--target",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    required=True,
    metavar="SPEC.csv",
    help="Read the prescribed spectrum from a CSV file.",
)
@click.option(
    "--tolerance",
    default=None,
    metavar="6dB",
    help="Set the tolerance, such as 6dB or +9/-6dB. [default: that of the file, "
    "else that of NASA-STD-7003]",
)
@click.option(
    "--measured",
    multiple=True,
    callback=split_names,
    metavar="CAMPAIGN",
    help="Learn from the measured shots of these campaigns. Repeat the option, or "
    "give a list: a,b.",
    shell_complete=campaign_names,
)
@click.option(
    "--plate",
    default=None,
    metavar="MATERIAL",
    help="Name the material of the mounted plate. [default: that of the bench]",
    shell_complete=material_names,
)
@click.option(
    "--campaign",
    default=None,
    help="Take the bench of this campaign. [default: the newest gun campaign]",
    shell_complete=campaign_names,
)
@click.option(
    "--sensor",
    default=None,
    metavar="NAME",
    help="Name the sensor for which the spectrum is prescribed. [default: the first]",
)
@click.option(
    "--bullet-mass",
    default=None,
    metavar="MASSES",
    help=(
        "List your bullets (0.2kg,0.5kg), or allow any mass of a range "
        "(0.2kg:1kg). [default: the levels of the factor]"
    ),
)
@click.option(
    "--factors",
    type=click.Path(exists=True, path_type=Path),
    help="Say what the laboratory owns, by the TOML file of a plan's factors.",
)
@click.option(
    "--modes",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Read the measured modes of the plate from a CSV file.",
)
@click.option(
    "--bench",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Describe gun and plate by a TOML file.",
)
@click.option(
    "--contact",
    default=None,
    metavar="LAW|prior|registered|MODEL@VERSION",
    help="Choose the contact model as `predict` does. [default: the model in use, else prior]",
    shell_complete=contact_models,
)
@click.option(
    "--no-adopted",
    is_flag=True,
    help="Leave out the effects that were adopted for the bench after a diagnosis.",
)
@click.option(
    "--impact-at",
    multiple=True,
    metavar="X,Y",
    help="Place the impact points #1, #2 and so on upon the outline of the plate, "
    "in m. The option can be repeated.",
)
@click.option(
    "--sensor-at",
    multiple=True,
    metavar="X,Y",
    help=(
        "Place the sensors acceleration_1, acceleration_2 and so on upon the "
        "plate, in m. The option can be repeated."
    ),
)
@click.option(
    "--q",
    type=float,
    default=10.0,
    show_default=True,
    help="Set Q of the oscillators of the spectrum.",
)
@click.option(
    "--share",
    type=click.FloatRange(0, 1, min_open=True),
    default=1.0,
    show_default=True,
    help="Set the share of the lines that must lie within the tolerance.",
)
@click.option(
    "--at-least",
    type=click.FloatRange(0, 1, min_open=True),
    default=0.5,
    show_default=True,
    metavar="PROBABILITY",
    help="Count a setting as meeting the target from this probability on.",
)
@click.option(
    "--extrapolate", is_flag=True, help="Propose settings outside of the domain of the model, too."
)
@click.option(
    "--seed",
    type=click.IntRange(0),
    default=0,
    show_default=True,
    help="Set the seed of the search and its random draws.",
)
@click.option(
    "--avoid",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Write the settings that must be avoided to FILE, as JSON.",
)
@click.option(
    "--plot",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Draw the spectra of the best settings into FILE.",
)
@db_option
@json_option
def tune(
    target: Path,
    tolerance: str | None,
    measured: tuple[str, ...],
    plate: str | None,
    campaign: str | None,
    sensor: str | None,
    bullet_mass: str | None,
    factors: Path | None,
    modes: Path | None,
    bench: Path | None,
    contact: str | None,
    no_adopted: bool,
    impact_at: tuple[str, ...],
    sensor_at: tuple[str, ...],
    q: float,
    share: float,
    at_least: float,
    extrapolate: bool,
    seed: int,
    avoid: Path | None,
    plot: Path | None,
    db: str,
    json_to: str | None,
) -> None:
    """Search the settings of the bench that give a prescribed spectrum.

    The settings are ranked, each with the probability that every line fits. The first line says
    whether any setting meets the target, with which probability, and what stands in the way if none
    does; the exit code is 1 then. Settings that the bench must not fire are never proposed. A shot
    that was fired updates the next proposal.

    \b
    Example:
        pyroshock tune --target examples/specifications/component.csv --measured rehearsal --plot
        spectra.png
    """
    progress = progress_bar(f"Searching settings for {Path(target).name}", "settings")
    with open_command_store(db) as store:
        from ..predict.arguments import option_name, twin_request
        from .service import factors_of, masses_of, search_settings, target_of
        from .session import Ask

        request = twin_request(
            option_name,
            campaign=campaign,
            modes=modes,
            bench=bench,
            contact=contact,
            plate=plate,
            impact_points=_points(impact_at, "--impact-at"),
            sensors=_points(sensor_at, "--sensor-at"),
            q=q,
            adopted=not no_adopted,
        )
        masses = masses_of(bullet_mass, "--bullet-mass")
        wanted = target_of(target, tolerance)
        ask = Ask(
            wanted,
            request,
            factors_of(factors),
            measured,
            sensor,
            masses,
            share,
            extrapolate,
            seed,
            at_least,
        )
        with progress as step:
            settings = search_settings(store, db, ask, step)
        tuned = settings.tuned
        for line in settings.notes:
            note(line)
        if plot is not None and tuned.proposals:
            from ..figures.matplotlib_renderer import write_figure
            from .figures import goal_figure

            write_figure(goal_figure(tuned, settings.goal), plot)
            note(f"plot: {plot}")
    _show(settings, avoid, json_to)
    _suggest(settings)
    if not settings.attainable:
        raise click.exceptions.Exit(1)


def _suggest(settings: TunedSettings) -> None:
    """The best setting, predicted whole."""
    rows = settings.to_json()
    if rows and settings.attainable:
        best = _words(rows[0]["settings"])
        anvil = (
            ()
            if best["anvil"] in (None, "none")
            else ("--anvil", best["anvil"], "--insulator", best["insulator"])
        )
        suggest_next(
            "predict", "--tank-pressure", f"{best['tank_pressure_pa'] / 1e5:.4g}bar",
            "--bullet-mass", f"{best['bullet_mass_kg']:.4g}kg",
            "--tip", best["tip"], "--tip-radius", f"{best['tip_radius_m'] * 1e3:.4g}mm", *anvil,
            "--impact-position", best["position"],
        )  # fmt: skip


def _show(settings: TunedSettings, avoid: Path | None, json_to: str | None) -> None:
    from .bench_adapter import avoid_json

    tuned, sentence, rows = (
        settings.tuned,
        settings.tuned.attainability.sentence,
        settings.to_json(),
    )
    if avoid is not None:
        write_json([avoid_json(item) for item in tuned.avoid], str(avoid))
    if json_to is not None:
        note(sentence)
        write_json(rows, json_to)
        return
    click.echo(sentence)
    if rows:
        click.echo(
            "\nProbabilities that the lines of the next shot lie within "
            "tolerance, the best setting first"
        )
        print_table([_row(row) for row in rows], "")
    if tuned.avoid:
        click.echo("\nSettings to avoid")
        print_table(
            [{**_words(avoid_json(item)["settings"]), "why": item.reason} for item in tuned.avoid],
            "none",
        )


def _row(row: dict[str, Any]) -> dict[str, Any]:
    return {
        "rank": row["rank"],
        **_words(row["settings"]),
        "target met": percent(row["probability_met"]),
        "every line fits": percent(row["probability_within"]),
        "95 % of lines fit": percent(row["probability_95_percent_within"]),
        "lines that fit": percent(row["share_within"]),
        "smallest_margin_db": row["worst_margin_db"],
        "at_hz": row["worst_frequency_hz"],
        "alternatives": len(row["alternatives"]),
    }


def _words(settings: dict[str, Any]) -> dict[str, Any]:
    """Settings by the words of a table's columns; quantities keep their keys and are SI."""
    return {
        **{key: settings[key] for key in ("tank_pressure_pa", "bullet_mass_kg")},
        "tip": settings["tip_material"],
        "tip_radius_m": settings["tip_radius_m"],
        "anvil": settings["anvil_material"],
        "insulator": settings["insulator"],
        "position": settings["impact_position"],
    }


def _points(texts: tuple[str, ...], name: str) -> tuple[tuple[float, float], ...]:
    """`0.47,0.28` in m, of the outline."""
    points = []
    for text in texts:
        parts = text.split(",")
        try:
            x, y = (float(part) for part in parts)
        except ValueError as error:
            raise ValueError(
                f"{name} is {text!r}; expected two numbers in m, such as 0.47,0.28"
            ) from error
        points.append((x, y))
    return tuple(points)
