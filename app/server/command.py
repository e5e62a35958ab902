"""`serve`: the web application of a laboratory."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..doors.command_line.common import (
    data_option,
    db_option,
    errors_as_one_line,
    note,
    open_command_store,
)

if TYPE_CHECKING:
    from ..web.settings import Settings


@click.command()
@db_option
@click.option(
    "--host",
    default="127.0.0.1",
    show_default=True,
    help="Listen on this address. Any address but that of this machine itself needs a token.",
)
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    default=8000,
    show_default=True,
    help="Listen on this port; 0 takes a free one.",
)
@click.option(
    "--token",
    envvar="PYROSHOCK_TOKEN",
    show_envvar=True,
    help="Set the token that other machines must send; an environment variable hides it better.",
)
@click.option(
    "--users",
    "asks_people",
    is_flag=True,
    help="Let in people alone who sign in with a name and a password (`pyroshock users add`). "
    "Without this option and without a token, whoever reaches the server may do all.",
)
@data_option
@click.option(
    "--mlflow",
    metavar="URL",
    help="Give the address of `mlflow ui`; the pages of models link to it.",
)
@click.option(
    "--max-upload",
    type=click.IntRange(1),
    default=2000,
    show_default=True,
    help="Limit one upload to this number of megabytes.",
)
@click.option(
    "--no-worker",
    is_flag=True,
    help="Serve pages only. `pyroshock work`, on this machine or another, does the jobs.",
)
@click.option(
    "--trusted-proxy",
    "trusted_proxies",
    multiple=True,
    metavar="ADDRESS",
    envvar="PYROSHOCK_TRUSTED_PROXY",
    show_envvar=True,
    help="Believe the X-Forwarded-For and X-Forwarded-Proto headers of the proxy at this address "
    "or network, such as 127.0.0.1, and of nobody else. Name the proxy that speaks TLS in front of "
    "this server. May be repeated.",
)
@click.option("--open", "show", is_flag=True, help="Open the application in the browser.")
def serve(
    db: str,
    host: str,
    port: int,
    token: str | None,
    asks_people: bool,
    folders: tuple[Path, ...],
    mlflow: str | None,
    max_upload: int,
    no_worker: bool,
    trusted_proxies: tuple[str, ...],
    show: bool,
) -> None:
    """Start the web application: campaigns, pulses, models, the twin, plans and diagnoses as pages,
    and a JSON API under /api.

    Only this machine reaches it, unless --host names another address. Ctrl-C ends it.

    \b
    Example:
        pyroshock serve --open
    """
    # Threads of a matrix product spin while they wait; here many readers share the processors.
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    with errors_as_one_line():
        _need_packages()
        from ..web.settings import MEGABYTE, Settings

        settings = Settings(
            db,
            host,
            port,
            token,
            folders or (Path.cwd(),),
            mlflow,
            max_upload * MEGABYTE,
            works=not no_worker,
            trusted_proxies=trusted_proxies,
            asks_people=asks_people,
        )
    with open_command_store(db, create=True) as store:
        from .application import application
        from .memory import return_freed_memory

        return_freed_memory()
        _listen(application(settings, store, warm=True), settings, show)


def _need_packages() -> None:
    from importlib.util import find_spec

    missing = [
        name
        for name in ("fastapi", "uvicorn", "jinja2", "python_multipart")
        if find_spec(name) is None
    ]
    if missing:
        raise ValueError(f"pages need {', '.join(missing)}: pip install 'pyroshock[web]'")


def _listen(app: Any, settings: Settings, show: bool) -> None:
    import socket

    import uvicorn

    from .connections import server_options

    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    # With the protocol named, asyncio sends each part of an answer at once: else the second answer
    # on a connection waits 40 ms for the client to confirm the first part.
    with socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP) as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((settings.host.strip("[]"), settings.port))
            listener.listen(
                128
            )  # who reads the address may come at once; the server answers when it is there
        except OSError as error:
            raise ValueError(
                f"cannot listen on {settings.host}:{settings.port}: "
                f"{error.strerror}; try another --port, or --port 0"
            ) from error
        host = f"[{settings.host}]" if ":" in settings.host else settings.host
        address = f"http://{host}:{listener.getsockname()[1]}/"
        note(
            f"pyroshock: {address}"
            + (f"?token={settings.token}" if settings.token and sys.stderr.isatty() else "")
        )
        if settings.token and not sys.stderr.isatty():
            note("open it once with ?token=TOKEN, or send Authorization: Bearer TOKEN")
        if show:
            import webbrowser

            webbrowser.open(address + (f"?token={settings.token}" if settings.token else ""))
        uvicorn.Server(uvicorn.Config(app, **server_options(settings))).run(sockets=[listener])
