"""`serve`: the web application of a laboratory."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import click

from ..doors.command_line.common import (
    data_option,
    db_option,
    errors_as_one_line,
    note,
    open_command_store,
)

if TYPE_CHECKING:
    from ..operations.people.stored_identities import Admission
    from ..web.settings import Settings

#: The variable with the secret of single sign-on. An option would show it to who lists processes.
_SECRET = "PYROSHOCK_SSO_CLIENT_SECRET"  # noqa: S105  # the name of a variable


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
@click.option(
    "--public-address",
    metavar="URL",
    envvar="PYROSHOCK_PUBLIC_ADDRESS",
    show_envvar=True,
    help="Give the address under which browsers reach this server, such as "
    "https://shock.example.org; the identity provider sends people back there.",
)
@click.option(
    "--sso-issuer",
    metavar="URL",
    envvar="PYROSHOCK_SSO_ISSUER",
    show_envvar=True,
    help="Let people sign in through the identity provider at this address (OpenID Connect), the "
    "same as in its tokens. It needs --sso-client-id and --public-address.",
)
@click.option(
    "--sso-client-id",
    metavar="NAME",
    envvar="PYROSHOCK_SSO_CLIENT_ID",
    show_envvar=True,
    help="Give the name under which the identity provider knows this server.",
)
@click.option(
    "--sso-client-secret-file",
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
    envvar="PYROSHOCK_SSO_CLIENT_SECRET_FILE",
    show_envvar=True,
    help="Read the secret that the identity provider has given this server from this file. The "
    "variable PYROSHOCK_SSO_CLIENT_SECRET may hold the secret itself.",
)
@click.option(
    "--sso-login",
    metavar="CLAIM",
    default="preferred_username",
    show_default=True,
    envvar="PYROSHOCK_SSO_LOGIN",
    show_envvar=True,
    help="Take this claim of a token for the login of the person, such as email.",
)
@click.option(
    "--sso-groups",
    metavar="CLAIM",
    default="groups",
    show_default=True,
    envvar="PYROSHOCK_SSO_GROUPS",
    show_envvar=True,
    help="Take this claim of a token for the groups of the person, such as realm_access.roles.",
)
@click.option(
    "--sso-role",
    "sso_roles",
    multiple=True,
    metavar="GROUP=ROLE",
    envvar="PYROSHOCK_SSO_ROLE",
    show_envvar=True,
    help="Give the people of a group at the identity provider this role. May be repeated.",
)
@click.option(
    "--sso-admit",
    type=click.Choice(["invited", "groups", "everybody"]),
    default="invited",
    show_default=True,
    envvar="PYROSHOCK_SSO_ADMIT",
    show_envvar=True,
    help="Say who is added at the first sign-in: nobody who was not invited (`pyroshock users "
    "invite`), who has a group of --sso-role, or everybody whom the identity provider knows, as a "
    "reader where no group has a role.",
)
@click.option(
    "--sso-name",
    metavar="WORDS",
    default="single sign-on",
    show_default=True,
    envvar="PYROSHOCK_SSO_NAME",
    show_envvar=True,
    help="Call the identity provider so on the button of the sign-in page.",
)
@click.option(
    "--no-passwords",
    is_flag=True,
    envvar="PYROSHOCK_NO_PASSWORDS",
    show_envvar=True,
    help="Let users sign in through the identity provider alone.",
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
    public_address: str | None,
    sso_issuer: str | None,
    sso_client_id: str | None,
    sso_client_secret_file: Path | None,
    sso_login: str,
    sso_groups: str,
    sso_roles: tuple[str, ...],
    sso_admit: str,
    sso_name: str,
    no_passwords: bool,
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
        from ..web.sign_on.settings import SignOnSettings, role_pairs

        sign_on = None
        if sso_issuer is not None:
            _need_sign_on_packages()
            sign_on = SignOnSettings(
                sso_issuer,
                sso_client_id or "",
                public_address or "",
                client_secret=_client_secret(sso_client_secret_file),
                login_claim=sso_login,
                groups_claim=sso_groups,
                roles=role_pairs(sso_roles),
                admits=cast("Admission", sso_admit),
                name=sso_name,
            )
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
            sign_on=sign_on,
            takes_passwords=not no_passwords,
        )
    with open_command_store(db, create=True) as store:
        from .application import application
        from .memory import return_freed_memory

        return_freed_memory()
        _listen(application(settings, store, warm=True), settings, show)


def _need_packages() -> None:
    missing = _missing("fastapi", "uvicorn", "jinja2", "python_multipart")
    if missing:
        raise ValueError(f"pages need {', '.join(missing)}: pip install 'pyroshock[web]'")


def _need_sign_on_packages() -> None:
    missing = _missing("authlib", "joserfc", "httpx2")
    if missing:
        raise ValueError(
            f"--sso-issuer needs {', '.join(missing)}: pip install 'pyroshock[sso,web]'"
        )


def _missing(*names: str) -> list[str]:
    from importlib.util import find_spec

    return [name for name in names if find_spec(name) is None]


def _client_secret(path: Path | None) -> str | None:
    """The secret that the identity provider knows this server by: of the file, or of the variable;
    None of a client that has none."""
    secret = os.environ.get(_SECRET) if path is None else path.read_text(encoding="utf-8")
    secret = None if secret is None else secret.strip()
    if secret == "":
        place = _SECRET if path is None else path.name
        raise ValueError(f"{place} holds no secret; expected that of the identity provider")
    return secret


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
