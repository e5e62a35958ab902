"""What may pass to the application, uploads and paths among it, and that what may not changes
nothing."""

from __future__ import annotations

import io
import stat
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.app.operations.machine_paths import PathError, campaigns_below, confined
from pyroshock.app.web.settings import Settings, SettingsError
from pyroshock.app.web.uploads import UploadError, safe_path, unpacked
from pyroshock.schema.session import Store, count_rows
from starlette.testclient import TestClient
from support.processes.web_client import post_json, sqlite, token, token_in, window

WORD = "a-token-of-enough-characters"


@pytest.fixture
def client(tmp_path: Path) -> Iterator[TestClient]:
    with window(sqlite(tmp_path)) as (client, _):
        yield client


@pytest.fixture
def guarded(tmp_path: Path) -> Iterator[TestClient]:
    """Reached from elsewhere, hence with a token."""
    with window(sqlite(tmp_path), host="0.0.0.0", token=WORD) as (client, _):
        yield client


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.1.5", "lab-server", "::"])
def test_an_address_that_others_reach_needs_a_token(host: str) -> None:
    with pytest.raises(SettingsError, match="token"):
        Settings("sqlite://", host)
    with pytest.raises(SettingsError, match="5 characters"):
        Settings("sqlite://", host, token="12345")
    assert Settings("sqlite://", host, token=WORD).host == host


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "::1", "127.0.0.9"])
def test_loopback_needs_none(host: str) -> None:
    assert Settings("sqlite://", host).token is None


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:8000", "127.0.0.1.evil.example", "", "[", "10.0.0.1"]
)
def test_a_foreign_name_of_this_machine_is_refused_and_own_ones_taken(
    client: TestClient, host: str
) -> None:
    answer = client.get("/jobs", headers={"host": host})
    assert (answer.status_code, "pyroshock serve" in answer.text) == (421, True)
    for own in ("127.0.0.1:8000", "localhost", "[::1]:99", "LOCALHOST:1"):
        assert client.get("/jobs", headers={"host": own}).status_code == 200


def _tries(client: TestClient) -> list[int]:
    """A write without a token, with a made-up one, with one of another session, and from another
    page."""
    other = TestClient(client.app, base_url="http://127.0.0.1:8000")
    elsewhere = {"X-CSRF-Token": token(client), "origin": "http://evil.example"}
    headers: tuple[dict[str, str], ...] = (
        {},
        {"X-CSRF-Token": "0" * 64},
        {"X-CSRF-Token": token(other)},
        elsewhere,
    )
    sent = [
        client.post("/api/ingest", json={"path": "x"}, headers=request_headers)
        for request_headers in headers
    ]
    sent += [client.post("/ingest/path", data={"path": "x"} | more) for more in ({}, {"csrf": "é"})]
    return [answer.status_code for answer in sent]


def test_a_write_needs_the_token_of_its_session(tmp_path: Path) -> None:
    with window(sqlite(tmp_path), folders=(tmp_path,)) as (client, store):
        before = count_rows(store)
        assert (
            _tries(client) == [403] * 6
            and client.get("/api/jobs").json() == []
            and count_rows(store) == before
        )
        # with it, the same write reaches the folder's check
        assert post_json(client, "/api/ingest", {"path": "x"}).status_code == 422


def test_without_the_token_of_the_server_nothing_is_told_and_a_browser_keeps_it(
    guarded: TestClient,
) -> None:
    for address in (
        "/jobs",
        "/api/jobs",
        "/static/style.css",
        "/api/openapi.json",
        "/api/csrf",
        "/nowhere",
    ):
        answer = guarded.get(address, headers={"host": "lab-server:8000"})
        assert (answer.status_code, "campaign" in answer.text.lower()) == (401, False), address
    for wrong in ("", "x", WORD + "x", WORD[:-1], WORD.upper()):
        assert guarded.get(f"/jobs?token={wrong}").status_code == 401
        assert guarded.get("/jobs", headers={"authorization": f"Bearer {wrong}"}).status_code == 401
        # test_sign_in.py: how long more of them wait
        guarded.app.sign_in.attempts.succeeded("testclient")  # type: ignore[attr-defined]
    assert guarded.get("/api/jobs", headers={"authorization": f"Bearer {WORD}"}).json() == []
    answer = guarded.get(f"/ingest?a=1&token={WORD}")
    # the token leaves the address
    assert (answer.status_code, answer.headers["location"]) == (303, "/ingest?a=1")
    assert WORD not in answer.headers["set-cookie"] and "HttpOnly" in answer.headers["set-cookie"]
    assert guarded.get("/ingest").status_code == 200
    guarded.cookies.clear()
    answer = guarded.get(f"http://127.0.0.1:8000//evil.example/?token={WORD}")
    assert answer.headers["location"] == "/evil.example/"


def test_pages_carry_the_token_and_every_route_that_writes_asks_for_it(
    client: TestClient, tmp_path: Path
) -> None:
    page = client.get("/ingest")
    assert token_in(page.text) == token(client)
    headers, policy = page.headers, page.headers["content-security-policy"]
    assert "default-src 'none'" in policy and "frame-ancestors 'none'" in policy
    assert "unsafe" not in policy.split("script-src")[1].split(";")[0]
    assert headers["x-content-type-options"] == "nosniff" and headers["cache-control"] == "no-store"
    assert (
        client.get("/api/jobs/7").status_code == 404
        and "no job 7" in client.get("/api/jobs/7").json()["detail"]
    )
    page = client.get("/jobs/7")
    assert (
        page.status_code == 404
        and "no job 7" in page.text
        and client.get("/jobs/x").status_code == 422
    )
    sent = {"X-CSRF-Token": token(client)}
    assert (
        client.post("/api/jobs/1/stop", content=b"x" * 1_000_001, headers=sent).status_code == 413
    )
    parts, sent = (b"a" * 100_000 for _ in range(30)), sent | {"content-type": "application/json"}
    assert client.post("/api/diagnoses", content=parts, headers=sent).status_code == 413
    store: Store = client.app.app.app.app.state.store  # type: ignore[attr-defined]
    before, files = count_rows(store), [("files", ("../../campaign.toml", b"x"))]
    answer = client.post("/ingest/upload", data={"csrf": token(client)}, files=files)
    assert (
        answer.status_code == 422
        and count_rows(store) == before
        and client.get("/api/jobs").json() == []
    )
    # Whatever is added later, too.
    routes = client.get("/api/openapi.json").json()["paths"]
    written = [path for path, methods in routes.items() if set(methods) - {"get"}]
    assert len(written) >= 3
    for path in written:
        address = path
        for part in ("job", "diagnosis", "impact", "version", "run"):
            address = address.replace("{" + part + "}", "1")
        address = address.replace("{", "").replace("}", "")
        for method in set(routes[path]) - {"get"}:
            answer = client.request(method, address, json={})
            assert answer.status_code == 403, (method, address, answer.text)


# --- uploaded files and paths of the server: what is taken, and what never reaches the disk ---
TOML = b'[campaign]\nname = "spring"\nkind = "gun"\ndate = 2026-01-01\n'


def _zip(files: dict[str, bytes], **more: int) -> io.BytesIO:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            info = zipfile.ZipInfo(name)
            info.external_attr = more.get("mode", stat.S_IFREG | 0o644) << 16
            archive.writestr(info, content, zipfile.ZIP_DEFLATED)
    out.seek(0)
    return out


def _nothing_written(target: Path) -> bool:
    return not any(path.is_file() for path in target.rglob("*"))


def test_a_folder_is_written_as_the_browser_names_it(tmp_path: Path) -> None:
    files = [
        ("spring/campaign.toml", io.BytesIO(TOML)),
        ("spring/recordings/1.mat", io.BytesIO(b"abc")),
    ]
    folder = unpacked(files, tmp_path, 1000)
    assert (
        folder == tmp_path / "spring" and (folder / "recordings" / "1.mat").read_bytes() == b"abc"
    )
    for second in ("CAMPAIGN.toml", "campaign.toml", "campaign.toml/x"):
        with pytest.raises(UploadError, match="same name"):
            unpacked(
                [("campaign.toml", io.BytesIO(TOML)), (second, io.BytesIO(b""))], tmp_path, 1000
            )


@pytest.mark.parametrize("top", ["", "spring/"])
def test_a_zip_is_unpacked(tmp_path: Path, top: str) -> None:
    content = _zip({f"{top}campaign.toml": TOML, f"{top}recordings/1.mat": b"abc"})
    assert (
        unpacked([("spring.ZIP", content)], tmp_path, 1000) / "recordings" / "1.mat"
    ).read_bytes() == b"abc"


_BAD_NAMES = (
    *("../x", "/etc/passwd", "a/../../x", "C:\\x", "..\\x", "", ".", "a/\0b", "a\nb", "con:", " a",
    "a."),
    *("x" * 500, "a/b/c/d/e/f/g/h/i"),
)  # fmt: skip


@pytest.mark.parametrize("name", _BAD_NAMES)
def test_names_that_leave_the_folder_are_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(UploadError, match="no file name"):
        safe_path(name)
    with pytest.raises(UploadError):
        unpacked([("campaign.toml", io.BytesIO(TOML)), (name, io.BytesIO(b"x"))], tmp_path, 1000)
    assert _nothing_written(tmp_path)


@given(st.text(max_size=60))
def test_no_name_leaves_the_folder(name: str) -> None:
    base = Path("/srv/uploads")
    try:
        path = safe_path(name)
    except UploadError:
        return
    assert (base / path).resolve().is_relative_to(base) and (base / path) != base


@pytest.mark.parametrize(
    ("files", "allowed", "reason"),
    [
        (
            [("a.zip", _zip({"campaign.toml": b"/etc/passwd"}, mode=stat.S_IFLNK | 0o777))],
            1000,
            "link or a device",
        ),
        (
            [("a.zip", _zip({"campaign.toml": TOML, "recordings/1.mat": bytes(30_000_000)}))],
            10**9,
            "unpacks to",
        ),
        (
            [("campaign.toml", io.BytesIO(TOML)), ("a.mat", io.BytesIO(b"x" * 5000))],
            1000,
            "larger than",
        ),
        *(
            ([("a.zip", io.BytesIO(it))], 1000, "cannot be read")
            for it in (b"", b"PK\3\4 no zip", b"x" * 100)
        ),
        ([("notes.md", io.BytesIO(b""))], 1000, r"no campaign\.toml"),
        ([], 1000, "no file was sent"),
    ],
    ids=["link", "bomb", "too much", "empty", "no zip", "text", "no campaign", "nothing"],
)
def test_what_is_no_campaign_of_the_allowed_size_is_refused(
    tmp_path: Path, files: list, allowed: int, reason: str
):
    with pytest.raises(UploadError, match=reason):
        unpacked(files, tmp_path, allowed)
    if files and files[0][0] == "a.zip":
        assert _nothing_written(tmp_path)


def _campaign(folder: Path) -> Path:
    folder.mkdir(parents=True)
    (folder / "campaign.toml").write_bytes(TOML)
    return folder


def test_paths_stay_below_their_folders(tmp_path: Path) -> None:
    data, outside = tmp_path / "data", _campaign(tmp_path / "outside")
    inside = _campaign(data / "spring")
    (data / "link").symlink_to(outside)
    assert confined("spring", (data,)) == inside and confined(str(inside), (data,)) == inside
    refusals = set()
    elsewhere = ("../outside", str(outside), "link", "spring/../../outside")
    for path in (*elsewhere, "nowhere", "/etc", "\0", "spring/campaign.toml"):
        with pytest.raises(PathError) as error:
            confined(path, (data,))
        refusals.add(str(error.value).replace(repr(path), "PATH"))
    assert (
        len(refusals - {"PATH is no path"}) == 1
    )  # nothing tells whether there is something outside


def test_campaign_folders_are_suggested(tmp_path: Path) -> None:
    inside = _campaign(tmp_path / "data" / "2026" / "spring")
    _campaign(tmp_path / "data" / ".hidden")
    (tmp_path / "data" / "link").symlink_to(_campaign(tmp_path / "outside"))
    assert (
        campaigns_below((tmp_path / "data",)) == [str(inside)]
        and campaigns_below((tmp_path / "nowhere",)) == []
    )


def _with_bytes(content: io.BytesIO, at: int, new: bytes) -> io.BytesIO:
    raw = content.getvalue()
    at %= len(raw)
    return io.BytesIO(raw[:at] + new + raw[at + len(new) :])


_TEXT = bytes(range(32, 127)) * 40
_DAMAGED = {
    "packed bytes": lambda: _with_bytes(_zip({"campaign.toml": _TEXT}), 60, b"\xff" * 20),
    "place of the list of members": lambda: _with_bytes(
        _zip({"campaign.toml": _TEXT}), -6, b"\xff\xff\xff\x7f"
    ),
    "a member without a name": lambda: _zip({"": TOML}),
    "a name longer than any": lambda: _zip({"x" * 300: TOML}),
}


@pytest.mark.parametrize("damage", _DAMAGED)
def test_a_damaged_zip_is_refused(tmp_path: Path, damage: str) -> None:
    """zipfile leaks zlib.error, IndexError, ValueError, OSError: the page ended in an error of the
    server."""
    with pytest.raises(UploadError) as refused:
        unpacked([("spring.zip", _DAMAGED[damage]())], tmp_path, 10_000_000)
    assert len(str(refused.value).splitlines()) == 1
