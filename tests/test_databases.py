"""The databases the other tests are given: usable, empty, and gone afterwards."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from sqlalchemy import Engine, create_engine, inspect, make_url, text
from support.stores.postgres_server import NoServerError, installations, running_server


@contextmanager
def engine_of(url: str) -> Iterator[Engine]:
    engine = create_engine(url)
    try:
        yield engine
    finally:
        engine.dispose()


def table_names(url: str) -> list[str]:
    with engine_of(url) as engine:
        return inspect(engine).get_table_names()


def ends_soon(pid: int) -> bool:
    """Whether the process ends within five seconds: its parent may take a moment to notice that it
    did."""
    deadline = time.monotonic() + 5
    while time.monotonic() < deadline:
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.02)
    return False


@pytest.mark.parametrize("turn", ["first", "second"])
def test_every_test_gets_an_empty_database(
    database_url: str, turn: str, request: pytest.FixtureRequest
) -> None:
    """Of both kinds; both turns write the same table: the second fails if it sees the first
    one's."""
    assert make_url(database_url).get_backend_name() in request.node.name
    assert table_names(database_url) == []
    with engine_of(database_url) as engine, engine.begin() as connection:
        connection.execute(text("CREATE TABLE shots (peak_force_n DOUBLE PRECISION)"))
        connection.execute(text("INSERT INTO shots VALUES (1250.5)"))
    assert table_names(database_url) == ["shots"]
    with engine_of(database_url) as engine, engine.connect() as connection:
        assert connection.execute(text("SELECT peak_force_n FROM shots")).scalar_one() == 1250.5


def test_the_server_stores_utf_8(postgres_url: str) -> None:
    with engine_of(postgres_url) as engine, engine.connect() as connection:
        assert connection.execute(text("SHOW server_encoding")).scalar_one() == "UTF8"


def test_sqlite_url_names_a_new_file_and_no_binaries_are_said_in_words(
    sqlite_url: str, tmp_path: Path
) -> None:
    assert Path(str(make_url(sqlite_url).database)).parent == tmp_path
    assert not any(tmp_path.iterdir())
    with (
        pytest.raises(NoServerError, match=r"nowhere: .*No such file"),
        running_server([tmp_path / "nowhere"]),
    ):
        pass


@pytest.mark.parametrize("install_folder", installations(), ids=str)
def test_a_stopped_server_leaves_nothing_behind(install_folder: Path) -> None:
    with running_server([install_folder]) as url:
        work = Path(str(make_url(url).query["host"]))
        with engine_of(url) as engine, engine.connect() as connection:
            assert connection.execute(text("SHOW listen_addresses")).scalar_one() == ""
        server_pid = int((work / "data" / "postmaster.pid").read_text().splitlines()[0])
    assert not work.exists()
    assert ends_soon(server_pid)
