"""TOML of others: what is too large, too wide or too deep is refused before it costs anything,
wherever it is read."""

from __future__ import annotations

import ast
import io
import json
import time
import tracemalloc
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
from pyroshock.app.twins.benches import bench_of_file, shipped_bench
from pyroshock.dataset.predictors import predictors_named
from pyroshock.doe.space import read_space
from pyroshock.files.toml_text import DEEPEST, LARGEST_BYTES, MOST_KEYS, read_toml_text, toml_table
from pyroshock.ingest.errors import IngestError
from pyroshock.ingest.folder.campaign_file import read_campaign_file
from support.processes.web_client import ended, post_json, token, window
from support.stores.stores import pyroshock

ROOT = Path(__file__).resolve().parents[2]
#: The 32 kB that took 3 s and 1.0 GB.
DEEP = "a" + ".a" * 16_000 + " = 1\n"
SAID = r"16,001 parts joined by dots; expected at most 16"


def test_what_is_within_the_limits_is_read() -> None:
    letters = "abcdefghijklm"  # with the whole, the value and the two lists around it: 16
    written = (
        f""""x y".'z' = "1.2.3"\n[{".".join(letters)}]\nb = [[0.5, 1.5]]\n# {"=" * 20_000}\n"""
    )
    found = toml_table(written)
    assert found["x y"] == {"z": "1.2.3"}
    for part in letters:
        found = found[part]
    assert found == {"b": [[0.5, 1.5]]}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (DEEP, rf"the key 'a\.a\..*…' has {SAID}"),
        ("[" + ".".join("a" * 17) + "]\n", "17 parts joined by dots; expected at most 16"),
        (
            "x = {'a'" + r' . "a\".b"' * 16 + " = 1}\n",
            "17 parts joined by dots; expected at most 16",
        ),
        # a text that ends in a quote must not hide what follows it
        ('a = """x""""\n"b"' + ".c" * 16 + " = 1\n", "17 parts"),
        (
            "[" + ".".join("a" * 9) + "]\n" + ".".join("b" * 9) + " = 1\n",
            "18 deep; expected at most 16",
        ),
        ("a = " + "[" * 30 + "]" * 30 + "\n", "31 deep; expected at most 16"),
        ("a = " + "[" * 5_000 + "]" * 5_000 + "\n", "deep; expected at most 16"),
        (
            "".join(f"k{i} = 1\n" for i in range(MOST_KEYS + 1)),
            "10,001 keys and tables; expected at most 10,000",
        ),
        ("[[a]]\n" * (MOST_KEYS + 1), "10,001 keys and tables; expected at most 10,000"),
        ("# " + "é" * LARGEST_BYTES, "524,290 bytes; expected TOML of at most 262,144 bytes"),
        ("a = " + "1" * 5_000, "not TOML"),
    ],
)
def test_what_is_beyond_a_limit_is_told_with_it(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        toml_table(text)


#: As long as a text may be, each made for what a search or a parser might do again and again.
LONG = {
    "word": "a" * 250_000,
    "escapes": '"' + '\\"' * 125_000,
    "quotes": "'" * 250_000,
    "blanks": ("a" + " " * 20_000 + ".") * 12,
    "long parts": ("a" * 15_000 + ".") * 16,
    "almost deep": ("a." * (DEEPEST - 1) + "a ") * 7_500,
    "almost deep keys": "\n".join(f"a{i}." + ".".join("a" * 14) + "=1" for i in range(6_500)),
    "almost deep tables": "\n".join(
        "[" + ".".join("a" * 8) + f".b{i}]\nb.b.b.b.b = 1" for i in range(4_900)
    ),
    "lists": "a = [" + "[]," * 80_000 + "]",
}


@pytest.mark.parametrize("name", LONG)
def test_nothing_within_the_limits_takes_long_or_much(name: str) -> None:
    """A second and 100 MB on a machine at rest; here it may be busy, and is traced."""
    assert len(LONG[name].encode()) <= LARGEST_BYTES
    tracemalloc.start()
    begun = time.process_time()
    try:
        with suppress(ValueError):
            toml_table(LONG[name])
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert time.process_time() - begun < 10
    assert peak < 100e6


def test_a_mark_of_byte_order_is_no_part_of_the_text_and_no_more_is_read_of_a_larger_file(
    tmp_path: Path,
) -> None:
    (tmp_path / "a.toml").write_bytes(b"\xef\xbb\xbfa = 1\n")
    assert toml_table(read_toml_text(tmp_path / "a.toml")) == {"a": 1}
    with (tmp_path / "large.toml").open("wb") as file:
        file.truncate(50 * 2**30)  # takes no room on the disk
    with pytest.raises(
        ValueError, match="53,687,091,200 bytes; expected TOML of at most 262,144 bytes"
    ):
        read_toml_text(tmp_path / "large.toml")


READERS: dict[str, Callable[[Path], object]] = {
    "campaign.toml": lambda path: read_campaign_file(path.parent),
    "factors.toml": read_space,
    "predictors.toml": lambda path: predictors_named(str(path)),
    "bench.toml": lambda path: bench_of_file(path, shipped_bench()),
}


@pytest.mark.parametrize("name", READERS)
def test_every_file_is_refused_with_its_name(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text(DEEP, encoding="utf-8")
    with pytest.raises((ValueError, IngestError), match=rf"{name}: the key .* {SAID}"):
        READERS[name](tmp_path / name)


def test_the_command_names_the_file_of_factors(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(DEEP, encoding="utf-8")
    words = ["plan", "lhs", "x", "--runs", "4", "--factors", tmp_path / "mine.toml"]
    result = pyroshock(*words, "--db", f"sqlite:///{tmp_path / 'lab.db'}")
    assert result.exit_code == 2
    assert "mine.toml: the key 'a.a." in result.stderr
    assert "16,001 parts" in result.stderr


def test_the_window_refuses_what_is_typed_and_what_is_uploaded(tmp_path: Path) -> None:
    with window(f"sqlite:///{tmp_path / 'lab.db'}") as (client, _):
        target = "frequency_hz,level_g\n100,10\n1000,100\n"
        for address, more in (("plans", {"name": "x"}), ("tune", {"target": target})):
            typed = post_json(client, f"/api/{address}", {**more, "factors": DEEP})
            assert typed.status_code == 422
            assert "factors: the key 'a.a." in typed.text and "16,001 parts" in typed.text
        files = [
            ("files", ("c/campaign.toml", io.BytesIO(DEEP.encode()))),
            ("files", ("c/runs.csv", b"run\n1\n")),
        ]
        sent = client.post(
            "/api/ingest/upload", files=files, headers={"X-CSRF-Token": token(client)}
        )
        job = json.dumps(ended(client, sent), ensure_ascii=False)
    assert "campaign.toml: the key 'a.a." in job
    assert "16,001 parts" in job


def test_toml_is_parsed_in_one_place() -> None:
    files = [file for room in ROOT.glob("*/__init__.py") for file in room.parent.rglob("*.py")]
    texts = {file: file.read_text(encoding="utf-8") for file in files}
    imported = {
        str(file.relative_to(ROOT))
        for file, text in texts.items()
        if "toml" in text
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Import)
        and any(alias.name in ("tomllib", "tomli", "toml") for alias in node.names)
    }
    assert imported == {"files/toml_text.py"}
