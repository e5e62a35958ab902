"""Records a case: a campaign folder without a word of what it hides, and the label that tells it.

Labels under seal: their hashes are published before a diagnosis begins, their text is read after it
has ended.

The salt of the hashes is the key of the cipher, and is kept apart from both.
"""

from __future__ import annotations

import hashlib
import hmac
import json
import secrets
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from ...virtualbench.campaigns.gun import BULLET_LENGTH_M, BULLET_LENGTH_U_M
from ...virtualbench.recorder import (
    CampaignCard,
    SealError,
    Value,
    folder_hash,
    write_card,
    write_recording,
    write_runs,
)
from ...virtualbench.sensors import SensorBuild
from .attribution import attribution
from .case import GUN_KINDS, Case, Label, tier_of
from .designs import CaseSetting, design
from .effect_size import changes, gaps
from .gun_case import gun_stage, true_pressure_pa
from .gun_trace import RATE_HZ, SENSORS
from .plates import CHANNELS, CasePlate, plate_of
from .scale_cause import shown_by, whole_cause
from .simulate_case import SimulatedCase, simulate_case

_DATE = "2026-01-01"
_FORCE = SensorBuild("force", "force", "N", 1e7)
_ACCELERATIONS = tuple(SensorBuild(name, "acceleration", "m/s2", 1e7) for name in CHANNELS)


def record_case(case: Case, folder: Path, seed: int, *, name: str | None = None) -> Label:
    """Write the campaign folder of a case and return its label; the same arguments, the same bytes.

    Parameters:
        case: The case that is simulated.
        folder: The folder of the campaign, new or empty.
        seed: Seed of the recordings.
        name: The name of the campaign in campaign.toml; by default that of the folder.

    Raises:
        ValueError: For a folder that is not empty.
    """
    if folder.exists() and any(folder.iterdir()):
        raise ValueError(f"{folder}: there is something already; expected a new or empty folder")
    folder.mkdir(parents=True, exist_ok=True)
    write_runs(
        folder,
        [
            _row(case, number, run, folder)
            for number, run in enumerate(simulate_case(case, seed), 1)
        ],
    )
    if case.kind in ("plate", "chain"):
        (folder / "plate_modes.csv").write_text(
            _modal_table(plate_of(case.kind, case.design), case.decoys)
        )
    write_card(folder, _card(case, name or folder.name))
    return replace(label_of(case, seed), folder_sha256=folder_hash(folder))


def label_of(case: Case, seed: int) -> Label:
    """The label of a case but for the folder's hash: it can be published before the campaign is
    recorded.

    Parameters:
        case: The case, with its cause.
        seed: Seed of the recordings, which the label states.
    """
    moved = changes(case.kind, case.design, whole_cause(case))
    sizes = gaps(moved)
    stage = max(sizes, key=lambda name: sizes[name])
    ratio = sizes[stage] / case.floor
    names = list(case.strengths)
    alone = dict.fromkeys(names, ratio)
    if len(names) > 1:
        for name, strength in case.strengths.items():
            single = whole_cause(replace(case, strengths={name: strength}))
            alone[name] = max(gaps(changes(case.kind, case.design, single)).values()) / case.floor
    parts = attribution(case.kind, case.design, whole_cause(case))
    settings = design(case.kind, case.design)
    return Label(
        kind=case.kind,
        cause=case.cause,
        tier=tier_of(ratio),
        ratio=ratio,
        stage=stage if ratio > 0 else None,
        gap=sizes,
        floor=dict.fromkeys(sizes, case.floor),
        alone=alone,
        strengths=dict(case.strengths),
        family=case.unknown,
        background=asdict(case.background),
        decoys=dict(case.decoys),
        region={"insulator": "polymeric"} if names == ["contact.layer_compliance"] else {},
        configurations=tuple(factors_of(case, setting) for setting in settings),
        changes={name: rows.tolist() for name, rows in moved.items()},
        seed=seed,
        left_out=parts.left_out,
        shapley=parts.shapley,
        shown=shown_by(case.kind, case.design),
        laws=case.laws,
        traces=case.traces,
    )


def _row(case: Case, number: int, run: SimulatedCase, folder: Path) -> dict[str, str]:
    """A row of runs.csv; its recording is written."""
    factors = {key: str(value) for key, value in factors_of(case, run.setting).items()}
    row = {"run": str(number), "repetition": str(run.repetition), **factors}
    if case.traces:
        row["bullet_length_mm"] = f"{BULLET_LENGTH_M * 1e3:g}"
        row["bullet_length_u_mm"] = f"{BULLET_LENGTH_U_M * 1e3:g}"
    if run.velocity_m_s is not None:
        column = "measured_velocity_m_s" if run.setting.tank_pressure_bar else "impact_velocity_m_s"
        row[column] = f"{run.velocity_m_s:.6g}"
    if run.velocity_u_m_s is not None:
        row["measured_velocity_u_m_s"] = f"{run.velocity_u_m_s:.4g}"
    if run.channels:
        row["recording"] = f"recordings/{number:04d}.npz"
        channels = {name: values.astype(np.float32) for name, values in run.channels.items()}
        rate = RATE_HZ if case.kind == "gun" else case.sampling_rate_hz
        write_recording(folder / row["recording"], channels, rate)
    return row


def factors_of(case: Case, setting: CaseSetting) -> dict[str, Any]:
    """Factors as runs.csv has them. The pressure is what the transducer reads, or, beside its
    recordings, what the regulator is set to: the true one.

    Parameters:
        case: The case whose runs are written.
        setting: One configuration of its plan.
    """
    factors = setting.factors()
    if case.traces:
        true_bar = 1e-5 * true_pressure_pa(setting, case.strengths, case.laws)
        factors["tank_pressure_bar"] = float(f"{true_bar:.5g}")
    return factors


def _card(case: Case, name: str) -> CampaignCard:
    bench: dict[str, Mapping[str, Value]] = {}
    if case.kind in GUN_KINDS:
        bench["gun"] = _misstated(gun_stage(case.kind, case.design), case.decoys)
    if case.kind == "hammer":
        bench["hammer"] = _misstated(
            {"mass_kg": design(case.kind, case.design)[0].mass_kg}, case.decoys
        )
    sensors: tuple[SensorBuild, ...] = () if case.kind == "gun" else (_FORCE,)
    if case.kind in ("plate", "chain"):
        bench["plate"] = {"modes": "plate_modes.csv"}
        sensors = (_FORCE, *_ACCELERATIONS)
    if case.traces:
        sensors = (*SENSORS, *sensors)
    kind = "gun" if case.kind in GUN_KINDS else "hammer"
    return CampaignCard(name, kind, _DATE, sensors, "withheld-cause campaign", bench)


def _misstated(table: Mapping[str, Value], decoys: Mapping[str, float]) -> dict[str, Value]:
    return {k: v * decoys.get(k, 1.0) if isinstance(v, float) else v for k, v in table.items()}


def _modal_table(plate: CasePlate, decoys: Mapping[str, float]) -> str:
    from ...virtualbench.plate.modes import modal_table

    modes = plate.table
    return modal_table(replace(modes, damping=modes.damping * decoys.get("damping_ratio", 1.0)), 0)


KEY_BYTES = 32


def new_key() -> bytes:
    """A key, of the operating system's randomness."""
    return secrets.token_bytes(KEY_BYTES)


def publish(labels: Sequence[Label], key: bytes) -> tuple[str, ...]:
    """Salted SHA-256 of each label: nothing can be learnt from it, and nothing changed after it is
    known.

    Parameters:
        labels: The labels, in the order of the cases.
        key: The salt, which is also the key of the sealed labels.
    """
    return tuple(label.sha256(key) for label in labels)


def seal_labels(labels: Sequence[Label], path: Path, key: bytes) -> None:
    """Write labels that nobody reads without the key.

    Parameters:
        labels: The labels, in the order of the cases.
        path: The file that is written.
        key: The key that opens them, as `new_key` gives it.

    Raises:
        SealError: Where the file exists.
    """
    if path.exists():
        raise SealError(f"{path}: there are sealed labels already; expected a new name")
    text = json.dumps([label.as_json() for label in labels]).encode()
    nonce = hashlib.sha256(b"nonce" + key + text).digest()[:16]
    sealed = _crypt(text, key, nonce)
    table = {"nonce": nonce.hex(), "tag": _tag(sealed, key, nonce), "sealed": sealed.hex()}
    path.write_text(json.dumps(table), encoding="utf-8")


def open_labels(path: Path, key: bytes, published: Sequence[str] | None = None) -> list[Label]:
    """Read sealed labels, and compare them with what was published of them.

    Parameters:
        path: The file that `seal_labels` wrote.
        key: The key with which the labels were sealed.
        published: The hashes that `publish` gave of them; by default the labels are compared with
            none.

    Raises:
        SealError: For a file that has no sealed labels, a wrong key, a changed file, and labels
            other than those published.
    """
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
        nonce, sealed, tag = (
            bytes.fromhex(table["nonce"]),
            bytes.fromhex(table["sealed"]),
            str(table["tag"]),
        )
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise SealError(f"{path}: not sealed labels: {error}") from error
    if not hmac.compare_digest(tag, _tag(sealed, key, nonce)):
        raise SealError(f"{path}: the key does not fit, or the file was changed")
    labels = [Label.from_json(row) for row in json.loads(_crypt(sealed, key, nonce))]
    if published is not None and list(published) != list(publish(labels, key)):
        raise SealError(f"{path}: other labels than those whose hashes were published")
    return labels


def _crypt(text: bytes, key: bytes, nonce: bytes) -> bytes:
    """Exclusive or with SHAKE-256 of key and nonce: its own inverse."""
    stream = hashlib.shake_256(b"labels" + key + nonce).digest(len(text))
    return (int.from_bytes(text) ^ int.from_bytes(stream)).to_bytes(len(text))


def _tag(sealed: bytes, key: bytes, nonce: bytes) -> str:
    return hmac.new(b"tag" + key, nonce + sealed, "sha256").hexdigest()
