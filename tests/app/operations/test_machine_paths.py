"""Folders and files of this machine as fields: what the network may name, and stored jobs of
earlier versions."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from pyroshock.app.jobs.known_kinds import KINDS
from pyroshock.app.jobs.operation_kind import discard_uploads
from pyroshock.app.operations.faults import RequestError, read
from pyroshock.app.operations.ingest.campaigns import CampaignArchiving, CampaignReturn
from pyroshock.app.operations.ingest.request import FolderIngest
from pyroshock.app.operations.laboratory import Laboratory
from pyroshock.app.operations.machine_paths import MachinePath
from pyroshock.app.operations.operation import NotHereError, Request
from pyroshock.app.operations.store.integrity import StoreCheck
from pyroshock.app.operations.upload_folders import make_scratch, stored_scratch
from pyroshock.ingest.extraction.settings import ExtractionSettings
from pyroshock.schema.session import Store


@pytest.fixture
def campaign(tmp_path: Path) -> Path:
    folder = tmp_path / "data" / "spring"
    folder.mkdir(parents=True)
    (folder / "campaign.toml").write_text("[campaign]\n", encoding="utf-8")
    return folder


@pytest.mark.parametrize(("request_class", "values", "field"), [
    (FolderIngest, {"path": "/etc"}, "path"),
    (FolderIngest, {"path": "../.."}, "path"),
    (FolderIngest, {"path": {"path": "/etc"}}, "path"),
    (FolderIngest, {"path": {"path": "/etc", "scratch": "/tmp/pyroshock-upload-1"}}, "path"),
    (FolderIngest, {"folder": "/etc"}, "path"),
    (CampaignReturn, {"file": "/etc/passwd"}, "file"),
    (CampaignReturn, {"file": {"path": "/etc/passwd"}}, "file"),
    (CampaignArchiving, {"campaign": "a", "reason": "b", "out": "/etc/passwd"}, "out"),
])  # fmt: skip
def test_the_network_names_no_file_beyond_the_folders(
    campaign: Path, request_class: type[Request], values: dict[str, Any], field: str
) -> None:
    with pytest.raises(RequestError) as refused:
        read(request_class, values, "network", (campaign.parent,))
    assert field in {fault.field for fault in refused.value.faults}


def test_the_network_names_a_campaign_below_the_folders_and_others_any_path(
    campaign: Path,
) -> None:
    for values in ({"path": "spring"}, {"path": str(campaign)}):
        asked = read(FolderIngest, values, "network", (campaign.parent,))
        assert asked.path == MachinePath(path=campaign)
    assert read(FolderIngest, {"folder": campaign}, "python").path.path == campaign
    assert read(FolderIngest, {"path": "spring"}, "command").path.path == Path("spring")


@pytest.mark.parametrize("source", ["network", "python", "command"])
@pytest.mark.parametrize(("path", "length", "limit"), [
    ("a" * 256, "256 bytes", "255"),
    ("spring/" + "\u00fc" * 128, "256 bytes", "255"),
    ("ab/" * 1400, "4200 characters", "4000"),
])  # fmt: skip
def test_too_long_a_path_is_refused_with_its_field_and_limit(
    campaign: Path, source: str, path: str, length: str, limit: str
) -> None:
    for request_class, field in ((FolderIngest, "path"), (StoreCheck, "repair")):
        with pytest.raises(RequestError) as refused:
            read(request_class, {field: path}, source, (campaign.parent,))
        (fault,) = refused.value.faults
        assert fault.field == field and f"{field}: " in fault.message
        assert length in fault.message and f"at most {limit}" in fault.message


def test_the_longest_name_of_a_folder_is_taken(campaign: Path) -> None:
    folder = campaign.rename(campaign.with_name("a" * 255))
    asked = read(FolderIngest, {"path": folder.name}, "network", (folder.parent,))
    assert asked.path == MachinePath(path=folder)


def test_jobs_of_earlier_versions_are_read() -> None:
    settings = ExtractionSettings(threshold=0.02, segmentation="mask").as_json()
    older = {"folder": "/lab/spring", "settings": settings, "plan": None, "scratch": None}
    for kind in ("ingest", "check"):
        request = KINDS[kind].read(older)
        assert request.settings() == ExtractionSettings(threshold=0.02, segmentation="mask")
        assert request.path == MachinePath(path=Path("/lab/spring"))
        upload = {**older, "folder": "/tmp/u/spring", "scratch": "/tmp/u"}
        assert KINDS[kind].read(upload).path.scratch == Path("/tmp/u")
    extraction = KINDS["extract"].read({"campaign": "spring", "settings": settings})
    assert (extraction.campaign, extraction.threshold) == ("spring", 0.02)
    restored = KINDS["restore"].read({"file": "/lab/a.pyroshock", "scratch": None})
    assert restored.file == MachinePath(path=Path("/lab/a.pyroshock"))
    assert KINDS["archive"].read({"campaign": "spring", "reason": "done"}).reason == "done"


def test_an_upload_is_read_from_its_own_folder_alone_and_goes_with_its_job(
    store: Store, campaign: Path
) -> None:
    scratch = make_scratch()
    (scratch / "spring").mkdir()
    served = Laboratory(store, "sqlite://", folders=())
    upload = MachinePath(path=scratch / "spring", scratch=scratch)
    assert upload.readable(served) == (scratch / "spring").resolve()
    for path in (
        MachinePath(path=campaign, scratch=scratch),
        MachinePath(path=campaign, scratch=campaign.parent),
        MachinePath(path=campaign),
    ):
        with pytest.raises(NotHereError, match="may not read"):
            path.readable(served)
    request = read(FolderIngest, {"path": upload}, "network")
    assert stored_scratch(KINDS["ingest"].plain(request)) == scratch
    discard_uploads(request)
    discard_uploads(
        read(FolderIngest, {"path": MachinePath(path=campaign, scratch=campaign)}, "network")
    )
    assert not scratch.exists() and campaign.is_dir()


@pytest.fixture
def store(sqlite_url: str):
    from support.stores.stores import opened

    with opened(sqlite_url, create=True) as store:
        yield store
