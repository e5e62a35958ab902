"""A PostgreSQL server as a laboratory keeps one: a store with roles, logins of each, and a store
without roles."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from pyroshock.app.demo.demo import ingest_examples
from pyroshock.app.operations.plan.planning import make_plan
from sqlalchemy import make_url

from support.missing import skip_for_want_of
from support.records.campaigns import hammer_campaign
from support.stores.postgres_server import NoServerError, running_server
from support.stores.stores import ingested, opened, pyroshock
from support.stores.web_stores import FACTORS

#: Logins of the store "lab"; `keeper` made it and may make roles, `plain` has a store of its own
#: and may not.
READER, OPERATOR, ADMIN, NOBODY = "rita", "olaf", "ada", "nora"
PLAN = "autumn"
_MEMBERS = {READER: "pyroshock_reader", OPERATOR: "pyroshock_operator", ADMIN: "pyroshock_admin"}


@dataclass(frozen=True)
class Server:
    """`said`: what `init` wrote on standard error for `plain`, before there were roles."""

    url: str
    said: str

    def address(self, login: str, database: str = "lab") -> str:
        """A store as a login opens it."""
        return (
            make_url(self.url)
            .set(username=login, database=database)
            .render_as_string(hide_password=False)
        )

    def execute(self, statement: str, database: str = "postgres") -> None:
        """As the superuser."""
        import psycopg

        with psycopg.connect(self._driver_url(database), autocommit=True) as connection:
            connection.execute(statement.encode())

    def _driver_url(self, database: str) -> str:
        return (
            make_url(self.url)
            .set(drivername="postgresql", database=database)
            .render_as_string(hide_password=False)
        )


@contextmanager
def roled_server(folder: Path) -> Iterator[Server]:
    """A server of its own: roles are the whole server's, and other tests make them. Skips where
    none can be had."""
    try:
        with running_server() as url:
            yield _filled(url, folder)
    except NoServerError as error:
        skip_for_want_of("PostgreSQL", str(error))


def _filled(url: str, folder: Path) -> Server:
    empty = Server(url, "")
    empty.execute("CREATE ROLE plain LOGIN")
    empty.execute("CREATE ROLE keeper LOGIN CREATEROLE")
    for login, database in (("plain", "private"), ("keeper", "lab")):
        empty.execute(f"CREATE DATABASE {database} OWNER {login}")
    said = pyroshock("init", "--db", empty.address("plain", "private")).stderr
    ingested(
        empty.address("keeper"), hammer_campaign(folder / "spring", recordings=1, name="spring")
    )
    with opened(empty.address("keeper")) as store:
        ingest_examples(store)
        make_plan(store, "factorial", PLAN, kind="hammer", factors=FACTORS, repetitions=1, seed=1)
    for login in (*_MEMBERS, NOBODY):
        empty.execute(
            f"CREATE ROLE {login} LOGIN"
            + (f" IN ROLE {_MEMBERS[login]}" if login in _MEMBERS else "")
        )
    return Server(url, said)
