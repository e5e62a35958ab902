"""A stamp is the same until somebody, in whatever process, has committed a change."""

from __future__ import annotations

import sqlite3
import subprocess
import sys
from pathlib import Path

from pyroshock.schema.change_stamp import ChangeStamp
from pyroshock.schema.engine import make_memory_engine
from support.stores.stores import opened

WRITE = "import sqlite3, sys; c = sqlite3.connect(sys.argv[1]); c.execute(sys.argv[2]); c.commit()"


def write(file: Path, statement: str) -> None:
    subprocess.run([sys.executable, "-c", WRITE, str(file), statement], check=True)


def test_a_stamp_changes_with_each_write_of_another_process_and_with_nothing_else(tmp_path):
    file = tmp_path / "lab.db"
    write(file, "create table counts (number)")
    stamp = ChangeStamp(file)
    stamps = [stamp.read(), stamp.read()]
    for _ in range(2):
        write(file, "insert into counts values (1)")
        stamps += [stamp.read(), stamp.read()]
    stamp.close()
    assert stamps[::2] == stamps[1::2] and len(set(stamps)) == 3


def test_reading_changes_no_stamp_and_a_write_of_this_process_does(tables_url):
    with opened(tables_url) as store:
        stamp = ChangeStamp(store.engine)
        former_stamp = stamp.read()
        with store.reading() as session:
            session.connection().exec_driver_sql("SELECT count(*) FROM campaigns")
        after_reading = stamp.read()
        with store.writing() as session:
            session.connection().exec_driver_sql(
                "UPDATE campaigns SET name = name WHERE false"
                if store.engine.dialect.name == "sqlite"
                else "SELECT pg_current_xact_id()"
            )
            session.connection().exec_driver_sql("CREATE TABLE counts (number INTEGER)")
        after_writing = stamp.read()
        stamp.close()
    assert former_stamp is not None and former_stamp == after_reading != after_writing


def test_a_file_in_the_place_of_another_has_another_stamp(tmp_path):
    file, other = tmp_path / "lab.db", tmp_path / "other.db"
    for path in (file, other):
        write(path, "create table counts (number)")
    stamp = ChangeStamp(file)
    former_stamp = stamp.read()
    other.replace(file)
    assert former_stamp != stamp.read() is not None
    stamp.close()


def test_there_is_no_stamp_of_a_file_that_is_not_there_nor_of_a_store_in_memory(tmp_path):
    assert ChangeStamp(tmp_path / "lab.db").read() is None
    assert ChangeStamp(make_memory_engine()).read() is None


def test_there_is_no_stamp_while_a_writer_holds_the_file_alone(tmp_path):
    file = tmp_path / "lab.db"
    write(file, "create table counts (number)")
    stamp = ChangeStamp(file)
    assert stamp.read() is not None
    with sqlite3.connect(file, isolation_level=None) as writer:
        writer.execute("begin exclusive")
        assert stamp.read() is None
        writer.execute("rollback")
    assert stamp.read() is not None
    stamp.close()
