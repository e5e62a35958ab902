"""Attached files in the store: read back bit for bit, found when they are damaged, and on their way
with the campaign: exported, archived, restored, deleted, copied. On both engines."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import pytest
from pyroshock.app.operations.people import attachments as operations
from pyroshock.app.operations.people.stored_attachments import add_attachment, content_of
from pyroshock.app.operations.people.subjects import find_subject
from pyroshock.app.operations.plan.planning import make_plan
from pyroshock.schema import attached_files
from pyroshock.schema.attached_files import PIECE_BYTES, AttachedFileError
from pyroshock.schema.attachments import AttachedContent, AttachedPiece, Attachment
from pyroshock.schema.audit import AuditRow
from pyroshock.schema.person_roles import Person
from pyroshock.schema.transfer.export import ForeignFileError, write_archive
from sqlalchemy import func, select
from support.records.attached_files import HTML, PDF, picture
from support.records.campaigns import hammer_campaign
from support.stores.care_stores import execute
from support.stores.stores import counts, ingested, opened, run_pyroshock

#: A text of three pieces, the last of one byte.
LARGE = b"0.1,0.2\n" * (PIECE_BYTES // 4) + b"\n"
TABLES = ("attachments", "attached_contents", "attached_pieces")


@pytest.fixture
def lab(database_url: str, tmp_path: Path) -> str:
    """A store with two campaigns and a plan."""
    with opened(database_url, create=True):
        pass
    for name in ("spring", "autumn"):
        folder = hammer_campaign(tmp_path / name, recordings=2, hits=1, name=name)
        ingested(database_url, folder)
    with opened(database_url) as store:
        make_plan(store, "factorial", "tips", kind="hammer", repetitions=1)
    return database_url


def attach(url: str, folder: Path, name: str, content: bytes, *words: str) -> dict[str, Any]:
    """What the command says of a file that it has attached."""
    file = folder / name
    file.write_bytes(content)
    answer = run_pyroshock("attachments", "add", file, *words, "--json", "--db", url)
    return dict(json.loads(answer.stdout))


def listed(url: str, *words: str) -> list[dict[str, Any]]:
    answer = run_pyroshock("attachments", "list", *words, "--json", "--db", url)
    return list(json.loads(answer.stdout))


def names(url: str, *words: str) -> list[str]:
    return sorted(row["file_name"] for row in listed(url, *words))


def rows(url: str) -> list[int]:
    number = counts(url)
    return [number[table] for table in TABLES]


def findings(url: str, code: int = 1, *words: str) -> list[str]:
    return run_pyroshock("db", "check", *words, "--db", url, code=code).stdout.splitlines()


def is_sound(url: str) -> bool:
    return findings(url, 0) == []


def test_a_file_comes_back_bit_for_bit_and_lies_once_however_often_it_is_attached(
    lab: str, tmp_path: Path
) -> None:
    first = attach(lab, tmp_path, "series.csv", LARGE, "--campaign", "spring", "--caption", "raw")
    assert first["sha256"] == hashlib.sha256(LARGE).hexdigest()
    assert (first["size_bytes"], first["media_type"]) == (len(LARGE), "text/plain")
    for words in (("--impact", "spring/2/1"), ("--run", "tips/3"), ("--plan", "tips")):
        attach(lab, tmp_path, "again.csv", LARGE, *words)
    assert rows(lab) == [4, 1, 3]
    out = tmp_path / "out.csv"
    run_pyroshock("attachments", "get", "3", "--out", out, "--db", lab)
    assert out.read_bytes() == LARGE
    assert [row["subject"] for row in listed(lab)] == ["tips", "tips/3", "spring/2/1", "spring"]
    assert [row["subject"] for row in listed(lab, "--campaign", "spring")] == [
        "spring/2/1",
        "spring",
    ]
    assert is_sound(lab)


def test_what_is_refused_stores_nothing_and_says_why(lab: str, tmp_path: Path) -> None:
    rows_before = rows(lab)
    words: tuple[str, ...]
    for name, content, words, message in (
        ("evil.png", HTML, ("--campaign", "spring"), "'evil.png' and cannot be taken: it is HTML"),
        ("none.txt", b"", ("--campaign", "spring"), "it is empty"),
        ("plate.jpg", picture(), ("--campaign", "nowhere"), "no campaign 'nowhere'"),
        ("plate.jpg", picture(), ("--run", "tips/999"), "no run 'tips/999'"),
        ("plate.jpg", picture(), (), "none of them is given"),
        ("plate.jpg", picture(), ("--campaign", "spring", "--plan", "tips"), "campaign, plan"),
    ):
        (tmp_path / name).write_bytes(content)
        answer = run_pyroshock("attachments", "add", tmp_path / name, *words, "--db", lab, code=2)
        assert message in answer.stderr
    attach(lab, tmp_path, "plate.jpg", picture(), "--campaign", "spring")
    twice = ("attachments", "add", tmp_path / "plate.jpg", "--campaign", "spring", "--db", lab)
    assert "already, as attachment 1" in run_pyroshock(*twice, code=2).stderr
    assert rows_before == [0, 0, 0] and rows(lab) == [1, 1, 1]


def test_a_file_beyond_the_limit_is_refused_by_its_size(sqlite_url: str, tmp_path: Path) -> None:
    assert operations.MOST_BYTES == attached_files.MOST_BYTES
    with (tmp_path / "large.txt").open("wb") as file:
        file.truncate(operations.MOST_BYTES + 1)
    words = ("--campaign", "spring", "--db", sqlite_url)
    with opened(sqlite_url, create=True):
        pass
    answer = run_pyroshock("attachments", "add", tmp_path / "large.txt", *words, code=2)
    assert "50,000,001 bytes; expected at most 50,000,000" in answer.stderr
    with pytest.raises(ValueError, match="50,000,001 bytes"):
        attached_files.checked_media_type(bytes(operations.MOST_BYTES + 1))


def test_a_removed_file_stays_in_the_store_with_its_reason_and_is_put_back(
    lab: str, tmp_path: Path
) -> None:
    attach(lab, tmp_path, "plate.jpg", picture(), "--campaign", "spring")
    words = ("attachments", "remove", "1", "--reason", "another plate", "--db", lab)
    run_pyroshock(*words)
    assert "removed already: another plate" in run_pyroshock(*words, code=2).stderr
    assert names(lab) == [] and names(lab, "--removed") == ["plate.jpg"]
    get = ("attachments", "get", "1", "--db", lab)
    assert "was removed: another plate" in run_pyroshock(*get, code=2).stderr
    assert rows(lab) == [1, 1, 1] and is_sound(lab)
    run_pyroshock("attachments", "restore", "1", "--db", lab)
    assert (
        "was not removed"
        in run_pyroshock("attachments", "restore", "1", "--db", lab, code=2).stderr
    )
    assert names(lab) == ["plate.jpg"] and is_sound(lab)
    with opened(lab) as store, store.reading() as session:
        trail = select(AuditRow.operation, AuditRow.request).order_by(AuditRow.id)
        changes = [row for row in session.execute(trail) if row.operation.startswith("attach")]
    assert [change.operation for change in changes] == [
        "attachment-add", "attachment-remove", "attachment-restore",
    ]  # fmt: skip
    assert changes[0].request["file"] == {"name": "plate.jpg", "bytes": len(picture())}
    assert changes[1].request["reason"] == "another plate"


#: What somebody does to a store by hand -> words of what `db check` says, and of who reads it.
DAMAGES = {
    "UPDATE attached_pieces SET data = {zeros} WHERE number = 2": "its bytes have the SHA-256",
    "DELETE FROM attached_pieces WHERE number = 1": "piece 1 of the attached file is missing",
    "UPDATE attached_pieces SET data = {zeros} WHERE number = 0":
        "piece 0 of the attached file has 1 bytes; expected 1,048,576",
    "UPDATE attached_contents SET sha256 = '{hash}'": "its bytes have the SHA-256",
    "UPDATE attached_contents SET size_bytes = 1048577": "1 pieces beyond the 2 of its size",
    "UPDATE attached_contents SET media_type = 'image/png', width_px = 5, height_px = 5":
        "its row says image/png of 5 × 5 pixels, its bytes are text/plain",
    "DELETE FROM attachments": "nothing says what it is attached to",
}  # fmt: skip


@pytest.mark.parametrize("statement", DAMAGES)
def test_damage_is_found_by_the_check_and_by_whoever_reads(
    lab: str, tmp_path: Path, statement: str
) -> None:
    attach(lab, tmp_path, "series.csv", LARGE, "--campaign", "spring")
    zeros = "zeroblob(1)" if lab.startswith("sqlite") else r"'\x00'"
    execute(lab, statement.format(zeros=zeros, hash="0" * 64))
    lines = findings(lab)
    assert any(line.startswith("attachments: ") and DAMAGES[statement] in line for line in lines)
    of_rows = [line for line in lines if line.startswith("rows: ")]
    assert bool(of_rows) is statement.startswith("UPDATE")
    if "DELETE FROM attached" in statement:
        assert any("2 pieces; expected 3" in line for line in findings(lab, 1, "--fast"))
    if "media_type" in statement or "attachments" in statement:
        return
    with (
        opened(lab) as store,
        store.reading() as session,
        pytest.raises(AttachedFileError, match=r"series\.csv"),
    ):
        content_of(session, 1)
    export = ("db", "export", "spring", "--out", tmp_path / "x.pyroshock", "--db", lab)
    assert "campaign spring is not whole" in run_pyroshock(*export, code=2).stderr
    twice = ("attachments", "add", tmp_path / "series.csv", "--campaign", "autumn", "--db", lab)
    if "sha256" not in statement:  # the damaged content is known again, and not taken for whole
        assert "attached file" in run_pyroshock(*twice, code=2).stderr


def test_another_laboratory_gets_the_files_with_the_campaign_once(lab: str, tmp_path: Path) -> None:
    attach(lab, tmp_path, "plate.jpg", picture(), "--campaign", "spring", "--caption", "plate")
    attach(lab, tmp_path, "tip.png", picture("PNG"), "--impact", "spring/1/1")
    attach(lab, tmp_path, "other.pdf", PDF, "--campaign", "autumn")
    out = tmp_path / "spring.pyroshock"
    run_pyroshock("db", "export", "spring", "--out", out, "--db", lab)
    elsewhere = f"sqlite:///{tmp_path / 'elsewhere.db'}"
    with opened(elsewhere, create=True):
        pass
    for _ in range(2):
        run_pyroshock("db", "import", out, "--db", elsewhere)
        assert rows(elsewhere) == [2, 2, 2]
    here, there = (
        {row["file_name"]: row for row in listed(url, "--campaign", "spring")}
        for url in (lab, elsewhere)
    )
    passing = ("attachment",)
    assert {k: {n: v for n, v in r.items() if n not in passing} for k, r in here.items()} == {
        k: {n: v for n, v in r.items() if n not in passing} for k, r in there.items()
    }
    with opened(elsewhere) as store, store.reading() as session:
        assert content_of(session, there["plate.jpg"]["attachment"]) == picture()
    assert is_sound(elsewhere)


def test_files_are_archived_and_restored_with_their_campaign_and_shared_content_stays(
    lab: str, tmp_path: Path
) -> None:
    attach(lab, tmp_path, "plate.jpg", picture(), "--campaign", "spring", "--caption", "plate")
    attach(lab, tmp_path, "tip.csv", LARGE, "--impact", "spring/2/1")
    attach(lab, tmp_path, "same.jpg", picture(), "--campaign", "autumn")
    attach(lab, tmp_path, "gone.pdf", PDF, "--campaign", "spring")
    run_pyroshock("attachments", "remove", "4", "--reason", "secret", "--db", lab)
    files_before, out = (
        listed(lab, "--campaign", "spring", "--removed"),
        tmp_path / "spring.pyroshock",
    )
    words = ("--reason", "room", "--db", lab)
    run_pyroshock("campaigns", "archive", "spring", "--out", out, *words)
    assert rows(lab) == [1, 1, 1] and names(lab) == ["same.jpg"]
    assert is_sound(lab)
    run_pyroshock("campaigns", "restore", out, "--db", lab)
    files_after = listed(lab, "--campaign", "spring", "--removed")
    assert [{**row, "attachment": 0} for row in files_after] == [
        {**row, "attachment": 0} for row in files_before
    ]
    assert rows(lab) == [4, 3, 5] and is_sound(lab)


def test_a_deletion_counts_the_files_that_go(lab: str, tmp_path: Path) -> None:
    attach(lab, tmp_path, "plate.jpg", picture(), "--campaign", "spring")
    attach(lab, tmp_path, "plan.pdf", PDF, "--plan", "tips")
    run_pyroshock("campaigns", "delete", "spring", "--reason", "wrong sensor", "--db", lab)
    (stone,) = json.loads(run_pyroshock("campaigns", "deleted", "--json", "--db", lab).stdout)
    assert {name: stone["counts"][name] for name in TABLES} == dict.fromkeys(TABLES, 1)
    assert names(lab) == ["plan.pdf"] and is_sound(lab)


def test_a_discarded_recording_leaves_what_is_attached_to_its_impact(
    lab: str, tmp_path: Path
) -> None:
    attach(lab, tmp_path, "tip.jpg", picture(), "--impact", "spring/2/1")
    discard = ("runs", "discard", "spring", "--run", "2", "--reason", "loose")
    run_pyroshock(*discard, "--db", lab)
    assert names(lab) == ["tip.jpg"]
    (stone,) = json.loads(run_pyroshock("campaigns", "deleted", "--json", "--db", lab).stdout)
    run_pyroshock("runs", "restore", "spring", stone["recording"], "--db", lab)
    assert names(lab, "--impact", "spring/2/1") == ["tip.jpg"] and is_sound(lab)


def test_a_file_of_an_earlier_archive_without_the_newest_attachment_deletes_nothing(
    lab: str, tmp_path: Path
) -> None:
    out = tmp_path / "spring.pyroshock"
    with opened(lab) as store:
        write_archive(store, "spring", out)
    attach(lab, tmp_path, "plate.jpg", picture(), "--campaign", "spring")
    with opened(lab) as store, pytest.raises(ForeignFileError, match="as the store has it"):
        write_archive(store, "spring", out)
    answer = run_pyroshock(
        "campaigns", "archive", "spring", "--out", out, "--reason", "r", "--db", lab, code=2
    )
    assert "spring" in answer.stderr and names(lab) == ["plate.jpg"]


def test_a_copy_and_a_backup_of_the_store_hold_the_files(lab: str, tmp_path: Path) -> None:
    attach(lab, tmp_path, "series.csv", LARGE, "--campaign", "spring")
    copy = f"sqlite:///{tmp_path / 'copy.db'}"
    run_pyroshock("db", "copy", lab, copy)
    assert rows(copy) == [1, 1, 3] and is_sound(copy)
    with opened(copy) as store, store.reading() as session:
        assert content_of(session, 1) == LARGE


def test_two_clients_attach_the_same_content_at_once(lab: str) -> None:
    with opened(lab) as first, opened(lab) as second:
        person = Person("anna")

        def add(session: Any) -> int:
            subject = find_subject(session, "campaign", "spring")
            with second.reading() as session_of_second:
                there = session_of_second.scalar(select(func.count()).select_from(AttachedContent))
            if not there and not raced:
                raced.append(True)
                second.write(
                    lambda own: add_attachment(
                        own, find_subject(own, "campaign", "autumn"), "b.jpg", picture(), None,
                        person,
                    )
                )  # fmt: skip
            return add_attachment(session, subject, "a.jpg", picture(), None, person)

        raced: list[bool] = []
        if lab.startswith("postgresql"):
            first.write(add)
        else:  # SQLite has one writer at a time, and the second would wait for the first
            raced.append(True)
            first.write(add)
            second.write(
                lambda own: add_attachment(
                    own, find_subject(own, "campaign", "autumn"), "b.jpg", picture(), None, person
                )
            )
        with first.reading() as session:
            assert session.scalar(select(func.count()).select_from(AttachedContent)) == 1
            assert session.scalar(select(func.count()).select_from(AttachedPiece)) == 1
            assert session.scalar(select(func.count()).select_from(Attachment)) == 2
