"""What `make audit` and `make licences` find, and what they say where nobody can be asked."""

from __future__ import annotations

import json
import threading
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import date
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import pytest

from tools import audit, licences

RULES = tomllib.loads(licences.RULES.read_text(encoding="utf-8"))
HOLE = audit.Outcome(1, (), (("six 1.17.0", "PYSEC-1", "9.9"),))
DAY = date(2026, 12, 1)


class _Advisories(BaseHTTPRequestHandler):
    """As api.osv.dev answers: one vulnerability of every package."""

    def do_POST(self) -> None:
        asked = json.loads(self.rfile.read(int(self.headers["content-length"])))
        name = asked["package"]["name"]
        ranges = [{"type": "ECOSYSTEM", "events": [{"introduced": "0"}, {"fixed": "99.0"}]}]
        affected = [
            {
                "package": {"name": name, "ecosystem": "PyPI"},
                "versions": [asked["version"]],
                "ranges": ranges,
            }
        ]
        hole = {
            "id": "PYSEC-2026-1",
            "summary": "planted",
            "details": "planted",
            "affected": affected,
        }
        content = json.dumps({"vulns": [hole]}).encode()
        self.send_response(200)
        self.send_header("content-length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, *_: object) -> None:
        """Not on the tests' standard error."""


@contextmanager
def _service() -> Iterator[str]:
    with HTTPServer(("127.0.0.1", 0), _Advisories) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}/v1/query"
        server.shutdown()
        thread.join()


def test_a_published_vulnerability_is_found(tmp_path: Path) -> None:
    """By pip-audit itself, of a service that knows one."""
    pins = tmp_path / "pins.txt"
    pins.write_text("six==1.17.0\n")
    with _service() as address:
        found = audit.outcome_by(
            "osv", "--osv-url", address, "-r", str(pins), "--no-deps", "--disable-pip"
        )
    assert found.asked == 1 and found.vulnerable == (("six 1.17.0", "PYSEC-2026-1", "99.0"),)


@pytest.mark.slow
def test_nobody_to_ask_is_not_a_clean_bill(tmp_path: Path) -> None:
    pins = tmp_path / "pins.txt"
    pins.write_text("six==1.17.0\n")
    closed = (
        "--osv-url",
        "http://127.0.0.1:9/v1/query",
        "-r",
        str(pins),
        "--no-deps",
        "--disable-pip",
    )
    found = audit.outcome_by("osv", *closed)
    assert found.asked == 0 and "NOT DONE" in audit.told(found)


def test_unknown_packages_are_named_and_accepted_ones_have_a_reason_and_an_end() -> None:
    skipped = {
        "name": "six",
        "skip_reason": "Dependency not found on PyPI and could not be audited: six (1.17.0)",
    }
    known = {"name": "tqdm", "version": "4.70.1", "vulns": []}
    assert "NOT DONE" in audit.told(audit.outcome_of({"dependencies": [skipped]}))
    assert "1 packages asked, 0 vulnerabilities; not known there: six" in audit.told(
        audit.outcome_of({"dependencies": [skipped, known]})
    )
    for accepted in tomllib.loads(audit.ACCEPTED.read_text(encoding="utf-8")).get("accepted", []):
        assert accepted.keys() == {"id", "package", "reason", "until"} and isinstance(
            accepted["until"], date
        )


@pytest.mark.parametrize(("accepted", "said"), [
    ([], "six 1.17.0: PYSEC-1, mended in 9.9: raise its pin"),
    ([{"id": "PYSEC-1", "package": "six", "until": date(2026, 11, 30)}],
     "was accepted until 2026-11-30"),
    ([{"id": "PYSEC-1", "package": "other", "until": date(2027, 1, 1)}], "raise its pin"),
    ([{"id": "PYSEC-1", "package": "six", "until": date(2027, 1, 1)}], None),
])  # fmt: skip
def test_a_vulnerability_fails_unless_accepted_for_now(
    accepted: list[dict[str, object]], said: str | None
) -> None:
    lines = list(audit.not_accepted(HOLE, accepted, DAY))
    assert lines == [] if said is None else said in lines[0]


@pytest.mark.parametrize(("licence", "said"), [
    ("MIT", None),
    ("Apache-2.0 AND (MIT OR BSD-3-Clause)", None),
    ("GPL-3.0-or-later", "GPL-3.0-or-later is not allowed"),
    ("MIT OR AGPL-3.0-only", "AGPL-3.0-only is not allowed"),
    ("LGPL-2.1-only", "LGPL-2.1-only is not allowed"),
    ("", "its metadata name no licence"),
    ("Our own terms", "Our own terms is not allowed"),
])  # fmt: skip
def test_licences_are_allowed_by_name(licence: str, said: str | None) -> None:
    lines = list(licences.objections({"newcomer": licence}, RULES))
    assert lines == [] if said is None else said in lines[0]
    assert list(licences.objections({"nptdms": "LGPL-3.0-only"}, RULES)) == []  # reviewed
    assert "look again" in next(licences.objections({"nptdms": "GPL-3.0-only"}, RULES))


def test_every_installed_package_may_be_used(capsys: pytest.CaptureFixture[str]) -> None:
    assert licences.main(["--list"]) == 0, capsys.readouterr().err
    assert "sqlalchemy" in capsys.readouterr().out
