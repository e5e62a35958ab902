"""Uploaded files and paths of the server: what is taken, and what never reaches the disk."""

from __future__ import annotations

import io
import stat
import zipfile
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.app.ingest.uploads import PathError, UploadError, campaigns_below, confined, safe_path, unpacked

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
    files = [("spring/campaign.toml", io.BytesIO(TOML)), ("spring/recordings/1.mat", io.BytesIO(b"abc"))]
    folder = unpacked(files, tmp_path, 1000)
    assert folder == tmp_path / "spring" and (folder / "recordings" / "1.mat").read_bytes() == b"abc"
    for second in ("CAMPAIGN.toml", "campaign.toml", "campaign.toml/x"):
        with pytest.raises(UploadError, match="same name"):
            unpacked([("campaign.toml", io.BytesIO(TOML)), (second, io.BytesIO(b""))], tmp_path, 1000)


@pytest.mark.parametrize("top", ["", "spring/"])
def test_a_zip_is_unpacked(tmp_path: Path, top: str) -> None:
    content = _zip({f"{top}campaign.toml": TOML, f"{top}recordings/1.mat": b"abc"})
    assert (unpacked([("spring.ZIP", content)], tmp_path, 1000) / "recordings" / "1.mat").read_bytes() == b"abc"


_BAD_NAMES = (
    *("../x", "/etc/passwd", "a/../../x", "C:\\x", "..\\x", "", ".", "a/\0b", "a\nb", "con:", " a", "a."),
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


@pytest.mark.parametrize(("files", "allowed", "reason"), [
    ([("a.zip", _zip({"campaign.toml": b"/etc/passwd"}, mode=stat.S_IFLNK | 0o777))], 1000, "link or a device"),
    ([("a.zip", _zip({"campaign.toml": TOML, "recordings/1.mat": bytes(30_000_000)}))], 10**9, "unpacks to"),
    ([("campaign.toml", io.BytesIO(TOML)), ("a.mat", io.BytesIO(b"x" * 5000))], 1000, "larger than"),
    *(([("a.zip", io.BytesIO(it))], 1000, "cannot be read") for it in (b"", b"PK\3\4 no zip", b"x" * 100)),
    ([("runs.csv", io.BytesIO(b""))], 1000, r"no campaign\.toml"),
    ([], 1000, "no file was sent"),
], ids=["link", "bomb", "too much", "empty", "no zip", "text", "no campaign", "nothing"])  # fmt: skip
def test_what_is_no_campaign_of_the_allowed_size_is_refused(tmp_path: Path, files: list, allowed: int, reason: str):
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
    said = set()
    elsewhere = ("../outside", str(outside), "link", "spring/../../outside")
    for path in (*elsewhere, "nowhere", "/etc", "\0", "spring/campaign.toml"):
        with pytest.raises(PathError) as error:
            confined(path, (data,))
        said.add(str(error.value).replace(repr(path), "PATH"))
    assert len(said - {"PATH is no path"}) == 1  # nothing tells whether there is something outside


def test_campaign_folders_are_suggested(tmp_path: Path) -> None:
    inside = _campaign(tmp_path / "data" / "2026" / "spring")
    _campaign(tmp_path / "data" / ".hidden")
    (tmp_path / "data" / "link").symlink_to(_campaign(tmp_path / "outside"))
    assert campaigns_below((tmp_path / "data",)) == [str(inside)] and campaigns_below((tmp_path / "nowhere",)) == []


def _with_bytes(content: io.BytesIO, at: int, new: bytes) -> io.BytesIO:
    raw = content.getvalue()
    at %= len(raw)
    return io.BytesIO(raw[:at] + new + raw[at + len(new) :])


_TEXT = bytes(range(32, 127)) * 40
_DAMAGED = {
    "packed bytes": lambda: _with_bytes(_zip({"campaign.toml": _TEXT}), 60, b"\xff" * 20),
    "place of the list of members": lambda: _with_bytes(_zip({"campaign.toml": _TEXT}), -6, b"\xff\xff\xff\x7f"),
    "a member without a name": lambda: _zip({"": TOML}),
    "a name longer than any": lambda: _zip({"x" * 300: TOML}),
}


@pytest.mark.parametrize("damage", _DAMAGED)
def test_a_damaged_zip_is_refused(tmp_path: Path, damage: str) -> None:
    """zipfile leaks zlib.error, IndexError, ValueError, OSError: the page ended in an error of the server."""
    with pytest.raises(UploadError) as refused:
        unpacked([("spring.zip", _DAMAGED[damage]())], tmp_path, 10_000_000)
    assert len(str(refused.value).splitlines()) == 1
