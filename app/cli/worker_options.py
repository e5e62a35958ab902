"""`--jobs`, `--backend` and `--scheduler`: who does the work of a command."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any

import click

from ...parallel.executor import BACKENDS, LOCAL, Crew
from .common import errors_as_one_line

Command = Callable[..., Any]


def crew_options(jobs_help: str, jobs: int = 1) -> Callable[[Command], Command]:
    """The command gets one argument `crew`, of a cluster that answers; `jobs` are the processes by default."""

    def decorated(command: Command) -> Command:
        @click.option("--jobs", type=click.IntRange(1), default=jobs, show_default=True, help=jobs_help)
        @click.option(
            "--backend",
            type=click.Choice(BACKENDS),
            default=LOCAL,
            show_default=True,
            help="This machine, or a cluster: the same results.",
        )
        @click.option("--scheduler", default=None, metavar="ADDRESS", help="Of the cluster: tcp://HOST:8786.")
        @wraps(command)
        def with_crew(*args: Any, jobs: int, backend: str, scheduler: str | None, **others: Any) -> Any:
            with errors_as_one_line():
                crew = Crew(backend, jobs, scheduler)
                crew.check()
            return command(*args, crew=crew, **others)

        return with_crew

    return decorated
