"""The pictures of the first page are chosen and ordered by the laboratory."""

from __future__ import annotations

from typing import Any

import pytest
from pyroshock.app.operations.home.pictures import MOST, PICTURES
from support.processes.web_client import post, post_json
from support.stores.web_stores import Lab

pytestmark = pytest.mark.timeout(600)
VIEW = {"name": "force by velocity", "x": "impact_velocity_m_s", "y": "peak_force_n"}


def pictures_of(lab: Lab) -> list[str]:
    """The ids of the pictures on the page, in their order."""
    text = lab.client.get("/").text.partition('id="pictures"')[2].partition("<details")[0]
    ids = [part.partition('"')[0] for part in text.split(' id="')[1:]]
    return [picture_id for picture_id in ids if not picture_id.endswith("-data")]


def arrange(lab: Lab, *pictures: str) -> Any:
    return post(lab.client, "/home/pictures", {"pictures": list(pictures)}, follow_redirects=False)


def test_usual_pictures_stand_in_their_usual_order(filled: Lab) -> None:
    assert pictures_of(filled) == list(PICTURES)


def test_chosen_pictures_stand_in_the_chosen_order_and_none_gives_the_usual_ones(
    filled: Lab,
) -> None:
    answer = arrange(filled, "runs-by-plan", "recordings-by-day")
    assert (answer.status_code, answer.headers["location"]) == (303, "/")
    assert pictures_of(filled) == ["runs-by-plan", "recordings-by-day"]
    assert arrange(filled, "recordings-by-day", "runs-by-plan").status_code == 303
    assert pictures_of(filled) == ["recordings-by-day", "runs-by-plan"]
    assert arrange(filled).status_code == 303
    assert pictures_of(filled) == list(PICTURES)


def test_a_saved_view_is_a_picture_until_it_is_deleted(filled: Lab) -> None:
    assert post_json(filled.client, "/api/views", VIEW).is_success
    assert arrange(filled, "view force by velocity", "models-in-use").status_code == 303
    first, second = pictures_of(filled)
    assert first.startswith("view-")
    assert second == "models-in-use"
    text = filled.client.get("/").text
    assert "View force by velocity" in text
    assert f'<script type="application/json" id="{first}-data">{{' in text
    assert post_json(filled.client, "/api/views/force by velocity/delete", {}).is_success
    assert pictures_of(filled) == ["models-in-use"]


@pytest.mark.parametrize(("pictures", "words"), [
    (["forces"], "pictures has 'forces'; expected some of recordings-by-day, "),
    (["view gone"], "pictures has 'view gone'"),
])  # fmt: skip
def test_what_is_no_picture_is_refused_and_nothing_changes(
    filled: Lab, pictures: list[str], words: str
) -> None:
    assert arrange(filled, "runs-by-plan").status_code == 303
    answer = post_json(filled.client, "/api/home/pictures", {"pictures": pictures})
    assert answer.status_code in (404, 422)
    assert words in answer.text.replace('\\"', '"')
    assert pictures_of(filled) == ["runs-by-plan"]


def test_more_pictures_than_a_page_takes_are_refused(filled: Lab) -> None:
    names = [f"view {number}" for number in range(MOST + 1)]
    for name in names:
        view = {**VIEW, "name": name.removeprefix("view ")}
        assert post_json(filled.client, "/api/views", view).is_success
    answer = post_json(filled.client, "/api/home/pictures", {"pictures": names})
    assert answer.status_code == 422
    assert f"expected at most {MOST}" in answer.text
