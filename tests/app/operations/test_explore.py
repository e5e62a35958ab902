"""`explore`: the rows of a filter are those of `query`, a selection has exactly the rows within it,
and what is asked is read as it was written."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from pyroshock.app.operations.explore.explore import EXPLORE
from pyroshock.app.operations.explore.request import Exploration, ends_of, stretch_text
from pyroshock.app.operations.explore.result import Explored
from pyroshock.app.operations.explore.rows import list_quantities
from pyroshock.app.operations.explore.selection import conditions_of_selection
from pyroshock.app.operations.faults import RequestError, read
from pyroshock.app.operations.form import text_of, texts_of
from pyroshock.app.operations.laboratory import Laboratory
from pyroshock.app.operations.sentence import UnfoundedSentenceError
from pyroshock.app.operations.store.question import QUERY, StoreQuestion
from pyroshock.schema.session import Store
from support.stores.stores import opened, run_pyroshock
from support.stores.web_stores import GUN, HAMMER, IMPACTS, SHOTS, filled_lab

__all__ = ["filled_lab"]

FINITE = st.floats(allow_nan=False, allow_infinity=False)


@pytest.fixture(scope="module")
def laboratory(filled_lab) -> Iterator[Laboratory]:
    url = f"sqlite:///{filled_lab / 'lab.db'}"
    with pytest.MonkeyPatch.context() as patch, opened(url) as store:
        patch.delenv("MLFLOW_TRACKING_URI", raising=False)
        yield Laboratory(store, url)


def explored(laboratory: Laboratory, **fields: Any) -> Explored:
    request = read(Exploration, fields, "python")
    return EXPLORE.answer(request, laboratory, lambda *_: None)


def asked(store: Store, laboratory: Laboratory, statement: str) -> list[dict[str, Any]]:
    return QUERY.answer(StoreQuestion(statement=statement), laboratory, lambda *_: None).rows


# --- rows and filters


@pytest.mark.parametrize(
    ("where", "sql"),
    [
        ((), "true"),
        (("peak_force_n>500",), "p.peak_force_n > 500"),
        (("peak_force_n<=0.5kN", "contact_time>0.1ms"),
         "p.peak_force_n <= 500 and p.contact_time_s > 0.0001"),
        (("campaign=spring",), "c.name = 'spring'"),
        (("campaign!=spring",), "c.name <> 'spring'"),
        (("run<3", "repetition=2"), "i.run < 3 and i.repetition = 2"),
        (("tip_material=steel",),
         "i.configuration_id in (select cl.configuration_id from configuration_levels cl "
         "join factor_levels l on l.id = cl.level_id join factors f on f.id = l.factor_id "
         "where f.name = 'tip_material' and l.label = 'steel')"),
    ],
)  # fmt: skip
def test_a_filter_gives_the_rows_that_query_gives(laboratory, where, sql):
    answer = explored(laboratory, where=where, x="contact_time_s", y="peak_force_n")
    rows = asked(
        laboratory.store,
        laboratory,
        "select i.id, p.contact_time_s, p.peak_force_n from impacts i join campaigns c on "
        f"c.id = i.campaign_id left join pulses p on p.impact_id = i.id and p.current where {sql} "
        "order by i.id",
    )
    assert list(answer.rows.keys) == [row["id"] for row in rows]
    for name in ("contact_time_s", "peak_force_n"):
        assert list(answer.rows.columns[name].values) == [row[name] for row in rows]
    missing = sum(row["peak_force_n"] is None for row in rows)
    assert (answer.facts["rows"], answer.facts["without_value"]) == (len(rows), missing)


def test_figures_factors_and_words_are_those_of_the_list_of_impacts(laboratory):
    listed = json.loads(run_pyroshock("impacts", "--json", "--db", laboratory.db).stdout)
    names = ["campaign", "quality", "velocity_kind", "tip_material", "tip_radius_m", "run"]
    names += ["impact_velocity_m_s", "peak_acceleration_m_s2", "impulse_n_s"]
    keys = {choice.key for choice in list_quantities(laboratory, "impacts")}
    assert len(listed) == IMPACTS and set(names) <= keys
    for name in names:
        answer = explored(laboratory, kind="levels", x=name, y="repetition")
        column = answer.rows.columns[name]
        assert list(column.values) == [row.get(name) for row in listed], name


def test_shots_have_the_velocity_of_the_nominal_model(laboratory):
    listed = json.loads(run_pyroshock("shots", "--json", "--db", laboratory.db).stdout)
    answer = explored(laboratory, subject="shots", y="predicted_velocity_m_s", campaign=GUN)
    assert answer.rows.count == SHOTS
    expected = [row["predicted_velocity_m_s"] for row in listed]
    assert list(answer.rows.columns["predicted_velocity_m_s"].values) == expected
    assert answer.rows.label(0) == "shot 1"


def test_channels_have_a_row_for_each_impact_that_one_recorded(laboratory):
    answer = explored(laboratory, subject="channels", y="share_of_full_scale")
    rows = asked(
        laboratory.store,
        laboratory,
        "select f.impact_id, h.name, f.peak_acceleration_m_s2, h.full_scale, h.unit from "
        "channel_figures f join channels h on h.id = f.channel_id order by f.impact_id, h.name",
    )
    assert [*zip(answer.rows.keys, answer.rows.channels, strict=True)] == [
        (row["impact_id"], row["name"]) for row in rows
    ]
    shares = [
        None
        if row["full_scale"] is None
        else row["peak_acceleration_m_s2"]
        / (row["full_scale"] * {"g": 9.80665, "m/s2": 1.0}[row["unit"]])
        for row in rows
    ]
    assert rows and list(answer.rows.columns["share_of_full_scale"].values) == pytest.approx(shares)


def test_models_have_their_errors_by_version_and_conditions_on_them(laboratory):
    listed = json.loads(run_pyroshock("models", "--all", "--json", "--db", laboratory.db).stdout)
    answer = explored(laboratory, subject="models", kind="levels", where=("force_nrmse<0.5",))
    errors = {
        f"{row['model']}@{row['version']}": row["metrics"]["force_nrmse"]
        for row in listed
        if row["metrics"]["force_nrmse"] < 0.5
    }
    stated = dict(zip(answer.rows.keys, answer.rows.columns["force_nrmse"].values, strict=True))
    assert stated == pytest.approx(errors) and answer.rows.address(0).startswith("/models/")


# --- kinds


def test_a_control_chart_follows_the_order_of_recording(laboratory):
    answer = explored(laboratory, kind="control", y="peak_force_n", campaign=HAMMER)
    rows = asked(
        laboratory.store,
        laboratory,
        "select i.id, p.peak_force_n from impacts i join campaigns c on c.id = i.campaign_id join "
        f"pulses p on p.impact_id = i.id and p.current where c.name = '{HAMMER}' "
        "order by i.run, i.repetition",
    )
    chart = answer.data.control
    values = np.array([row["peak_force_n"] for row in rows])
    np.testing.assert_array_equal(chart.values, values)
    assert [answer.rows.keys[row] for row in answer.data.rows] == [row["id"] for row in rows]
    assert answer.limits["upper_limit_n"] == pytest.approx(
        values.mean() + 2.66 * np.abs(np.diff(values)).mean()
    )
    assert any("configurations" in line.text for line in answer.sentences()) == (
        answer.data.configurations > 1
    )


def test_levels_summarise_the_values_of_each(laboratory):
    answer = explored(laboratory, kind="levels", x="tip_material", y="peak_force_n")
    values = answer.rows.columns["peak_force_n"].values
    levels = answer.rows.columns["tip_material"].values
    for summary in answer.data.summaries:
        own = [v for v, level in zip(values, levels, strict=True)
               if level == summary.group and v is not None]  # fmt: skip
        assert summary.median == pytest.approx(np.median(own)) and summary.count == len(own)


def test_rows_that_are_not_positive_have_no_place_on_a_logarithmic_axis(laboratory):
    answer = explored(laboratory, x="findings", y="peak_force_n", log_x=True)
    counts = np.array(answer.rows.columns["findings"].values, dtype=float)
    forces = np.array(answer.rows.columns["peak_force_n"].values, dtype=float)
    zeros = np.count_nonzero((counts == 0) & np.isfinite(forces))
    assert zeros > 0, "every impact of the store has a finding"
    assert answer.facts["not_positive"] == zeros
    assert answer.data.across.size + zeros == np.count_nonzero(
        np.isfinite(counts) & np.isfinite(forces)
    )


def test_words_along_an_axis_of_numbers_are_refused_with_the_cure(laboratory):
    with pytest.raises(RequestError, match="x is 'tip_material', whose values are words; expected"):
        explored(laboratory, x="tip_material")
    with pytest.raises(RequestError, match="y is 'nonsense'; expected one of id, run"):
        explored(laboratory, y="nonsense")
    with pytest.raises(LookupError, match="no campaign 'x' in the store"):
        explored(laboratory, campaign="x")


def test_a_quantity_is_also_named_by_its_heading(laboratory):
    answer = explored(laboratory, x="contact time (ms)", y="peak force")
    assert (answer.data.x.key, answer.data.y.key) == ("contact_time_s", "peak_force_n")


# --- selection


@pytest.mark.parametrize("kind", ["scatter", "levels", "control", "distribution"])
def test_selected_are_exactly_the_rows_within_the_rectangle(laboratory, kind):
    whole = explored(laboratory, kind=kind, x="contact_time_s" if kind != "levels" else "campaign")
    data, rng = whole.data, np.random.default_rng(7)
    sizes = set()
    for _ in range(20):
        low, high = np.sort(rng.choice(data.across, 2))
        bottom, top = (0.0, 1.0) if data.up is None else np.sort(rng.choice(data.up, 2))
        answer = explored(
            laboratory,
            kind=kind,
            x="contact_time_s" if kind != "levels" else "campaign",
            select_x=(low, high),
            select_y=(bottom, top),
            limit=1000,
        )
        inside = [
            whole.rows.keys[row]
            for place, row in enumerate(data.rows)
            if low <= data.across[place] <= high
            and (data.up is None or bottom <= data.up[place] <= top)
        ]
        assert [row["impact"] for row in answer.selected_rows()] == inside
        assert answer.facts["selected"] == len(inside)
        sizes.add(len(inside))
        conditions = conditions_of_selection(answer)
        if conditions is not None:
            narrowed = explored(laboratory, kind=kind, x="contact_time_s", where=conditions)
            assert [narrowed.rows.keys[row] for row in narrowed.data.rows] == inside
    assert len(sizes) > 2


def test_a_limit_lists_the_first_rows_and_counts_all(laboratory):
    answer = explored(laboratory, select_x=(0, 1), limit=3)
    assert len(answer.selected_rows()) == 3 < answer.facts["selected"]
    assert answer.to_json()["selected"] == len(answer.selected)


# --- sentences


def test_a_trend_is_stated_only_where_it_is_established(laboratory):
    from pyroshock.app.operations.explore.sentences import FALLS, RISES
    from pyroshock.app.operations.sentence import sentence

    answer = explored(laboratory, x="spline_peak_force_n", y="peak_force_n")
    rising = [line for line in answer.sentences() if line.rule is RISES]
    assert len(rising) == answer.data.correlation.is_established
    with pytest.raises(UnfoundedSentenceError):
        sentence("It falls.", FALLS, {"high": 0.1})
    few = explored(laboratory, x="contact_time_s", y="peak_force_n", where=("run<2",))
    assert few.facts["runs"] < 4 and all(line.rule is None for line in few.sentences())


def test_every_number_of_a_sentence_is_in_a_table(laboratory):
    for fields in ({}, {"kind": "control"}, {"subject": "shots"}, {"where": ("run<3",)}):
        answer = explored(laboratory, **fields)
        cells = {str(value) for table in answer.tables() for row in table.rows
                 for value in row.values()}  # fmt: skip
        assert {number.cell for line in answer.sentences() for number in line.numbers} <= cells


def test_nothing_that_matches_is_an_answer(laboratory):
    answer = explored(laboratory, where=("peak_force_n>1e9",))
    assert [line.text for line in answer.sentences()] == ["No impact matches."]
    for kind in ("distribution", "levels", "control"):
        empty = explored(laboratory, kind=kind, where=("peak_force_n>1e9",))
        assert empty.drawn.plots and empty.to_json()["rows"] == 0


# --- the request


@given(FINITE, FINITE)
def test_ends_of_a_stretch_are_read_as_they_were_written(a, b):
    low, high = sorted((a, b))
    assert ends_of(stretch_text(low, high)) == (low, high)
    request = read(Exploration, {"select_x": (low, high)}, "python")
    assert ends_of(request.select_x) == (low, high)


@given(st.text(max_size=30))
def test_a_stretch_is_two_numbers_or_is_refused_in_words(text):
    try:
        request = read(Exploration, {"select_y": text}, "network")
    except RequestError as error:
        assert "select_y" in str(error)
    else:
        assert request.select_y is None or ends_of(request.select_y)


_WORDS = st.text(
    st.characters(codec="ascii", exclude_characters="\x7f", min_codepoint=32), max_size=20
)
_REQUESTS = st.fixed_dictionaries(
    {},
    optional={
        "subject": st.sampled_from(["impacts", "shots", "channels", "models"]),
        "kind": st.sampled_from(["scatter", "distribution", "levels", "control"]),
        "x": _WORDS, "y": _WORDS, "colour": _WORDS, "campaign": _WORDS, "channel": _WORDS,
        "where": st.lists(_WORDS, max_size=4).map(tuple),
        "log_x": st.booleans(), "log_y": st.booleans(),
        "select_x": st.tuples(FINITE, FINITE).map(sorted).map(tuple),
        "limit": st.integers(1, 2000),
    },
)  # fmt: skip


@given(_REQUESTS)
@example({"x": " "})
@example({"campaign": " "})
def test_a_request_is_read_from_what_a_view_and_an_address_keep_of_it(fields):
    request = read(Exploration, fields, "python")
    stored = json.loads(json.dumps(request.model_dump(mode="json")))
    assert read(Exploration, stored, "stored") == request
    texts = texts_of(request)
    values = {name: stored[name] if name == "where" else texts[name] for name in texts}
    read_request = read(Exploration, values, "network")
    assert read_request == request and text_of(read_request.select_x) == text_of(request.select_x)
