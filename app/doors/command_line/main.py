"""`pyroshock`: the command line. Commands are imported when they are called, so that help is
instant."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Sequence
from typing import Any

import click
from click.shell_completion import CompletionItem

from ....parallel.working_directory import close_working_directory
from .shells import register_shells

#: Section of `pyroshock --help` -> command -> (module of the package, its object, what the help
#: says of it). The table keeps help from importing the commands.
SECTIONS: dict[str, dict[str, tuple[str, str, str]]] = {
    "Recordings": {
        "init": (".app.doors.commands.store", "init", "Make an empty store."),
        "campaigns": (
            ".app.doors.commands.campaigns",
            "campaigns",
            "List the campaigns; begin, show, delete, archive or restore one.",
        ),
        "ingest": (
            ".app.operations.ingest.folder",
            "INGEST",
            "Read campaign folders into the store.",
        ),
        "runs": (
            ".app.doors.commands.campaigns",
            "runs",
            "List the recordings of a campaign; show, discard or replace one.",
        ),
        "impacts": (
            ".app.doors.commands.impacts",
            "impacts",
            "List impacts with their figures; show or delete one.",
        ),
        "shots": (
            ".app.doors.commands.impact_records",
            "shots",
            "List the shots of the gun beside the velocity of the model.",
        ),
        "show": (
            ".app.doors.commands.impact_records",
            "show",
            "Show one impact, and draw its record and pulse.",
        ),
        "srs": (
            ".app.doors.commands.spectra",
            "srs",
            "Compute the shock response spectrum of any recording.",
        ),
        "extract": (
            ".app.operations.ingest.extract",
            "EXTRACT",
            "Extract the pulses of a campaign again with other settings.",
        ),
        "calibrate": (
            ".app.operations.ingest.calibrate",
            "CALIBRATE",
            "Compute sensitivity and offset of a transducer.",
        ),
        "materials": (
            ".app.doors.commands.materials",
            "materials",
            "List the known materials, or add one.",
        ),
    },
    "Plans": {
        "plan": (
            ".app.doors.commands.plan",
            "plan",
            "Design a campaign, write its run sheet, and see what is still to do.",
        ),
        "plans": (".app.doors.commands.plan", "plans", "List the plans; show or delete one."),
        "simulate": (
            ".app.operations.plan.simulate",
            "SIMULATE",
            "Fire a plan on the virtual bench.",
        ),
    },
    "Models": {
        "dataset": (
            ".app.doors.commands.dataset",
            "dataset",
            "Freeze pulses for training, and see what a dataset holds.",
        ),
        "datasets": (
            ".app.doors.commands.dataset",
            "datasets",
            "List the datasets; show or delete one.",
        ),
        "train": (
            ".app.operations.train.train",
            "TRAIN",
            "Train models on a dataset and register them.",
        ),
        "models": (
            ".app.doors.commands.models",
            "models",
            "List the registered models with their figures; show or delete one.",
        ),
        "compare": (
            ".app.operations.train.compare",
            "COMPARE",
            "Compare models on the same held-out pulses.",
        ),
        "promote": (
            ".app.operations.train.promote",
            "PROMOTE",
            "Put a version of a model in use, if it is better.",
        ),
    },
    "Predictions": {
        "predict": (
            ".app.operations.predict.predict",
            "PREDICT",
            "Predict velocity, force, acceleration and spectrum of a shot.",
        ),
        "validate": (
            ".app.operations.validate.validating",
            "VALIDATE",
            "Show how far the predictions for a campaign can be trusted.",
        ),
        "tune": (
            ".app.operations.tune.tuning",
            "TUNE",
            "Search the settings that give a prescribed spectrum.",
        ),
    },
    "Gap between twin and bench": {
        "diagnose": (
            ".app.doors.commands.diagnose",
            "diagnose",
            "Find where the gap lies, what causes it, and how far it shrinks.",
        ),
        "diagnoses": (
            ".app.doors.commands.diagnoses",
            "diagnoses",
            "List the diagnoses; show or delete one.",
        ),
        "blind-check": (
            ".app.operations.diagnose.blind_check",
            "BLIND_CHECK",
            "Score the diagnosis on campaigns whose cause is withheld.",
        ),
    },
    "Reports and files": {
        "report": (
            ".app.operations.report.report",
            "REPORT",
            "Write a campaign, a diagnosis or a model as one page or PDF.",
        ),
        "export": (
            ".app.doors.commands.impact_records",
            "export",
            "Write impacts, shots, pulses or series to a file.",
        ),
        "query": (".app.doors.commands.query", "query", "Ask the store a question in SQL."),
    },
    "Operation": {
        "serve": (".app.server.command", "serve", "Start the web application."),
        "work": (".app.doors.commands.jobs", "work", "Do the long work that was asked for."),
        "jobs": (
            ".app.doors.commands.jobs",
            "jobs",
            "List the long work; show, stop or delete a job.",
        ),
        "db": (
            ".app.doors.commands.store",
            "db",
            "Check, copy and upgrade a store; carry campaigns.",
        ),
        "plugins": (
            ".app.doors.commands.plugins",
            "plugins",
            "List the readers, effects and models that other packages add.",
        ),
        "demo": (".app.demo.command", "demo", "Show the product in five chapters."),
    },
}
#: Command -> (module, object, help).
COMMANDS = {name: entry for commands in SECTIONS.values() for name, entry in commands.items()}


class LazyGroup(click.Group):
    """A group that knows its commands' names and imports one only to run it."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        module, name, _ = COMMANDS[cmd_name]
        command = getattr(importlib.import_module(module, __package__.partition(".")[0]), name)
        if not isinstance(command, click.Command):
            from .operation_command import command_of

            command = command_of(command)
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
        register_shells()
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
            from ....schema.addresses import without_secrets

            click.echo(
                f"pyroshock: {' '.join(without_secrets(_message_of(error)).split())}", err=True
            )
            sys.exit(2)
        except (click.Abort, KeyboardInterrupt):
            click.echo(
                "pyroshock: interrupted; what was stored is whole, and a repeat goes on from there",
                err=True,
            )
            sys.exit(130)
        sys.exit(code or 0)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        width = max(map(len, COMMANDS))
        for title, commands in SECTIONS.items():
            with formatter.section(title):
                formatter.write_dl(
                    [(name.ljust(width), text) for name, (_, _, text) in commands.items()]
                )


def _message_of(error: click.ClickException) -> str:
    """The error, and which commands there are where one was asked for that there is not."""
    message = error.format_message()
    context = error.ctx if isinstance(error, click.UsageError) else None
    if (
        not message.startswith("No such command")
        or context is None
        or not isinstance(context.command, click.Group)
    ):
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
    Example:
        pyroshock demo
        pyroshock ingest results/rehearsal/
        pyroshock impacts --where tip_material=steel
    """
