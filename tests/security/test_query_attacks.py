"""`query` on PostgreSQL, as every login: what ends other sessions, locks, reads the server's files
or leaves the transaction is refused before it runs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import psycopg
import pytest
from pyroshock.app.operations.store.postgresql_statement import (
    ForbiddenStatementError,
    check_statement,
)
from pyroshock.app.operations.store.query import QueryError, Statement, run_statement
from pyroshock.schema.engine import make_engine
from support.stores.roled_servers import ADMIN, OPERATOR, READER, Server, roled_server
from support.stores.stores import counts

SUPERUSER = "postgres"

#: {pid}: of a session of the same login, which must outlive the attack; {file}: a path that must
#: not come to be.
ATTACKS = {
    "end a session": "select pg_terminate_backend({pid})",
    "end every session": (
        "select count(pg_terminate_backend(pid)) from pg_stat_activity "
        "where pid <> pg_backend_pid()"
    ),
    "cancel a session": "select pg_cancel_backend({pid})",
    "after a long name": f"select 1 as {'a' * 62}, pg_terminate_backend({{pid}}) as {'b' * 62}",
    "names like fields of the tree": (
        'select pg_terminate_backend({pid}) as ":funcid", 1 as ":relid 1"'
    ),
    "a quoted name": 'select "pg_terminate_backend"({pid})',
    "an escaped name": "select U&\"pg\\005Fterminate_backend\"({pid})",
    "a qualified name": 'select pg_catalog . "pg_terminate_backend" /* ( */ ({pid}, 0)',
    "behind a string that ends elsewhere": (
        "select E'\\'' || pg_terminate_backend({pid})::text || '\\''"
    ),
    "behind dollars": "select $a$'$a$ || pg_terminate_backend({pid})::text || $a$'$a$",
    "in a limit": "select 1 limit pg_terminate_backend({pid})::int",
    "in an order": "select 1 order by pg_terminate_backend({pid})",
    "in a frame": (
        "select count(*) over (rows between pg_cancel_backend({pid})::int "
        "preceding and current row)"
    ),
    "in a common table": (
        "with gone as materialized (select pg_terminate_backend({pid})) select 1 from gone"
    ),
    "in a lateral call": "select 1 from campaigns, lateral pg_terminate_backend({pid})",
    "in a filter of an aggregate": (
        "select count(*) filter (where pg_terminate_backend({pid})) from campaigns"
    ),
    "in a case": "select case when pg_terminate_backend({pid}) then 1 end",
    "through XML": "select query_to_xml('select pg_terminate_backend({pid})', true, true, '')",
    "through a cursor as XML": "select cursor_to_xml('pyroshock_query', 1, true, true, '')",
    "through text search": (
        "select ts_stat('select to_tsvector(pg_terminate_backend({pid})::text)')"
    ),
    "leave the role": "select set_config('role', 'postgres', true), pg_terminate_backend({pid})",
    "leave read only": "select set_config('transaction_read_only', 'off', true)",
    "no timeout": "select set_config('statement_timeout', '0', false)",
    "a lock for ever": "select pg_advisory_lock(1)",
    "a lock": "select pg_advisory_xact_lock(1), pg_try_advisory_lock_shared(2)",
    "wait": "select pg_sleep(60)",
    "write a file": "select lo_export(lo_from_bytea(0, 'x'), '{file}')",
    "a program": "copy campaigns to program 'touch {file}'",
    "a program, second statement": "select 1; copy campaigns to program 'touch {file}'",
    "a program, prepared": (
        "with a as (select 1) select 1 from a; copy (select 1) to program 'touch {file}'"
    ),
    "read a file": "select pg_read_file('/etc/passwd')",
    "read bytes of a file": "select pg_read_binary_file('PG_VERSION')",
    "list a folder": "select pg_ls_dir('.')",
    "import a file": "select lo_import('/etc/passwd')",
    "passwords": "select rolpassword from pg_authid",
    "passwords as XML": "select table_to_xml('pg_authid', true, true, '')",
    "passwords of a view": "select passwd from pg_shadow",
    "schema as XML": "select schema_to_xml('pg_catalog', true, true, '')",
    "settings": "select current_setting('data_directory')",
    "settings of a view": "select setting from pg_settings",
    "rules of logins": "select * from pg_hba_file_rules",
    "another database": "select * from dblink('dbname=postgres', 'select 1') as t(a int)",
    "reload": "select pg_reload_conf()",
    "rotate the log": "select pg_rotate_logfile()",
    "switch the log": "select pg_switch_wal()",
    "forget statistics": "select pg_stat_reset()",
    "notify": "select pg_notify('jobs', 'x')",
    "a number of a sequence": "select nextval('campaigns_id_seq')",
    "set a sequence": "select setval('campaigns_id_seq', 1)",
    "a snapshot": "select pg_export_snapshot()",
    "a message into the log": "select pg_logical_emit_message(false, 'a', 'b')",
    "a function of the owner": "select theirs()",
    "a view of the owner": "select * from theirs_seen",
    "a table by select into": "select 1 into mine",
    "a lock of rows": "select * from campaigns for update",
    "rows": "with gone as (delete from campaigns returning id) select * from gone",
    "do": "do $$ begin perform pg_sleep(1); end $$",
}  # fmt: skip

#: What people ask, and its answer; None where only that there is one counts.
QUESTIONS = {
    "select count(*) as n from campaigns where name like '%s%' and date < now()": None,
    "select round(avg(peak_force_n)::numeric, 1) > 0 as n from pulses": True,
    "select max(n) as n from (select row_number() over (order by id) as n "
    "from campaigns) as numbered": 3,
    "with recursive k(i) as (select 1 union all select i + 1 from k where i "
    "< 5) select sum(i) as n from k": 15,
    "select percentile_cont(0.5) within group (order by x) as n from "
    "unnest(array[1, 2, 9]) as x": 2.0,
    "select upper(string_agg(name, ', ' order by name)) ~ 'SPRING' as n from campaigns": True,
    "select count(*) as n from generate_series(1, 10) as x where random() < "
    "2 and x in (1, 2, 3)": 3,
    "select (jsonb_build_object('a', 1) ->> 'a')::int + extract(year from "
    "date '2026-01-01')::int as n": 2027,
    "select pg_typeof(1)::text as n": "integer",
}


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with roled_server(tmp_path_factory.mktemp("lab")) as served:
        served.execute(
            "CREATE FUNCTION theirs() RETURNS void LANGUAGE sql AS 'SELECT pg_sleep(0)'", "lab"
        )
        served.execute(
            "CREATE VIEW theirs_seen AS SELECT pg_terminate_backend(pid) FROM pg_stat_activity",
            "lab",
        )
        served.execute("GRANT SELECT ON theirs_seen TO PUBLIC", "lab")
        yield served


def _answer(url: str, sql: str) -> list[dict[str, list[object]]]:
    engine = make_engine(url)
    try:
        with run_statement(engine, Statement(sql, {}), 20) as batches:
            return list(batches)
    finally:
        engine.dispose()


@pytest.mark.parametrize("login", [SUPERUSER, ADMIN, OPERATOR, READER, "keeper"])
def test_no_login_can_do_more_than_read_the_store(
    server: Server, login: str, tmp_path: Path
) -> None:
    url, file, before = (
        server.address(login),
        tmp_path / "written",
        counts(server.address("keeper")),
    )
    tmp_path.chmod(0o777)
    with closing(
        psycopg.connect(url.replace("postgresql+psycopg", "postgresql"), autocommit=True)
    ) as other:
        pid = other.info.backend_pid
        held = {}
        for name, attack in ATTACKS.items():
            try:
                _answer(url, attack.replace("{pid}", str(pid)).replace("{file}", str(file)))
            except QueryError as error:
                held[name] = len(str(error).splitlines()) == 1 and not file.exists()
        assert [name for name in ATTACKS if not held.get(name)] == []
        assert other.execute("select 1").fetchone() == (1,)
        locks = other.execute(
            "select count(*) from pg_locks where locktype = 'advisory'"
        ).fetchone()
        assert locks == (0,)
    assert counts(server.address("keeper")) == before


def test_the_reason_names_what_is_refused(server: Server) -> None:
    with pytest.raises(
        QueryError,
        match=r"the function pg_terminate_backend is refused; ask the database with psql",
    ):
        _answer(server.address(SUPERUSER), 'select "pg_terminate_backend"(1)')
    with pytest.raises(
        QueryError, match=r"pg_catalog.pg_authid \(no table of the store\) is refused"
    ):
        _answer(server.address(SUPERUSER), "select rolname from pg_authid")


@pytest.mark.parametrize("login", [SUPERUSER, ADMIN, OPERATOR, READER])
def test_questions_have_their_answers(server: Server, login: str) -> None:
    for sql, answer in QUESTIONS.items():
        (batch,) = _answer(server.address(login), sql)
        assert answer is None or batch["n"] == [answer], sql


def test_views_of_the_store_are_read(server: Server) -> None:
    server.execute("CREATE VIEW harmless AS SELECT upper(name) AS n FROM campaigns", "lab")
    server.execute("GRANT SELECT ON harmless TO pyroshock_reader", "lab")
    assert "SPRING" in _answer(server.address(SUPERUSER), "select n from harmless")[0]["n"]


def test_wherever_the_server_breaks_its_lines_the_function_is_found(server: Server) -> None:
    """The tree is wrapped at 78 characters: a name of each length moves what follows."""
    url = server.address(OPERATOR).replace("postgresql+psycopg", "postgresql")
    with closing(psycopg.connect(url)) as connection:
        for length in range(1, 63):
            with pytest.raises(ForbiddenStatementError, match="pg_terminate_backend"):
                check_statement(connection, f"select 1 as {'a' * length}, pg_terminate_backend(1)")
