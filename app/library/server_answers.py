"""Requests of the Python library as a server takes them: an operation goes to its own route, with
the fields that were given, and comes back as its result."""

from __future__ import annotations

import base64
import contextlib
import tempfile
import uuid
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..common.errors import InvalidValueError, StorageError
from ..doors.job_handle import JobHandle
from ..operations.faults import Fault, argument_of, spelled_as
from ..operations.fields import RecordedFile, TextFile, presentation_of
from ..operations.form import texts_of
from ..operations.machine_paths import CARD, MachinePath
from ..operations.operation import Answer, Operation, Request, Result
from .server_connection import ServerConnection, part

if TYPE_CHECKING:
    from ...parallel.executor import ExecutorConfig
    from ..jobs.queue import EndedJob, JobView

#: Operation -> the route that takes the files of this machine, and the field that names them.
_UPLOADS = {"ingest": ("/api/ingest/upload", "path")}
#: What a campaign folder holds beside what is read: not sent.
_HIDDEN = "."


class ServerAnswers:
    """A server as the place where operations are answered, and long ones are jobs."""

    def __init__(self, connection: ServerConnection) -> None:
        self.connection = connection

    def answer(
        self,
        operation: Operation[Any, Answer],
        request: Request,
        progress: bool = True,
        *,
        executor: ExecutorConfig | None = None,  # noqa: ARG002  how many at once the server decides
        processes: int | None = None,  # noqa: ARG002  and so does it here
    ) -> Answer:
        """The answer, once the server has it."""
        if operation.long:
            return self.ask(operation, request).result(progress=progress)
        verb, path = _route(operation, self.connection)
        path = _filled(path, request)
        with argument_words(request):
            answer = (
                self.connection.read(path, query_of(request, path_fields(operation)))
                if verb == "GET"
                else self.connection.ask(path, body_of(request, path_fields(operation)))
            )
        result: Answer = _checked(answer, self.connection)
        return result

    def ask(self, operation: Operation[Any, Answer], request: Request) -> JobHandle[Answer]:
        """The job that the server has made of long work."""
        _, path = _route(operation, self.connection)
        path = _filled(path, request)
        upload = _UPLOADS.get(operation.name)
        with argument_words(request):
            if upload is not None and _is_here(folder := getattr(request, upload[1]).path):
                body, kind = _upload_of(folder, request, upload[1])
                job = self.connection.write_json(upload[0], body, kind)
            else:
                body_fields = body_of(request, path_fields(operation))
                job = self.connection.write_json(path, body_fields)
        if not isinstance(job, dict) or not isinstance(job.get("id"), int):
            raise StorageError(f"{self.connection.address}{path} has made no job of the request")
        return JobHandle(self, job["id"], operation.title(request), operation.steps)

    # --- the jobs of the server

    def job(self, number: int) -> JobView:
        """A job as its row says."""
        from ..jobs.job_operations import StoredJob

        stored = self.connection.read(f"/api/jobs/{number:d}")
        if not isinstance(stored, StoredJob):
            raise StorageError(f"{self.connection.address} has told no job")
        return stored.job

    def ended(self, number: int) -> EndedJob:
        """What has come of a job."""
        import json

        from ..jobs.queue import EndedJob

        ended = self.connection.read(f"/api/library/jobs/{number:d}")
        try:
            return EndedJob(**{**ended, "whole": json.loads(ended["whole"])})
        except (TypeError, KeyError, ValueError) as error:
            raise StorageError(f"{self.connection.address} has told no job: {error}") from error

    def stop(self, number: int) -> None:
        """Ask a job to end."""
        self.connection.write_json(f"/api/jobs/{number:d}/stop", {})

    def decoded(self, whole: Any) -> Any:
        """The result that a job has kept."""
        return self.connection.decoded(whole)


@contextlib.contextmanager
def argument_words(request: Request) -> Iterator[None]:
    """What a server refuses of a request is said with the names of the arguments."""
    try:
        yield
    except InvalidValueError as error:
        faults = getattr(error, "faults", ())
        if not faults:
            raise
        words = [
            spelled_as(Fault(field, message), type(request), argument_of)
            for field, message in faults
        ]
        raise InvalidValueError("\n  ".join(words)) from error


def _route(operation: Operation[Any, Any], connection: ServerConnection) -> tuple[str, str]:
    """Method and path of an operation. Raises `InvalidValueError` for one that no server offers."""
    if reason := operation.absent.get("json"):
        words = " ".join(operation.words)
        raise InvalidValueError(f"{connection.address} does not offer `{words}`: {reason}")
    verb, path = operation.route or ("POST", f"/{operation.name}")
    return ("POST" if operation.also_posted else verb), f"/api{path}"


def path_fields(operation: Operation[Any, Any]) -> tuple[str, ...]:
    """Fields of the request that stand in the path of its route."""
    path = "" if operation.route is None else operation.route[1]
    names = {name for request in operation.requests() for name in request.model_fields}
    return tuple(name for name in names if f"{{{name}}}" in path)


def _filled(path: str, request: Request) -> str:
    for name in type(request).model_fields:
        if f"{{{name}}}" in path:
            path = path.replace(f"{{{name}}}", part(getattr(request, name)))
    return path


def given_fields(request: Request) -> Iterator[tuple[str, Any]]:
    """The fields that were given, and the method of a design; the others have the server's
    defaults."""
    for name in type(request).model_fields:
        value = getattr(request, name)
        if (name in request.model_fields_set and value is not None) or name == "method":
            yield name, value


def body_of(request: Request, without: tuple[str, ...] = ()) -> dict[str, Any]:
    """The fields of a request as JSON."""
    return {
        name: _plain(request, name, v) for name, v in given_fields(request) if name not in without
    }


def _plain(request: Request, name: str, value: Any) -> Any:
    if isinstance(value, TextFile):
        return value.text
    if isinstance(value, RecordedFile):
        return {"name": value.name, "content": base64.b64encode(value.read_bytes()).decode()}
    if isinstance(value, MachinePath):
        return str(value.path)
    return request.model_dump(mode="json", include={name})[name]


def query_of(request: Request, without: tuple[str, ...] = ()) -> dict[str, str | list[str]]:
    """The fields of a request as texts of an address."""
    texts = texts_of(request, everything=True)
    query: dict[str, str | list[str]] = {}
    for name, value in given_fields(request):
        if name in without:
            continue
        unit = presentation_of(type(request).model_fields[name]).unit
        if unit and isinstance(value, float):
            query[name] = f"{value!r} {unit}"
        elif isinstance(value, tuple) and all(isinstance(item, str | int) for item in value):
            # The empty text is left out there; with it a list of one text stays a list, whatever
            # commas the text has.
            query[name] = [*map(str, value), ""]
        else:
            query[name] = texts[name]
    return query


def _checked(answer: Any, connection: ServerConnection) -> Any:
    if not isinstance(answer, Result):
        raise StorageError(
            f"{connection.address} has answered with {type(answer).__name__}, which is no result"
        )
    return answer


# --- a campaign folder of this machine


def _is_here(folder: Path) -> bool:
    return (folder / CARD).is_file()


def _upload_of(folder: Path, request: Request, field: str) -> tuple[bytes, str]:
    """A form with the folder as a ZIP, and its media type."""
    mark = f"pyroshock-{uuid.uuid4().hex}"
    fields = texts_of(request)
    with tempfile.TemporaryFile() as packed:
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
            for file in sorted(folder.rglob("*")):
                inner = file.relative_to(folder)
                if file.is_file() and not any(name.startswith(_HIDDEN) for name in inner.parts):
                    archive.write(file, inner.as_posix())
        packed.seek(0)
        content = packed.read()
    parts: list[bytes] = []
    for name, text in fields.items():
        if name != field:
            parts.append(_form_part(mark, f'name="{name}"', text.encode()))
    parts.append(_form_part(mark, 'name="files"; filename="campaign.zip"', content))
    return b"".join([*parts, f"--{mark}--\r\n".encode()]), f"multipart/form-data; boundary={mark}"


def _form_part(mark: str, names: str, content: bytes) -> bytes:
    head = f"--{mark}\r\ncontent-disposition: form-data; {names}\r\n\r\n"
    return head.encode() + content + b"\r\n"


def text_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """A query without what is None or empty."""
    return {name: value for name, value in values.items() if value is not None and value != ()}
