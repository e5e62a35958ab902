"""Attached files on the pages and in the API: who attaches, reads and removes, what is shown, and
that nothing that a stranger sends runs in a browser."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from PIL import Image
from pyroshock.app.library.remote_store import RemoteStore
from pyroshock.app.operations.people.attachments import MOST_BYTES
from pyroshock.app.server.application import application
from pyroshock.app.web.guard import ATTACHMENTS
from pyroshock.app.web.settings import Settings
from pyroshock.schema.attachments import Attachment
from sqlalchemy import func, select
from starlette.testclient import TestClient
from support.processes.web_client import TestConnection, post, post_json, sqlite, token
from support.records.attached_files import HTML, PDF, SVG, picture, png_of_size, zipped
from support.records.campaigns import hammer_campaign
from support.stores.stores import ingested, opened
from support.stores.team import Team, team_of

PEOPLE = {"rita": "reader", "olaf": "operator", "emma": "engineer"}
EVIL = "<script>alert(1)</script> & 'x'"
#: What a page asks for a picture with, and for everything else.
SAFE = {
    "content-security-policy": "default-src 'none'; sandbox",
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
}


class Laboratory(Team):
    """A team that counts what is attached."""

    def count(self) -> int:
        with self.store.reading() as session:
            return session.scalar(select(func.count()).select_from(Attachment)) or 0


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Laboratory]:
    with team_of(tmp_path_factory.mktemp("attachments"), PEOPLE) as team:
        yield Laboratory(team.store, team.db)


def send(client: TestClient, name: str, content: bytes, **fields: str) -> Any:
    """A file as JSON."""
    file = {"name": name, "content": base64.b64encode(content).decode()}
    return post_json(client, "/api/attachments", {"file": file, **fields})


def upload(client: TestClient, name: str, content: bytes, **fields: str) -> Any:
    """A file as the form of a page sends it."""
    files = {"file": (name, content, "text/html")}
    return post(client, "/attachments", fields, files=files)


_NUMBER = iter(range(1, 10_000))


def new_picture(kind: str = "PNG", size: tuple[int, int] = (64, 48)) -> bytes:
    """A picture that no test has attached before."""
    into = BytesIO()
    Image.new("RGB", (size[0], size[1]), next(_NUMBER)).save(into, kind)
    return into.getvalue()


@pytest.mark.parametrize(("kind", "subject", "page"), [
    ("campaign", "spring", "/campaigns/spring"),
    ("impact", "1", "/impacts/1"),
    ("impact", "spring/2/1", "/impacts/2"),
    ("run", "autumn/3", "/plans/autumn/sheet?run=3"),
    ("plan", "autumn", "/plans/autumn"),
])  # fmt: skip
def test_a_picture_is_shown_on_the_page_of_its_subject_with_its_caption_as_text(
    lab: Laboratory, kind: str, subject: str, page: str
) -> None:
    client, content = lab.browser("olaf"), new_picture()
    answer = upload(client, "plate.png", content, **{kind: subject, "caption": f"{EVIL} {kind}"})
    assert answer.status_code == 303
    assert answer.headers["location"] == f"{page}#attachments-{kind}"
    reader = lab.browser("rita")
    shown = reader.get(page).text
    number = reader.get("/api/attachments").json()[0]["attachment"]
    assert f'<img src="/attachments/{number}/preview"' in shown
    assert "<script>alert(1)" not in shown
    assert "&lt;script&gt;alert(1)&lt;/script&gt; &amp; &#39;x&#39;" in shown
    assert "plate.png</a>, " in shown and "olaf, " in shown
    assert reader.get(f"/attachments/{number}/file").content == content
    with Image.open(BytesIO(reader.get(f"/attachments/{number}/preview").content)) as image:
        assert image.size == (64, 48)
    assert "plate.png" in reader.get("/attachments").text


def test_a_document_is_listed_with_its_size_and_handed_out_as_a_file(lab: Laboratory) -> None:
    facts = send(lab.browser("olaf"), "sensor № 3.pdf", PDF, campaign="spring").json()
    assert facts["sha256"] == hashlib.sha256(PDF).hexdigest() and facts["author"] == "olaf"
    reader = lab.browser("rita")
    page = reader.get("/campaigns/spring").text
    assert f"sensor № 3.pdf</a>, {len(PDF)} bytes" in page
    answer = reader.get(f"/attachments/{facts['attachment']}/file")
    assert answer.content == PDF
    assert answer.headers["content-type"] == "application/octet-stream"
    assert (
        answer.headers["content-disposition"]
        == "attachment; filename*=UTF-8''sensor%20%E2%84%96%203.pdf"
    )
    assert SAFE.items() <= answer.headers.items()
    attachment = reader.get(f"/api/attachments/{facts['attachment']}").json()
    assert (
        base64.b64decode(attachment["content"]) == PDF and attachment["sha256"] == facts["sha256"]
    )
    assert reader.get(f"/attachments/{facts['attachment']}/preview").status_code == 404


def test_pictures_alone_are_drawn_and_a_browser_has_them_once(lab: Laboratory) -> None:
    client = lab.browser("olaf")
    for kind in ("PNG", "JPEG", "GIF", "WEBP"):
        facts = send(client, "plate", new_picture(kind), campaign="spring").json()
        address = f"/attachments/{facts['attachment']}/file"
        answer = client.get(address)
        assert answer.headers["content-type"] == f"image/{kind.lower()}" == facts["media_type"]
        assert answer.headers["content-disposition"].startswith("inline; ")
        assert SAFE.items() <= answer.headers.items()
        second_answer = client.get(address, headers={"if-none-match": answer.headers["etag"]})
        assert (second_answer.status_code, second_answer.content) == (304, b"")
        saved = client.get(address, params={"download": "true"})
        assert saved.headers["content-type"] == "application/octet-stream"
        assert saved.headers["content-disposition"].startswith("attachment; ")


@pytest.mark.parametrize(("name", "content", "words"), [
    ("photo.png", HTML, "HTML, SVG or XML"), ("drawing.svg", SVG, "HTML, SVG or XML"),
    ("page.txt", b"\n\n <HTML>", "HTML, SVG or XML"), ("empty.jpg", b"", "it is empty"),
    ("tool.exe", b"MZ" + bytes(99), "no kind that is known"),
    ("cut.jpg", b"\xff\xd8\xff\xe0\x00\x10JFIF", "no whole picture"),
    ("a" * 201 + ".png", picture("PNG"), "a name of 205 letters"),
    ("photo\u202egnp.png", picture("PNG"), "in its name"), ("a\x01b.png", picture("PNG"), "name"),
    ("..", picture("PNG"), "expected a name"), ("/", picture("PNG"), "expected a name"),
])  # fmt: skip
def test_what_may_harm_is_refused_in_words_and_nothing_is_stored(
    lab: Laboratory, name: str, content: bytes, words: str
) -> None:
    client, count_before = lab.browser("olaf"), lab.count()
    answer = send(client, name, content, campaign="spring")
    assert answer.status_code == 422 and words in answer.text
    if name not in ("..", "/", "a\x01b.png"):  # no browser sends such a name
        form = upload(client, name, content, campaign="spring")
        assert form.status_code == 422 and words in form.text
    assert lab.count() == count_before


@pytest.mark.parametrize("name", [
    "../../../etc/passwd.png", "C:\\Users\\olaf\\passwd.png", "/etc/passwd.png", "a/b/passwd.png",
])  # fmt: skip
def test_of_a_path_the_name_alone_is_kept(lab: Laboratory, name: str) -> None:
    facts = send(lab.browser("olaf"), name, new_picture(), campaign="spring").json()
    assert facts["file_name"] == "passwd.png"


@pytest.mark.parametrize("file", [
    "/etc/passwd", "a,b\n1,2\n", {"name": "a.txt"}, {"name": 3, "content": "YQ=="},
    {"name": "a.txt", "content": "no base64"}, {"path": "/etc/passwd", "name": "a"}, None, [1],
])  # fmt: skip
def test_a_path_of_the_server_and_what_is_no_file_are_refused(lab: Laboratory, file: Any) -> None:
    answer = post_json(
        lab.browser("olaf"), "/api/attachments", {"file": file, "campaign": "spring"}
    )
    assert answer.status_code == 422 and "root:" not in answer.text


def test_a_huge_picture_is_kept_and_never_drawn(lab: Laboratory) -> None:
    client = lab.browser("olaf")
    facts = send(client, "huge.png", png_of_size(40_000, 30_000), campaign="spring").json()
    assert (facts["width_px"], facts["height_px"]) == (40_000, 30_000)
    page = client.get("/campaigns/spring").text
    assert "a picture of 40000 × 30000 pixels, which is too large to be shown" in page
    assert f"/attachments/{facts['attachment']}/preview" not in page
    assert client.get(f"/attachments/{facts['attachment']}/preview").status_code == 404
    answer = client.get(f"/attachments/{facts['attachment']}/file")
    assert answer.headers["content-disposition"].startswith("attachment; ")


def test_a_picture_whose_content_is_damaged_is_told_and_the_page_stands(lab: Laboratory) -> None:
    client = lab.browser("olaf")
    facts = send(client, "small.png", png_of_size(600, 400), campaign="spring").json()
    answer = client.get(f"/attachments/{facts['attachment']}/preview")
    assert answer.status_code == 422 and "cannot be drawn" in answer.text
    assert client.get("/campaigns/spring").status_code == 200


def test_a_file_beyond_the_limit_is_refused_before_it_is_read(lab: Laboratory) -> None:
    client, headers = lab.browser("olaf"), {}
    headers["X-CSRF-Token"] = token(client)
    for address, limit in ATTACHMENTS.items():
        answer = client.post(address, content=bytes(limit + 1), headers=headers)
        assert answer.status_code == 413
        assert "50,000,000 bytes, which is the most that is attached" in answer.text
    large = bytes(MOST_BYTES + 1)
    answer = upload(client, "large.txt", large, campaign="spring")
    assert answer.status_code == 422 and "more than 50,000,000 bytes" in answer.text


def test_a_file_of_several_megabytes_goes_through_form_and_json(lab: Laboratory) -> None:
    client = lab.browser("olaf")
    for number, sending in enumerate((send, upload)):
        content = f"{number}\n".encode() + b"0.123,4\n" * 500_000
        assert sending(client, "series.csv", content, campaign="spring").status_code in (200, 303)
        number = client.get("/api/attachments").json()[0]["attachment"]
        assert client.get(f"/attachments/{number}/file").content == content


def test_each_role_does_what_it_may(lab: Laboratory) -> None:
    reader, operator, engineer = (lab.browser(name) for name in PEOPLE)
    assert send(reader, "a.png", new_picture(), campaign="spring").status_code == 403
    assert upload(reader, "a.png", new_picture(), campaign="spring").status_code == 403
    number = send(operator, "a.png", new_picture(), campaign="spring").json()["attachment"]
    address, why = f"/api/attachments/{number}", {"reason": "another plate"}
    for client in (reader, operator):
        answer = post_json(client, f"{address}/remove", why)
        assert answer.status_code == 403 and "engineer" in answer.text
        assert post(client, f"/attachments/{number}/remove", why).status_code == 403
    assert post(engineer, f"/attachments/{number}/remove", why).status_code == 303
    page = reader.get("/campaigns/spring").text
    assert "a.png was removed" in page and "another plate (emma, " in page
    for place in (f"/attachments/{number}/file", f"/attachments/{number}/preview", address):
        answer = reader.get(place, headers={"if-none-match": "*"})
        assert answer.status_code == 404 and "another plate" in answer.text
    assert post(operator, f"/attachments/{number}/restore").status_code == 403
    assert post(engineer, f"/attachments/{number}/restore").status_code == 303
    assert reader.get(f"/attachments/{number}/file").status_code == 200


def test_nobody_reads_or_writes_without_signing_in_or_without_the_token(lab: Laboratory) -> None:
    stranger = TestClient(lab.app, base_url="http://127.0.0.1:8000", follow_redirects=False)
    for address in ("/attachments", "/attachments/1/file", "/api/attachments/1"):
        assert stranger.get(address).status_code == 401
    client, count_before = lab.browser("olaf"), lab.count()
    form = {"campaign": "spring"}
    files = {"file": ("a.png", picture("PNG"), "image/png")}
    assert client.post("/attachments", data=form, files=files).status_code == 403
    answer = client.post(
        "/attachments",
        data={**form, "csrf": token(client)},
        files=files,
        headers={"origin": "https://evil.example"},
    )
    assert answer.status_code == 403
    for place in ("remove", "restore"):
        assert client.post(f"/attachments/1/{place}", data={"reason": "x"}).status_code == 403
    assert lab.count() == count_before


def test_a_script_in_another_encoding_or_a_zip_file_is_only_ever_saved(lab: Laboratory) -> None:
    client = lab.browser("olaf")
    for name, content in (
        ("a.html", b"+ADw-script+AD4-alert(1)+ADw-/script+AD4-"),
        ("b.html", b"text first <script>alert(1)</script>"),
        ("c.zip", zipped(index_html=HTML)),
    ):
        facts = send(client, name, content, campaign="spring").json()
        answer = client.get(f"/attachments/{facts['attachment']}/file")
        assert answer.headers["content-type"] == "application/octet-stream"
        assert answer.headers["content-disposition"].startswith("attachment; ")
        assert SAFE.items() <= answer.headers.items()


def test_the_python_library_attaches_here_and_on_a_server(tmp_path: Path) -> None:
    import pyroshock as ps

    file, content = tmp_path / "plate.png", new_picture()
    file.write_bytes(content)
    db = sqlite(tmp_path)
    ingested(db, hammer_campaign(tmp_path / "spring", recordings=1, hits=1, name="spring"))
    with opened(db) as store:
        app = application(Settings(db, works=False), store)
        client = TestClient(app, base_url="http://127.0.0.1:8000", follow_redirects=False)
        places: list[dict[str, Any]] = [{"impact": 1}, {"campaign": "spring"}]
        libraries = (ps.open(db), RemoteStore(TestConnection(client)))
        for number, (library, place) in enumerate(zip(libraries, places, strict=True)):
            key = library.attach(file, caption="tip", **place).to_json()["attachment"]
            attached = library.attachment(key)
            assert attached.content == content
            attached.write(tmp_path / "back.png")
            assert (tmp_path / "back.png").read_bytes() == content
            frame = library.attachments(campaign="spring")
            assert list(frame["file_name"]) == ["plate.png"] * (number + 1)
            with pytest.raises(ps.InvalidValueError, match="already, as attachment"):
                library.attach(file, **place)
            with pytest.raises(ps.InvalidValueError, match="which does not exist"):
                library.attach(tmp_path / "none.png", campaign="spring")
            library.remove_attachment(key, reason="another plate")
            with pytest.raises(ps.NotFoundError, match="another plate"):
                library.attachment(key)
            library.restore_attachment(key)
            library.close()
