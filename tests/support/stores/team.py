"""A store with a campaign, a plan and the people of a laboratory, and browsers of these people."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from pyroshock.app.operations.people.stored_users import add_user
from pyroshock.app.operations.plan.planning import make_plan
from pyroshock.app.server.application import application
from pyroshock.app.web.settings import Settings
from pyroshock.schema.session import Store
from starlette.testclient import TestClient

from support.processes.web_client import ADDRESS, sqlite, token_in
from support.records.campaigns import hammer_campaign
from support.stores.stores import ingested, opened

PASSWORD = "four quiet grey herons"


class Team:
    """An application that asks people who they are, over a store that has them."""

    def __init__(self, store: Store, db: str) -> None:
        self.db, self.store = db, store
        self.app = application(Settings(db, asks_people=True, works=False), store)

    def browser(self, name: str) -> TestClient:
        """A browser in which a person has signed in."""
        client = TestClient(self.app, base_url=ADDRESS, follow_redirects=False)
        form = client.get("/sign-in", headers={"accept": "text/html"})
        fields = {"csrf": token_in(form.text), "name": name, "password": PASSWORD}
        assert client.post("/sign-in", data=fields).status_code == 303
        return client


@contextmanager
def team_of(
    folder: Path, people: Mapping[str, str], recordings: int = 2, hits: int = 1
) -> Iterator[Team]:
    """The hammer campaign "spring", the plan "autumn", and people (name -> role)."""
    db = sqlite(folder)
    ingested(
        db, hammer_campaign(folder / "spring", recordings=recordings, hits=hits, name="spring")
    )
    with opened(db) as store:
        make_plan(store, "factorial", "autumn", kind="hammer", repetitions=1)
        with store.writing() as session:
            for name, role in people.items():
                add_user(session, name, role, PASSWORD)
        yield Team(store, db)
