"""`pyroshock`: the command line. Commands are imported when they are called, so that help is instant."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Sequence
from typing import Any

import click
from click.shell_completion import CompletionItem

from ...parallel.working_directory import close_working_directory

#: Command -> (module of the package, its object, what `--help` says). The table keeps help from importing them.
COMMANDS: dict[str, tuple[str, str, str]] = {
    "init": (".app.store.cli", "init", "Make an empty store."),
    "calibrate": (
        ".app.ingest.cli",
        "calibrate",
        "Sensitivity and offset of a transducer from static points.",
    ),
    "ingest": (".app.ingest.cli", "ingest", "Read campaign folders into the store."),
    "plan": (".app.plan.cli", "plan", "Plan a campaign: designs, run sheets, what is to do."),
    "simulate": (".app.plan.cli", "simulate", "Play a plan on the virtual bench, into a campaign folder."),
    "campaigns": (".app.ingest.campaigns_cli", "campaigns", "List the campaigns; delete, archive, restore one."),
    "runs": (".app.ingest.runs_cli", "runs", "List a campaign's recordings; discard or replace one."),
    "impacts": (".app.impacts.cli", "impacts", "List impacts with their factors and pulse figures."),
    "shots": (".app.impacts.cli", "shots", "List shots of the gun beside the model's velocity."),
    "query": (".app.store.query_cli", "query", "Ask the store a question in SQL; nothing can be changed."),
    "show": (".app.impacts.cli", "show", "Show one impact: figures, findings, versions of its pulse, a plot."),
    "extract": (".app.ingest.cli", "extract", "Extract pulses again with other settings; old versions stay."),
    "dataset": (".app.train.dataset_cli", "dataset", "Freeze pulses for training; splits, ranges, traces."),
    "train": (".app.train.cli", "train", "Train models on a dataset and register them."),
    "models": (".app.train.cli", "models", "List the registered models, ranked, beside floor and thesis."),
    "compare": (".app.train.cli", "compare", "Compare models on the same held-out pulses."),
    "promote": (".app.train.cli", "promote", "Make a model's version the one in use, or refuse it."),
    "predict": (".app.predict.cli", "predict", "Predict a shot: velocity, force, acceleration, spectrum, with bands."),
    "validate": (".app.validate.cli", "validate", "Measured shots beside predictions that had not seen them."),
    "srs": (".app.impacts.spectra_cli", "srs", "Shock response spectrum of any recording alone, with checks."),
    "tune": (".app.tune.cli", "tune", "Settings of the bench that give a prescribed spectrum."),
    "diagnose": (
        ".app.diagnose.cli",
        "diagnose",
        "Where twin and bench disagree, which effect causes it, how far it shrinks.",
    ),
    "blind-check": (
        ".app.diagnose.blind_check_cli",
        "blind_check",
        "Score the diagnosis on campaigns whose cause is withheld.",
    ),
    "report": (".app.report.cli", "report", "A campaign, a diagnosis or a model as one page or PDF."),
    "serve": (".app.server.cli", "serve", "Start the web application: pages of all of this, and a JSON API."),
    "work": (".app.jobs.cli", "work", "Do the long work that was asked for; on any machine of the store."),
    "jobs": (".app.jobs.cli", "jobs", "List long work, or stop some of it."),
    "export": (".app.impacts.cli", "export", "Write impacts, shots, pulses or series to CSV, Parquet or JSON."),
    "materials": (".app.store.materials_cli", "materials", "List the known materials, or add one."),
    "db": (".app.store.cli", "db", "Keep the store: check, copy, upgrade it; carry a campaign."),
    "demo": (".app.demo.cli", "demo", "Ingest the shipped measurements and show what comes of them."),
}


class LazyGroup(click.Group):
    """A group that knows its commands' names and imports one only to run it."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        module, name, _ = COMMANDS[cmd_name]
        command = getattr(importlib.import_module(module, __package__.partition(".")[0]), name)
        assert isinstance(command, click.Command)
        return command

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Commands by the table, which imports none of them; then options."""
        named = [CompletionItem(name, help=text) for name, (_, _, text) in COMMANDS.items()]
        options = click.Command.shell_complete(self, ctx, incomplete)
        return [item for item in named if item.value.startswith(incomplete)] + options

    def main(  # type: ignore[override]  # click's overloads, one of which never returns
        self, args: Sequence[str] | None = None, *, standalone_mode: bool = True, **extra: Any
    ) -> Any:
        """Run, and end every error as one line on standard error with exit code 2."""
        if not standalone_mode:
            return super().main(args, standalone_mode=False, **extra)
        if args is None:  # the process was started for this command, and is nobody else's
            close_working_directory()
        try:
            # click returns the code of an early exit, and None of a command that ran through
            code = super().main(args, standalone_mode=False, **extra)
        except click.exceptions.NoArgsIsHelpError as error:
            error.show()
            sys.exit(2)
        except click.ClickException as error:
            from ...schema.addresses import without_secrets

            click.echo(f"pyroshock: {' '.join(without_secrets(_message_of(error)).split())}", err=True)
            sys.exit(2)
        except (click.Abort, KeyboardInterrupt):
            click.echo("pyroshock: interrupted; what was stored is whole, and a repeat goes on from there", err=True)
            sys.exit(130)
        sys.exit(code or 0)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, text) for name, (_, _, text) in COMMANDS.items()])


def _message_of(error: click.ClickException) -> str:
    """The error, and which commands there are where one was asked for that there is not."""
    message = error.format_message()
    context = error.ctx if isinstance(error, click.UsageError) else None
    if not message.startswith("No such command") or context is None or not isinstance(context.command, click.Group):
        return message
    names = context.command.list_commands(context)
    if context.command is main:
        from difflib import get_close_matches

        near = get_close_matches(getattr(error, "command_name", ""), names)
        names = near and [f"did you mean {', '.join(near)}?"]
    return f"{message.partition('.')[0]}; {', '.join(names) or 'pyroshock --help lists them'}"


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="pyroshock", message="pyroshock %(version)s")
def main() -> None:
    """Experiment database, models and digital twin for pyroshock testing.

    \b
    A first look, on measured shots:
        pyroshock demo
    Your own campaign:
        pyroshock ingest my-campaign/
        pyroshock impacts --where tip_material=steel
    """
