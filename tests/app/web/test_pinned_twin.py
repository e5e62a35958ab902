"""The link of the twin pins what answered it, and its page says what was measured and validated."""

from __future__ import annotations

import re
from datetime import UTC, datetime
from html import unescape
from urllib.parse import parse_qs, urlsplit

import pytest
from pyroshock.schema.jobs import DONE, Job
from support.processes.web_client import post
from support.records.scored_shots import FORCE, gaussian, score
from support.stores.web_stores import GUN, HAMMER, Lab

pytestmark = pytest.mark.timeout(300)
SHOT = "impact_velocity_m_s=1.5&bullet_mass_kg=0.32&tip_material=steel"


def numbers(page: str) -> str:
    return page.partition('<table id="numbers">')[2].partition("</table>")[0]


def link_of(page: str) -> str:
    link = re.search(r'<a id="link" href="([^"]*)"', page)
    assert link is not None
    return unescape(link[1])


def test_a_link_shows_the_same_numbers_after_another_model_was_put_in_use(filled: Lab) -> None:
    client = filled.client
    post(client, "/models/tree/1/promote", {"reason": "the first one", "force": "true"})
    address = f"/twin?campaign={HAMMER}&{SHOT}"
    first_page = client.get(address).text
    link = link_of(first_page)
    pinned = {name: values[0] for name, values in parse_qs(urlsplit(link).query).items()}
    assert (pinned["campaign"], pinned["contact"]) == (HAMMER, "tree@1")
    assert pinned["impact_velocity_m_s"] == "1.5"
    assert "<td" in numbers(first_page) and numbers(client.get(link).text) == numbers(first_page)
    post(client, "/models/linear/1/promote", {"reason": "a try", "force": "true"})
    assert numbers(client.get(link).text) == numbers(first_page)
    assert numbers(client.get(address).text) != numbers(
        first_page
    )  # the model in use is another one


def test_a_specification_stands_in_the_link_and_in_the_spectrum(filled: Lab) -> None:
    specification = "frequency_hz,level_g\n100,30\n1000,300\n10000,300\n"
    query = {"campaign": GUN, "tank_pressure_pa": "400000", "specification": specification,
             "tolerance": "3dB"}  # fmt: skip
    page = filled.client.get("/twin", params=query).text
    assert "The specification reaches from 100 to 10000 Hz" in page
    pinned = parse_qs(urlsplit(link_of(page)).query)
    assert pinned["specification"] == [specification.strip()] and pinned["tolerance"] == ["3dB"]
    answer = filled.client.get("/twin/answer", params=query).json()
    names = [own["name"] for own in answer["figures"]["spectrum"]["series"]]
    assert {"prescribed", "tolerance +3/−3 dB"} <= set(names)


def test_a_specification_that_cannot_be_read_is_named_at_its_field(filled: Lab) -> None:
    page = filled.client.get(f"/twin?campaign={GUN}&specification=nonsense")
    assert page.status_code == 422 and 'id="specification-error"' in page.text
    assert "<td" in numbers(page.text)


def validated(lab: Lab, said: float) -> int:
    """A finished validation of the gun's campaign whose bands are this wide."""
    rows = [score(gaussian(60, said=said), FORCE).as_json()]
    data = {"campaign": GUN, "quantities": rows, "failures": [], "seen": "nothing"}

    def work(session):
        now = datetime.now(UTC)
        job = Job(kind="validate", label="Validate", state=DONE, arguments={"campaign": GUN},
                  result=data, address="/validations/1", words="done",
                  asked_at=now, ended_at=now)  # fmt: skip
        session.add(job)
        session.flush()
        return job.id

    return lab.store.write(work)


def test_bands_that_a_validation_found_too_narrow_are_warned_of(filled: Lab) -> None:
    page = filled.client.get(f"/twin?campaign={GUN}").text
    assert 'id="validated"' not in page
    key = validated(filled, 1.0)
    page = filled.client.get(f"/twin?campaign={GUN}").text
    note = page.partition('id="validated"')
    assert "The 90 % bands hold" in note[2] and not note[0].endswith('class="note warn" ')
    narrow = validated(filled, 0.3)
    page = filled.client.get(f"/twin?campaign={GUN}").text
    head_of_page, _, note_text = page.partition('id="validated"')
    assert head_of_page.endswith('class="note warn" ')
    assert "Not calibrated: the 90 % bands hold only" in note_text
    assert f'href="/validations/{narrow}"' in note_text and narrow > key
