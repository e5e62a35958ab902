"""What the Python library reads on another machine beside the operations: frames of whole columns,
pulses, samples, snapshots, and what a twin and a model answer.

The answers are of the form of `web.result_answer`, which may change with every version; hence they
are no part of the described API, but for the samples of a channel.
"""

from __future__ import annotations

import io
import json
from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Depends, Query
from starlette.requests import Request
from starlette.responses import Response

from ....schema.person_roles import READER
from ...operations.faults import Fault, RequestError, read
from ...operations.laboratory import Laboratory
from ...web.dependencies import InLaboratory, Key, Name, OpenStore
from ...web.result_answer import result_answer
from ...web.role_needs import NeedsRole

router = APIRouter()
#: Routes of this library alone.
_own = APIRouter(include_in_schema=False)
#: These are POST for the size of what they are asked.
_READS = NeedsRole(READER, "an answer to the Python library")
#: 32 MB; a client reads a longer recording in several slices.
_MOST_SAMPLES = 4_000_000
#: Shots of one request: they are predicted while the client waits.
_MOST_SHOTS = 200


@_own.get("/library")
def library() -> Response:
    """That a server of pyroshock answers here, and of which version."""
    return result_answer(None)


@router.get(
    "/channels/{channel}/samples",
    tags=["impacts"],
    response_class=Response,
    responses={200: {"content": {"application/octet-stream": {}}}},
)
def samples(
    channel: Key,
    store: OpenStore,
    first: Annotated[int, Query(ge=0, le=2**40)] = 0,
    stop: Annotated[int | None, Query(ge=0, le=2**40)] = None,
) -> Response:
    """Samples of a channel in SI as a file of NumPy (.npy): 64-bit numbers from sample `first` to
    before `stop`, at most 4,000,000."""
    from ....ingest.storing.stored_channels import read_channel
    from ....schema.recordings import RecordedChannel

    with store.reading() as session:
        row = session.get(RecordedChannel, channel)
        if row is None:
            raise LookupError(f"no channel {channel} in the store; an impact's `signals` list them")
        last = row.samples if stop is None else min(stop, row.samples)
        if last - first > _MOST_SAMPLES:
            raise ValueError(
                f"{last - first:,} samples from {first}; expected at most {_MOST_SAMPLES:,}: "
                "give first and stop"
            )
        values = np.asarray(read_channel(session, row, min(first, last), last).si, np.float64)
    file = io.BytesIO()
    np.lib.format.write_array(file, values, allow_pickle=False)
    return Response(file.getvalue(), media_type="application/octet-stream")


@_own.get("/library/campaigns")
def campaigns(laboratory: InLaboratory, tag: str | None = None) -> Response:
    """All campaigns, or those with a tag, without pages."""
    from ...operations.ingest.campaigns import CAMPAIGN_LIST, CampaignSelection

    selection = read(CampaignSelection, {"tag": tag}, "network")
    answer = CAMPAIGN_LIST.answer(selection, laboratory, _no_progress)
    return result_answer(answer)


@_own.get("/library/impacts")
def impacts(
    store: OpenStore,
    campaign: str | None = None,
    where: Annotated[tuple[str, ...], Query()] = (),
    limit: Annotated[int | None, Query(ge=1)] = None,
    named: Annotated[tuple[str, ...], Query()] = (),
) -> Response:
    """All impacts that meet the conditions, as columns."""
    from ...operations.impacts.listing import SelectedRows
    from ...operations.impacts.service import read_impacts

    selection = read(SelectedRows, {"campaign": campaign, "where": list(where)}, "network")
    return result_answer(read_impacts(store, selection, limit, named))


@_own.get("/library/shots")
def shots(
    laboratory: InLaboratory,
    campaign: str | None = None,
    where: Annotated[tuple[str, ...], Query()] = (),
) -> Response:
    """All shots that meet the conditions."""
    from ...operations.impacts.listing import SHOT_LIST, SelectedRows

    values = {"campaign": campaign, "where": list(where)}
    return result_answer(
        SHOT_LIST.answer(read(SelectedRows, values, "python"), laboratory, _no_progress)
    )


@_own.get("/library/pulses/{impact}")
def pulse(impact: Key, store: OpenStore) -> Response:
    """The pulse in use of an impact."""
    from ...operations.impacts.service import read_pulse

    with store.reading() as session:
        return result_answer(read_pulse(session, impact))


@_own.get("/library/recordings/{impact}")
def recording(impact: Key, store: OpenStore) -> Response:
    """The channels of the recording of an impact, without their samples."""
    from ...operations.impacts.service import read_channel_facts

    path, channels = read_channel_facts(store, impact)
    return result_answer({"path": path, "channels": channels})


@_own.get("/library/plans")
def plans(store: OpenStore) -> Response:
    """All plans with their counts."""
    from ....doe.plans import list_plans

    with store.reading() as session:
        return result_answer(list_plans(session))


@_own.get("/library/plans/{plan}")
def plan(plan: Name, store: OpenStore) -> Response:
    """A plan with its runs."""
    from ....doe.plans import read_plan

    with store.reading() as session:
        return result_answer(read_plan(session, plan))


@_own.get("/library/datasets/{dataset}")
def dataset(dataset: Name, store: OpenStore) -> Response:
    """A frozen dataset with all its pulses."""
    from ....dataset.snapshot import read_snapshot

    return result_answer(read_snapshot(store, dataset))


@_own.get("/library/diagnoses")
def diagnoses(store: OpenStore, campaign: str | None = None) -> Response:
    """All diagnoses, without pages."""
    from ...operations.diagnose.stored import list_diagnoses

    with store.reading() as session:
        return result_answer(list_diagnoses(session, campaign, limit=None))


@_own.get("/library/jobs/{job}")
def job(job: Key, store: OpenStore) -> Response:
    """What has come of a job: its whole result, as it was kept, or the kind of its error."""
    from ...jobs.queue import ended_with

    ended = ended_with(store, job)
    return result_answer({**vars(ended), "whole": json.dumps(ended.whole)})


# --- models and the twin, which stay on the server


async def _sent(http: Request) -> dict[str, Any]:
    try:
        values = json.loads(await http.body() or b"{}")
    except (ValueError, RecursionError) as error:
        raise RequestError([Fault("", f"the body is no JSON: {error}")]) from error
    if not isinstance(values, dict):
        raise RequestError([Fault("", f"the body is {type(values).__name__}; expected an object")])
    return values


Sent = Annotated[dict[str, Any], Depends(_sent)]


@_own.get("/library/models/{model}")
def model(model: Name, laboratory: InLaboratory, split: str | None = None) -> Response:
    """A version with the columns that it predicts from."""
    registered = _registered(laboratory, model, split)
    return result_answer(
        {
            "version": registered.version,
            "predictors": registered.predictors,
            "shots": registered.shots,
        }
    )


@_own.post("/library/models/{model}/pulses", dependencies=[Depends(_READS)])
def pulses(model: Name, sent: Sent, laboratory: InLaboratory) -> Response:
    """The pulses that a version predicts of impacts: `x` (n, predictors) and the bench's `mass` and
    `thickness` (n,), SI."""
    from ....dataset.table import Inputs

    registered = _registered(laboratory, model, None)
    try:
        rows = np.asarray(sent["x"], dtype=np.float64)
        bench = [np.asarray(sent[name], dtype=np.float64) for name in ("mass", "thickness")]
        is_table = rows.shape == (len(rows), len(registered.predictors))
    except (KeyError, TypeError, ValueError) as error:
        raise RequestError([Fault("", f"the body is no table of impacts: {error!r}")]) from error
    if not is_table or any(column.shape != (len(rows),) for column in bench):
        raise RequestError([Fault("x", f"x has the shape {rows.shape}; expected a row an impact")])
    return result_answer(registered.predict(Inputs(registered.predictors, rows, *bench)))


def _registered(laboratory: Laboratory, name: str, split: str | None) -> Any:
    from ...operations.train.contact_model import registered_model

    return registered_model(laboratory.db, name, split)


@_own.post("/library/twin", dependencies=[Depends(_READS)])
def twin(sent: Sent, laboratory: InLaboratory) -> Response:
    """What a twin of these options tells of itself."""
    from ...operations.predict.described_twin import describe
    from ...operations.predict.request import TwinOptions

    options = read(TwinOptions, sent, "network")
    with options.twin_request() as request:
        return result_answer(describe(laboratory.twin(request)))


@_own.post("/library/predictions", dependencies=[Depends(_READS)])
def predictions(sent: Sent, laboratory: InLaboratory) -> Response:
    """The figures of many shots of one twin, in their order, and what was assumed."""
    from ...operations.predict.batch import bench_of_rows, predict_batch
    from ...operations.predict.request import BandDraws, TwinOptions

    names = ("twin", "draws", "rows")
    if sent.keys() != set(names) or not all(isinstance(sent[name], dict | list) for name in names):
        raise RequestError([Fault("", f"the body has {', '.join(sent)}; expected {names}")])
    options = read(TwinOptions, sent["twin"], "network")
    draws = read(BandDraws, sent["draws"], "network")
    rows = [_shot_row(row) for row in sent["rows"]]
    if not 0 < len(rows) <= _MOST_SHOTS:
        raise RequestError(
            [Fault("rows", f"rows has {len(rows)} shots; expected 1 to {_MOST_SHOTS}")]
        )
    with options.twin_request() as request:
        bench, rows, notes = bench_of_rows(
            laboratory.store, laboratory.twin, request, rows, draws.draws, draws.seed
        )
    predicted = predict_batch(bench, rows, laboratory.executor, _no_progress)
    return result_answer({"figures": [shot.figures for shot in predicted], "notes": notes})


def _shot_row(row: Any) -> Any:
    from ...operations.predict.batch import ShotRow
    from ...operations.predict.request import ShotRequest

    try:
        shot = read(ShotRequest, row["shot"], "network")
        plate, height = row["plate"], float(row["chain_height_m"])
        return ShotRow(dict(row["labels"]), shot, None if plate is None else str(plate), height)
    except (KeyError, TypeError) as error:
        raise RequestError([Fault("rows", f"rows has {row!r:.200}; expected a shot")]) from error


def _no_progress(_done: int, _total: int, _what: str) -> None:
    pass


router.include_router(_own)
