"""`diagnose`: where the gap between twin and bench lies, what causes it, how far it shrinks."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...common.progress import progress_bar
from ..command_line.common import (
    db_option,
    json_option,
    note,
    open_command_store,
    open_if_exists,
    print_table,
    write_json,
)
from ..command_line.completion import campaign_names, effect_ids, model_versions
from ..command_line.next_step import suggest_next
from ..command_line.options import split_names

if TYPE_CHECKING:
    from ....diagnosis.verdict import Verdict
    from ....schema.diagnoses import TwinVersion
    from ...operations.diagnose.service import GapDiagnosis

_STAGES = ("gun", "contact", "plate")


@click.command()
@click.argument("target", metavar="CAMPAIGN_OR_FOLDER", shell_complete=campaign_names)
@click.option(
    "--simulator",
    metavar="nominal|MODEL@VERSION",
    default=None,
    help="Choose the simulator of the contact; models:/MODEL@VERSION is accepted, "
    "too. [default: nominal]",
    shell_complete=model_versions,
)
@click.option(
    "--html",
    type=click.Path(dir_okay=False, path_type=Path),
    default=None,
    help="Write the result to FILE as a page.",
)
@click.option(
    "--with",
    "with_effects",
    multiple=True,
    metavar="EFFECT",
    help="Consider these effects only. Repeat the option, or give a list: a,b.",
    shell_complete=effect_ids,
)
@click.option(
    "--without",
    "without_effects",
    multiple=True,
    metavar="EFFECT",
    help="Leave these effects out. Repeat the option, or give a list: a,b.",
    shell_complete=effect_ids,
)
@click.option(
    "--adopt",
    multiple=True,
    metavar="EFFECT|none",
    help=(
        "Let predictions of this bench use these effects from now on, or the mean of effects that "
        "cannot be told apart: a/b; `none` ends this. Repeat the option, or give a list: a,b."
    ),
    shell_complete=effect_ids,
)
@click.option(
    "--tolerance",
    "tolerances",
    multiple=True,
    callback=split_names,
    metavar="STAGE=SIZE",
    help="Set the tolerance of a stage: gun=1%, contact=3% or plate=0.5dB. Repeat "
    "the option, or give a list: a,b.",
)
@click.option(
    "--uncertain",
    multiple=True,
    callback=split_names,
    metavar="NUMBER=SD",
    help=(
        "Set the standard deviation of a number, in SI: bullet_mass_kg=0.001. Those of the contact "
        "are shares. Repeat the option, or give a list: a,b."
    ),
)
@click.option(
    "--modes",
    type=click.Path(path_type=Path),
    default=None,
    help="Read the measured modes of the plate from a CSV file.",
)
@click.option(
    "--bench",
    type=click.Path(path_type=Path),
    default=None,
    help="Describe the plate by a TOML file with the table [plate].",
)
@click.option(
    "--seed",
    type=click.IntRange(0),
    default=0,
    show_default=True,
    help="Set the seed: the same seed gives the same answer.",
)
@click.option(
    "--list",
    "listed",
    is_flag=True,
    help="List the diagnoses of the campaign that the store holds.",
)
@db_option
@json_option
def diagnose(
    target: str,
    html: Path | None,
    adopt: tuple[str, ...],
    listed: bool,
    db: str,
    json_to: str | None,
    **given: Any,
) -> None:
    """Diagnose where the gap between measurement and twin lies, which effect causes it, and how far
    it shrinks with that effect.

    The store keeps the diagnosis of a campaign that it holds. A folder is diagnosed without being
    stored.

    \b
    Example:
        pyroshock diagnose examples/first-shots --html gap.html
        pyroshock diagnose slow-valve --with gun.valve_flow,gun.blow_by
    """
    if listed:
        _tell_past(target, db, json_to)
        return
    progress = progress_bar(f"Diagnosing {target}", "steps")
    wanted = "+".join(_effect_ids(adopt)) or None
    with open_if_exists(db, silent=True) as store:
        from ...operations.diagnose.service import diagnose_campaign

        with progress as step:
            diagnosis = diagnose_campaign(store, db, target, step, adopt=wanted, **_read(given))
        if html is not None:
            from ...operations.diagnose.report import write_page

            write_page(diagnosis.verdict, html)
            note(f"written: {html}")
        if diagnosis.version is not None and wanted is not None:
            _tell_adopted(diagnosis.verdict, diagnosis.version, wanted)
    if json_to is not None:
        write_json(diagnosis.to_json(), json_to)
    else:
        tell_diagnosis(diagnosis)
    _suggest(diagnosis, target)


def _suggest(diagnosis: GapDiagnosis, target: str) -> None:
    """What tells the causes apart, else the report; a folder is not in the store, and goes there
    first."""
    name = diagnosis.verdict.campaign
    if diagnosis.number is None:
        suggest_next("ingest", target)
    elif diagnosis.verdict.next_runs:
        suggest_next("plan", "discriminate", name)
    else:
        suggest_next("report", f"diagnosis:{name}", "--out", f"{name}-diagnosis.html")


def _tell_adopted(verdict: Verdict, row: TwinVersion, wanted: str) -> None:
    from ...operations.diagnose.wording import cause_name, spell_sets
    from ...twins.adopted_effects import adoption, offered

    if not row.configuration["effects"]:
        stages = ", ".join(row.configuration["stages"])
        note(
            f"nothing is adopted from version {row.version} on: predict and "
            f"tune use the nominal {stages}"
        )
        return
    best, chosen = offered(verdict), adoption(verdict, wanted)
    is_offered = best is not None and best.name == chosen.name
    if not is_offered and set(wanted.split("+")) not in [
        set(name.split("+")) for name in verdict.first.effects
    ]:
        note(
            f"{spell_sets(wanted)} is not what the diagnosis says first: "
            f"{cause_name(verdict.first)}"
        )
    note(
        f"adopted as version {row.version}: {spell_sets(row.reason)}; predict "
        f"and tune use it (--no-adopted: without)"
    )


def _tell_past(campaign: str, db: str, json_to: str | None) -> None:
    from ...operations.diagnose.diagnosing import past_diagnoses

    with open_command_store(db) as store, store.reading() as session:
        rows = list(past_diagnoses(session, campaign))
    if json_to is not None:
        write_json(rows, json_to)
    else:
        print_table(
            map(row_in_words, rows),
            f"no diagnoses of {campaign}; make one: pyroshock diagnose {campaign}",
        )


def row_in_words(row: dict[str, Any]) -> dict[str, Any]:
    """A row of a list of diagnoses for people: the likeliest cause with its probability, and what
    was adopted."""
    from ...common.number_format import percent
    from ...operations.diagnose.wording import spell_sets

    names = ("id", "campaign", "diagnosed_at", "simulator", "first", "probability", "adopted")
    shown = {name: row[name] for name in names if name in row}
    adopted = None if row["adopted"] is None else spell_sets(row["adopted"])
    return {
        **shown,
        "first": spell_sets(row["first"]),
        "probability": percent(row["probability"]),
        "adopted": adopted,
    }


def tell_diagnosis(diagnosis: GapDiagnosis) -> None:
    """The first sentences and what to do next, then effects, path and the rest of the report."""
    from ...common.number_format import percent
    from ...operations.diagnose.report import FIRST_SECTIONS, sentence_sections
    from ...operations.diagnose.wording import cause_name, fitted_words, owned_parameters

    verdict, sections = diagnosis.verdict, sentence_sections(diagnosis.verdict)
    click.echo(f"{verdict.campaign}: {diagnosis.sentence}")
    _tell_lines(FIRST_SECTIONS[0], sections.pop(FIRST_SECTIONS[0]))
    _tell_effects(verdict)
    _tell_path(verdict)
    click.echo("\nCauses")
    for cause in verdict.causes:
        numbers = ", ".join(
            fitted_words(parameter, effect) for effect, parameter in owned_parameters(cause)
        )
        click.echo(
            f"  {percent(cause.probability):>7}  "
            f"{cause_name(cause)}{': ' + numbers if numbers else ''}"
        )
    for title, sentences in sections.items():
        _tell_lines(title, sentences)


def _tell_lines(title: str, lines: Sequence[str]) -> None:
    if lines:
        click.echo(f"\n{title}")
        for line in lines:
            click.echo(f"  {line}")


def _tell_effects(verdict: Verdict) -> None:
    from ...operations.diagnose.report import EFFECT_COLUMNS, GAIN, effect_rows

    if verdict.effects:
        click.echo("\nEffects (share of the squared error)")
        click.echo(
            f"{GAIN}: how much more disappears, where it was not fitted, with "
            f"it than with the others alone"
        )
        if any(effect.share < 0 for effect in verdict.effects):
            click.echo(
                "A negative share: the effect hides a part of the error, "
                "which would be larger without it."
            )
        columns = [column for column in EFFECT_COLUMNS if column != "name"]
        rows = [dict(zip(EFFECT_COLUMNS, row, strict=True)) for row in effect_rows(verdict)]
        print_table([{column: row[column] for column in columns} for row in rows], "")


def _tell_path(verdict: Verdict) -> None:
    from ...common.number_format import number, percent

    if not verdict.path:
        return
    click.echo("\nPath of the model error on configurations that the fit has not seen")
    rows = [{"step": "nominal model", "error": number(verdict.gap.before), "gone": ""}]
    rows += [
        {"step": f"+ {step.added}", "error": number(step.after), "gone": percent(step.fraction)}
        for step in verdict.path
    ]
    print_table(
        [
            *rows,
            {"step": "measurement noise", "error": number(verdict.gap.noise_floor), "gone": ""},
        ],
        "",
    )


def _read(given: dict[str, Any]) -> dict[str, Any]:
    """The options as `DiagnosisRequest` takes them."""
    tolerances = dict(_tolerance(text) for text in given.pop("tolerances"))
    uncertain = dict(_uncertain(text) for text in given.pop("uncertain"))
    effects = {name: _effect_ids(given.pop(name)) for name in ("with_effects", "without_effects")}
    return {**given, **effects, "tolerances": tolerances, "uncertain": uncertain}


def _effect_ids(words: Sequence[str]) -> tuple[str, ...]:
    """Each id once, of options that are repeated and of lists with commas ("a+b", as reports name a
    set, is one)."""
    return tuple(
        dict.fromkeys(part for word in words for part in re.split(r"[,+\s]+", word) if part)
    )


def _tolerance(text: str) -> tuple[str, float]:
    stage, _, size = (part.strip() for part in text.partition("="))
    unit = "dB" if stage == "plate" else "%"
    try:
        if stage not in _STAGES or not size.lower().endswith(unit.lower()):
            raise ValueError
        value = float(size[: -len(unit)])
        if not 0 < value < 100:
            raise ValueError
    except ValueError as error:
        raise ValueError(
            f"--tolerance is {text!r}; expected gun=1%, contact=3% or plate=0.5dB"
        ) from error
    return stage, value if unit == "dB" else value / 100


def _uncertain(text: str) -> tuple[str, float]:
    from ...operations.diagnose.request import full_name

    name, _, size = (part.strip() for part in text.partition("="))
    example = "expected NUMBER=SD, such as gun.friction_coefficient=0.05 or bullet_mass_kg=0.001"
    try:
        value = float(size)
    except ValueError as error:
        raise ValueError(f"--uncertain is {text!r}; {example}") from error
    if not (0 < value < math.inf):
        raise ValueError(f"--uncertain is {text!r}; {example}, and SD above 0")
    try:
        return full_name(name), value
    except ValueError as error:
        raise ValueError(f"--uncertain is {text!r}: {error}") from error
