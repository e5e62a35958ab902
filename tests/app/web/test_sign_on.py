"""Single sign-on through an identity provider: who comes in, as whom, and what keeps out everybody
else. The tokens are made by PyJWT."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, parse_qsl, urlencode, urlsplit

import pytest
from pyroshock.app.operations.people.stored_identities import ProviderAccount, invite
from pyroshock.app.operations.people.stored_users import add_user, remove_user
from pyroshock.app.server.application import application
from pyroshock.app.web.settings import Settings, SettingsError
from pyroshock.app.web.sign_in import SESSION
from pyroshock.app.web.sign_on.provider import (
    HOLDS_S,
    KEYS_AGAIN_S,
    IdentityProvider,
    ProviderError,
)
from pyroshock.app.web.sign_on.settings import SignOnSettings, SignOnSettingsError
from pyroshock.app.web.sign_on.sign_on import COOKIE, LASTS_S, SignOn
from pyroshock.schema.audit import AuditRow
from pyroshock.schema.session import Store, Writer, open_store
from pyroshock.schema.sign_on_identities import SignOnIdentity
from pyroshock.schema.users import User
from sqlalchemy import select
from starlette.testclient import TestClient
from support.processes.identity_provider import (
    CLIENT,
    SECRET,
    TestProvider,
    running_provider,
    sent_on,
)
from support.processes.web_client import ADDRESS, sqlite, token_in
from support.stores.stores import refusal, run_pyroshock

PASSWORD = "four quiet grey herons"
HTML = {"accept": "text/html"}


@pytest.fixture(scope="module")
def running() -> Iterator[TestProvider]:
    with running_provider() as provider:
        yield provider


@pytest.fixture
def provider(running: TestProvider) -> TestProvider:
    running.reset()
    return running


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A laboratory with an administrator, and an invitation of anna as an engineer."""
    folder = tmp_path_factory.mktemp("people")
    with open_store(sqlite(folder), Writer("test", "0"), create=True) as opened:
        with opened.writing() as session:
            add_user(session, "ada", "administrator", PASSWORD)
            invite(session, "anna", "anna", "engineer", None)
        with opened.engine.connect() as connection:
            connection.exec_driver_sql("PRAGMA wal_checkpoint(TRUNCATE)")
    return (folder / "lab.db").read_bytes()


@pytest.fixture
def store(filled: bytes, tmp_path: Path) -> Iterator[Store]:
    (tmp_path / "lab.db").write_bytes(filled)
    with open_store(sqlite(tmp_path), Writer("test", "0")) as opened:
        yield opened


class Door:
    """A server with single sign-on, and a browser before it."""

    def __init__(self, store: Store, provider: TestProvider, **more: Any) -> None:
        self.store, self.provider = store, provider
        server = {name: more.pop(name) for name in ("token", "takes_passwords") if name in more}
        self.settings = SignOnSettings(
            provider.issuer, CLIENT, ADDRESS, **{"client_secret": SECRET, **more}
        )
        url = store.engine.url.render_as_string()
        self.app = application(Settings(url, sign_on=self.settings, works=False, **server), store)
        self.browser = self.new_browser()

    def new_browser(self, base: str = ADDRESS) -> TestClient:
        return TestClient(self.app, base_url=base, follow_redirects=False)

    def begun(self, address: str = "/jobs") -> str:
        """The address at the provider that the button leads to."""
        answer = self.browser.get(f"/sign-in/provider?{urlencode({'address': address})}")
        assert answer.status_code == 303, answer.text
        return str(answer.headers["location"])

    def back(self, address: str) -> Any:
        """The provider has sent the browser to this address of ours."""
        assert address.startswith(f"{ADDRESS}/sign-in/provider/return?"), address
        return self.browser.get(address.removeprefix(ADDRESS), headers=HTML)

    def sign_in(self, address: str = "/jobs") -> Any:
        """All of it: the button, the provider, and back."""
        return self.back(sent_on(self.begun(address)))

    def who(self) -> str:
        """Who the browser is, and with which role, as the page of the account says."""
        answer = self.browser.get("/account", headers=HTML)
        match = re.search(r'id="who">You are <strong>(.*?)</strong>, with the role <strong>(.*?)<',
                          answer.text)  # fmt: skip
        return "nobody" if match is None else f"{match[1]} {match[2]}"

    def rows(self) -> list[tuple[str, ...]]:
        query = select(AuditRow.person, AuditRow.operation, AuditRow.outcome, AuditRow.subject)
        with self.store.reading() as session:
            return [tuple(row) for row in session.execute(query.order_by(AuditRow.id))]


@pytest.fixture
def door(store: Store, provider: TestProvider) -> Door:
    return Door(store, provider)


@pytest.fixture
def sign_on(provider: TestProvider) -> SignOn:
    """The sign-ins of a server, without the server."""
    return SignOn(SignOnSettings(provider.issuer, CLIENT, ADDRESS, client_secret=SECRET))


def signed_in(sign_on: SignOn) -> ProviderAccount:
    """Who has signed in at the provider, from the button to the token."""
    begun = sign_on.begin("/jobs")
    query = dict(parse_qsl(urlsplit(sent_on(begun.address)).query))
    return sign_on.finish(begun.cookie, query)[0]


def refused(answer: Any, door: Door, status: int = 401) -> str:
    """What the sign-in page says to who is not let in."""
    assert answer.status_code == status, answer.text
    assert door.who() == "nobody"
    match = re.search(r'<p role="alert">(.*?)</p>', answer.text, re.DOTALL)
    assert match is not None
    return match[1]


# --- who comes in


def test_an_invited_person_comes_in_through_the_button_and_lands_on_the_page(door: Door) -> None:
    form = door.browser.get("/jobs", headers=HTML).text
    link = re.search(r'id="sign-in-provider" href="(.*?)"', form)
    assert link is not None
    answer = door.browser.get(link[1].replace("&amp;", "&"))
    landed = door.back(sent_on(answer.headers["location"]))
    assert landed.status_code == 200
    assert '<meta http-equiv="refresh" content="0; url=/jobs">' in landed.text
    assert door.who() == "anna engineer"
    assert ("anna", "sign-in", "done", "") in door.rows()


def test_the_request_has_what_the_flow_needs_and_no_secret(door: Door) -> None:
    address = door.begun()
    query = {name: values[0] for name, values in parse_qs(urlsplit(address).query).items()}
    assert query.keys() == {
        *("response_type", "client_id", "redirect_uri", "scope", "state", "nonce"),
        *("code_challenge", "code_challenge_method"),
    }
    assert query["redirect_uri"] == f"{ADDRESS}/sign-in/provider/return"
    assert SECRET not in address and min(len(query["state"]), len(query["nonce"])) >= 43
    cookie = door.browser.cookies[COOKIE]
    assert SECRET not in cookie and "HttpOnly" in str(door.browser.get(
        "/sign-in/provider").headers["set-cookie"])  # fmt: skip


def test_a_person_stays_the_same_user_under_another_login(door: Door) -> None:
    door.sign_in()
    door.browser = door.new_browser()
    door.provider.person = {"sub": "7", "preferred_username": "anna.married"}
    assert door.sign_in().status_code == 200
    assert door.who() == "anna engineer"


def test_a_login_that_was_given_to_another_person_opens_nothing(door: Door) -> None:
    """The provider has reused the name of somebody who left."""
    door.sign_in()
    door.browser = door.new_browser()
    door.provider.person = {"sub": "8", "preferred_username": "anna"}
    assert "belongs to another account" in refused(door.sign_in(), door, 403)
    with door.store.reading() as session:
        assert list(session.scalars(select(SignOnIdentity.subject))) == ["7"]


def test_the_login_of_a_user_who_was_not_invited_opens_nothing(door: Door) -> None:
    """Whoever can choose a name at the provider is not thereby the administrator here."""
    door.provider.person = {"sub": "66", "preferred_username": "ada"}
    assert "is no user here" in refused(door.sign_in(), door, 403)


@pytest.mark.parametrize("login", ["ANNA", "Anna"])
def test_capital_letters_of_a_login_make_no_difference(door: Door, login: str) -> None:
    door.provider.person["preferred_username"] = login
    assert door.sign_in().status_code == 200


@pytest.mark.parametrize(
    "login", ["аnna", "anna\u200b", "ａnna", "anna\nada", "", 7, None, ["anna"]]
)
def test_a_login_that_only_looks_alike_opens_nothing(door: Door, login: Any) -> None:
    door.provider.person["preferred_username"] = login
    answer = door.sign_in()
    refused(answer, door, answer.status_code)
    assert answer.status_code in (401, 403)


def test_a_removed_user_is_refused_and_the_session_ends(door: Door) -> None:
    door.sign_in()
    with door.store.writing() as session:
        remove_user(session, "anna")
    assert door.who() == "nobody"
    assert "is no user here" in refused(door.sign_in(), door, 403)


def test_a_removed_user_who_is_bound_still_is_refused(door: Door) -> None:
    """A removal that another version of the software made leaves the account bound."""
    door.sign_in()
    with door.store.writing() as session:
        user = session.scalars(select(User).where(User.name == "anna")).one()
        user.removed_at = user.made_at
    assert "anna was removed" in refused(door.sign_in(), door, 403)


def test_an_invitation_anew_binds_another_account_and_ends_the_sessions(door: Door) -> None:
    door.sign_in()
    with door.store.writing() as session:
        invite(session, "anna", "anna", None, None)
    assert door.who() == "nobody"
    door.provider.person["sub"] = "9"
    assert door.sign_in().status_code == 200
    door.browser, door.provider.person["sub"] = door.new_browser(), "7"
    assert "belongs to another account" in refused(door.sign_in(), door, 403)


def test_a_named_account_is_bound_before_it_signs_in(door: Door) -> None:
    issuer = door.provider.issuer
    with door.store.writing() as session:
        invite(session, "ada", "x", None, (issuer, "41"))
    with (
        pytest.raises(ValueError, match="is that of user 'ada'"),
        door.store.writing() as session,
    ):
        invite(session, "anna", "y", None, (issuer, "41"))
    door.provider.person = {"sub": "41", "preferred_username": "whatever"}
    door.sign_in()
    assert door.who() == "ada administrator"


def test_a_user_taken_back_by_an_invitation_has_no_password_of_before(door: Door) -> None:
    with door.store.writing() as session:
        add_user(session, "olaf", "engineer", PASSWORD)
        remove_user(session, "olaf")
        invite(session, "olaf", "olaf", "reader", None)
    form = door.browser.get("/sign-in", headers=HTML)
    sent = {"csrf": token_in(form.text), "name": "olaf", "password": PASSWORD}
    assert door.browser.post("/sign-in", data=sent).status_code == 401
    door.provider.person = {"sub": "3", "preferred_username": "olaf"}
    door.sign_in()
    assert door.who() == "olaf reader"


# --- roles by group, and who is added


@pytest.mark.parametrize(("groups", "admits", "who"), [
    (["staff", "shock-engineers"], "groups", "eve engineer"),
    (["shock-engineers", "shock-lab"], "groups", "eve engineer"),
    ("shock-lab", "groups", "eve operator"),
    (["staff"], "groups", "nobody"),
    (None, "groups", "nobody"),
    ([["shock-engineers"], 7], "groups", "nobody"),
    ({"shock-engineers": True}, "groups", "nobody"),
    (["staff"], "everybody", "eve reader"),
    (["shock-lab"], "everybody", "eve operator"),
    (["shock-engineers"], "invited", "nobody"),
])  # fmt: skip
def test_who_is_added_and_with_which_role(
    store: Store, provider: TestProvider, groups: Any, admits: str, who: str
) -> None:
    roles = (("shock-lab", "operator"), ("shock-engineers", "engineer"))
    door = Door(store, provider, roles=roles, admits=admits)
    provider.person = {"sub": "5", "preferred_username": "eve", "groups": groups}
    door.sign_in()
    assert door.who() == who
    with store.reading() as session:
        added = set(session.scalars(select(User.name))) - {"ada", "anna"}
    assert added == ({"eve"} if who != "nobody" else set())


def test_the_role_of_who_was_added_follows_the_groups(store: Store, provider: TestProvider) -> None:
    door = Door(store, provider, roles=(("a", "administrator"), ("b", "reader")), admits="groups")
    for groups, who in ((["a"], "eve administrator"), (["b"], "eve reader"), ([], "nobody")):
        door.browser = door.new_browser()
        provider.person = {"sub": "5", "preferred_username": "eve", "groups": groups}
        door.sign_in()
        assert door.who() == who


def test_who_was_invited_keeps_the_role_that_was_given(
    store: Store, provider: TestProvider
) -> None:
    door = Door(store, provider, roles=(("a", "administrator"),), admits="everybody")
    provider.person["groups"] = ["a"]
    door.sign_in()
    assert door.who() == "anna engineer"


@pytest.mark.parametrize(("login", "name"), [
    ("ada", "ada-2"), ("Ada@lab.example", "ada-2"), ("token", "token-2"), ("Jörg Öl", "j-rg-l"),
    ("日本", "person"), ("../../x", "x"), ("-rf", "rf"), ("<b>", "b"), ("x" * 200, "x" * 60),
])  # fmt: skip
def test_who_is_added_gets_a_name_that_nobody_has(
    store: Store, provider: TestProvider, login: str, name: str
) -> None:
    door = Door(store, provider, admits="everybody")
    provider.person = {"sub": "5", "preferred_username": login}
    door.sign_in()
    assert door.who() == f"{name} reader"


def test_groups_may_stand_within_another_claim(store: Store, provider: TestProvider) -> None:
    door = Door(
        store, provider, groups_claim="realm_access.roles", roles=(("a", "engineer"),),
        admits="groups",
    )  # fmt: skip
    provider.person = {"sub": "5", "preferred_username": "eve", "realm_access": {"roles": ["a"]}}
    door.sign_in()
    assert door.who() == "eve engineer"


# --- e-mail addresses as logins


@pytest.mark.parametrize("verified", [True, "true"])
def test_a_verified_address_is_a_login(store: Store, provider: TestProvider, verified: Any) -> None:
    with store.writing() as session:
        invite(session, "ada", "Ada@Lab.example", None, None)
    door = Door(store, provider, login_claim="email")
    provider.person = {"sub": "1", "email": "ada@lab.example", "email_verified": verified}
    door.sign_in()
    assert door.who() == "ada administrator"


@pytest.mark.parametrize("verified", [False, None, "false", 1, "yes", [True]])
def test_an_address_that_nobody_has_verified_is_none(
    store: Store, provider: TestProvider, verified: Any
) -> None:
    with store.writing() as session:
        invite(session, "ada", "ada@lab.example", None, None)
    door = Door(store, provider, login_claim="email")
    provider.person = {"sub": "1", "email": "ada@lab.example", "email_verified": verified}
    assert "has not verified" in refused(door.sign_in(), door)


def test_what_the_token_lacks_is_asked_for_beside_it(store: Store, provider: TestProvider) -> None:
    with store.writing() as session:
        invite(session, "ada", "ada@lab.example", None, None)
    provider.person = {"sub": "1"}
    provider.user_info = {"email": "ada@lab.example", "email_verified": True}
    door = Door(store, provider, login_claim="email")
    door.sign_in()
    assert door.who() == "ada administrator"


def test_what_is_said_of_another_account_is_not_taken(store: Store, provider: TestProvider) -> None:
    provider.person = {"sub": "1"}
    provider.user_info = {"sub": "2", "preferred_username": "anna"}
    door = Door(store, provider)
    assert "another account" in refused(door.sign_in(), door)


# --- attacks on the token

WRONG_CLAIMS: dict[str, dict[str, Any]] = {
    "another nonce": {"nonce": "of another sign-in"},
    "no nonce": {"nonce": None},
    "another audience": {"aud": "another-application"},
    "another audience among several": {"aud": ["another-application", "third"]},
    "another audience that we asked for": {"aud": "another-application", "azp": CLIENT},
    "no audience": {"aud": None},
    "several audiences without a party": {"aud": [CLIENT, "another-application"]},
    "for another party": {"aud": [CLIENT, "x"], "azp": "x"},
    "another issuer": {"iss": "https://evil.example"},
    "no issuer": {"iss": None},
    "expired": {"exp": 1_700_000_000, "iat": 1_699_999_000},
    "no end": {"exp": None},
    "no beginning": {"iat": None},
    "not yet": {"nbf": 4_000_000_000},
    "from the future": {"iat": 4_000_000_000, "exp": 4_000_000_300},
    "no subject": {"sub": None},
    "empty subject": {"sub": ""},
    "subject as number": {"sub": 7},
    "end as text": {"exp": "never"},
    "another access token": {"at_hash": "AAAAAAAAAAAAAAAAAAAAAA"},
}


@pytest.mark.parametrize("wrong", WRONG_CLAIMS)
def test_a_token_with_a_wrong_claim_is_not_believed(
    provider: TestProvider, sign_on: SignOn, wrong: str
) -> None:
    assert signed_in(sign_on).subject == "7"
    provider.claims = WRONG_CLAIMS[wrong]
    with pytest.raises(ProviderError):
        signed_in(sign_on)


def test_a_refused_token_opens_nothing_and_leaves_a_row(door: Door) -> None:
    door.provider.claims = WRONG_CLAIMS["another audience"]
    assert "is not to be believed: invalid_claim" in refused(door.sign_in(), door)
    with door.store.reading() as session:
        assert session.scalars(select(SignOnIdentity.subject)).one() is None
    assert door.rows()[-1] == ("nobody", "sign-in", "failed", "")


@pytest.mark.parametrize("how", [
    "signed_by_stranger", "signed_by_unknown", "unsigned", "signed_with_public_key",
    "with_own_key", "changed_afterwards",
])  # fmt: skip
def test_a_token_that_the_provider_has_not_signed_is_not_believed(
    provider: TestProvider, sign_on: SignOn, how: str
) -> None:
    provider.make_token = getattr(provider, how)
    with pytest.raises(ProviderError, match="ID token"):
        signed_in(sign_on)


@pytest.mark.parametrize("text", ["", "x", "a.b.c", "..", "e30.e30.e30", 7, None, "😀.x.y"])
def test_a_token_that_is_none_is_not_believed(
    provider: TestProvider, sign_on: SignOn, text: Any
) -> None:
    provider.make_token = lambda _: text
    with pytest.raises(ProviderError):
        signed_in(sign_on)


def test_a_new_key_of_the_provider_is_asked_for(provider: TestProvider, sign_on: SignOn) -> None:
    """Once the keys have stood for a minute, and not for each token with a strange key."""
    now = [0.0]
    sign_on.provider = IdentityProvider(sign_on.settings, lambda: now[0])
    signed_in(sign_on)
    provider.keys = [provider.stranger_key]
    for _ in range(3):
        with pytest.raises(ProviderError, match="ID token"):
            signed_in(sign_on)
    assert provider.asked.count("/keys") == 1
    now[0] = KEYS_AGAIN_S
    assert signed_in(sign_on).subject == "7"
    assert provider.asked.count("/keys") == 2


def test_document_and_keys_are_asked_for_once_an_hour(
    provider: TestProvider, sign_on: SignOn
) -> None:
    now = [0.0]
    sign_on.provider = IdentityProvider(sign_on.settings, lambda: now[0])
    for _ in range(3):
        signed_in(sign_on)
    for path in ("/.well-known/openid-configuration", "/keys"):
        assert provider.asked.count(path) == 1
    now[0] = HOLDS_S
    signed_in(sign_on)
    for path in ("/.well-known/openid-configuration", "/keys"):
        assert provider.asked.count(path) == 2


@pytest.mark.parametrize("document", [
    {"issuer": "https://evil.example"}, {"token_endpoint": "http://evil.example/token"},
    {"authorization_endpoint": "javascript:alert(1)"}, {"jwks_uri": None},
    {"jwks_uri": "file:///etc/passwd"}, {"token_endpoint": "https://a:b@evil.example/"},
])  # fmt: skip
def test_a_document_that_leads_elsewhere_is_not_followed(
    provider: TestProvider, sign_on: SignOn, document: dict[str, Any]
) -> None:
    provider.document = document
    with pytest.raises(ProviderError, match="the identity provider"):
        sign_on.begin("/jobs")


def test_a_provider_that_is_away_is_named_and_passwords_still_work(
    store: Store, provider: TestProvider
) -> None:
    door = Door(store, provider)
    provider.document = {"issuer": "x"}
    answer = door.browser.get("/sign-in/provider")
    assert answer.status_code == 503 and "location" not in answer.headers
    form = answer.text
    sent = {"csrf": token_in(form), "name": "ada", "password": PASSWORD}
    assert door.browser.post("/sign-in", data=sent).status_code == 303
    assert door.who() == "ada administrator"


# --- attacks on the flow


def changed(address: str, **values: str) -> str:
    head, _, query = address.partition("?")
    return f"{head}?{urlencode({**dict(parse_qsl(query)), **values})}"


def test_a_wrong_state_opens_nothing(door: Door) -> None:
    back = sent_on(door.begun())
    assert "not begun by this browser" in refused(door.back(changed(back, state="x")), door)
    assert "/token" not in door.provider.asked


def test_a_sign_in_of_another_browser_opens_nothing(door: Door) -> None:
    """Whoever sends a person the address with the own code would have the person work under the
    attacker's name (RFC 6749, 10.12)."""
    back = sent_on(door.begun())
    door.browser = door.new_browser()
    assert "has begun no sign-in" in refused(door.back(back), door)
    door.begun()
    assert "not begun by this browser" in refused(door.back(back), door)


def test_a_code_is_taken_once(door: Door) -> None:
    begun = door.begun()
    cookie = door.browser.cookies[COOKIE]
    back = sent_on(begun)
    assert door.back(back).status_code == 200
    assert COOKIE not in door.browser.cookies
    for _ in range(2):
        door.browser = door.new_browser()
        door.browser.cookies.set(COOKIE, cookie)
        assert "used already" in refused(door.back(back), door)


def test_the_code_of_another_sign_in_is_refused_by_its_verifier(door: Door) -> None:
    """PKCE: a code that was caught on its way is worth nothing elsewhere."""
    caught = dict(parse_qsl(urlsplit(sent_on(door.begun())).query))["code"]
    door.browser = door.new_browser()
    own = sent_on(door.begun())
    assert "invalid_grant" in refused(door.back(changed(own, code=caught)), door)


def test_an_answer_of_another_provider_is_refused(door: Door) -> None:
    back = sent_on(door.begun())
    answer = door.back(changed(back, iss="https://evil.example"))
    assert "another identity provider" in refused(answer, door)


@pytest.mark.parametrize("damage", [
    lambda cookie: "", lambda cookie: cookie[:-1], lambda cookie: "x" + cookie,
    lambda cookie: cookie.partition(".")[0] + "." + "0" * 64, lambda cookie: ".", lambda _: "é",
])  # fmt: skip
def test_a_cookie_that_is_not_ours_opens_nothing(sign_on: SignOn, damage: Any) -> None:
    begun = sign_on.begin("/jobs")
    query = dict(parse_qsl(urlsplit(sent_on(begun.address)).query))
    with pytest.raises(ProviderError, match="has begun no sign-in"):
        sign_on.finish(damage(begun.cookie), query)


def test_a_sign_in_that_takes_too_long_begins_anew(store: Store, provider: TestProvider) -> None:
    now = [0.0]
    settings = SignOnSettings(provider.issuer, CLIENT, ADDRESS, client_secret=SECRET)
    sign_on = SignOn(settings, clock=lambda: now[0])
    begun = sign_on.begin("/jobs")
    query = dict(parse_qsl(urlsplit(sent_on(begun.address)).query))
    now[0] = LASTS_S + 1.0
    with pytest.raises(ProviderError, match="more than 10 minutes"):
        sign_on.finish(begun.cookie, query)


@pytest.mark.parametrize("error", ["access_denied", "server_error", "<script>alert(1)</script>"])
def test_a_provider_that_lets_nobody_in_is_told_without_its_words(door: Door, error: str) -> None:
    door.provider.error = error
    text = refused(door.sign_in(), door)
    assert "has let nobody in" in text and "script" not in text


@pytest.mark.parametrize("address", [
    "//evil.example", "https://evil.example", "/\\evil.example", "\\\\evil.example",
    "/\t/evil.example", "javascript:alert(1)", "", "@evil.example", "/%0d%0aset-cookie:x=y ",
    "/a b", "/" + "x" * 4_000,
])  # fmt: skip
def test_a_sign_in_leads_to_a_page_of_this_server_alone(door: Door, address: str) -> None:
    landed = door.sign_in(address)
    assert landed.status_code == 200
    assert '<meta http-equiv="refresh" content="0; url=/">' in landed.text
    assert "evil" not in landed.text


def test_quotes_of_an_address_end_nothing_on_the_page(door: Door) -> None:
    landed = door.sign_in('/impacts?where="><script>alert(1)</script>')
    assert landed.status_code == 200 and "<script>" not in landed.text


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1:8000.evil.example", "localhost:8000"])
def test_the_redirect_follows_from_the_settings_and_not_from_the_host(
    door: Door, host: str
) -> None:
    answer = door.browser.get("/sign-in/provider", headers={"host": host})
    location = answer.headers.get("location", "")
    assert answer.status_code in (303, 421)
    if answer.status_code == 303:  # first to the name under which the cookie will come back
        assert location.startswith(f"{ADDRESS}/sign-in/provider?")
    anyhow = door.browser.get("/sign-in/provider?here=true", headers={"host": host})
    if anyhow.status_code == 303:
        query = parse_qs(urlsplit(anyhow.headers["location"]).query)
        assert query["redirect_uri"] == [f"{ADDRESS}/sign-in/provider/return"]


@pytest.mark.parametrize("address", [
    "/sign-in/provider/../../jobs", "/sign-in%2fprovider", "/sign-in/provider%2freturn",
    "/sign%2din/provider", "/sign-in/provider/", "/sign-in/provider/x", "/sign-in/",
])  # fmt: skip
def test_no_spelling_of_the_open_pages_leads_further(door: Door, address: str) -> None:
    answer = door.browser.get(address)
    assert answer.status_code in (307, 401, 404), answer.text


def test_many_wrong_sign_ins_wait(door: Door) -> None:
    door.provider.make_token = door.provider.unsigned
    statuses = [door.sign_in().status_code for _ in range(4)]
    assert statuses[:3] == [401, 401, 401] and statuses[3] == 429


# --- the server


def test_a_session_of_before_ends_with_a_new_sign_in_and_with_signing_out(door: Door) -> None:
    door.sign_in()
    first = door.browser.cookies[SESSION]
    door.sign_in()
    assert door.browser.cookies[SESSION] != first
    old = door.new_browser()
    old.cookies.set(SESSION, first)
    assert old.get("/jobs").status_code == 401
    form = door.browser.get("/jobs", headers=HTML).text
    answer = door.browser.post("/sign-out", data={"csrf": token_in(form)})
    assert (answer.status_code, door.who()) == (303, "nobody")
    assert door.rows()[-1][:3] == ("anna", "sign-out", "done")


def test_passwords_may_be_switched_off(store: Store, provider: TestProvider) -> None:
    door = Door(store, provider, takes_passwords=False, token="x" * 16)
    form = door.browser.get("/jobs", headers=HTML).text
    assert "sign-in-provider" in form and 'name="password"' not in form
    sent = {"csrf": token_in(form), "name": "ada", "password": PASSWORD}
    assert door.browser.post("/sign-in", data=sent).status_code == 403
    assert door.sign_in().status_code == 200


def test_a_server_without_a_provider_shows_no_button(store: Store) -> None:
    url = store.engine.url.render_as_string()
    app = application(Settings(url, asks_people=True, works=False), store)
    browser = TestClient(app, base_url=ADDRESS, follow_redirects=False)
    assert "sign-in-provider" not in browser.get("/sign-in", headers=HTML).text
    for address in ("/sign-in/provider", "/sign-in/provider/return?code=x&state=y"):
        answer = browser.get(address)
        assert (answer.status_code, answer.headers["location"]) == (303, "/sign-in")


def test_a_client_without_a_secret_comes_in_by_its_verifier(
    store: Store, provider: TestProvider
) -> None:
    provider.public_client = True
    door = Door(store, provider, client_secret=None)
    assert door.sign_in().status_code == 200


def test_a_wrong_secret_is_named_without_it(store: Store, provider: TestProvider) -> None:
    door = Door(store, provider, client_secret="another secret")
    text = refused(door.sign_in(), door)
    assert "invalid_client" in text and "another secret" not in text


@pytest.mark.parametrize(("values", "words"), [
    ({"issuer": "http://login.example.org"}, "--sso-issuer"),
    ({"issuer": "login.example.org"}, "--sso-issuer"),
    ({"issuer": "https://u:p@login.example.org"}, "--sso-issuer"),
    ({"issuer": "https://[x"}, "--sso-issuer"),
    ({"public_address": "http://shock.example.org"}, "--public-address"),
    ({"public_address": "https://shock.example.org/lab"}, "has a path"),
    ({"public_address": ""}, "--public-address"),
    ({"client_id": ""}, "--sso-client-id"),
    ({"roles": (("a", "boss"),)}, "one of reader, operator"),
    ({"admits": "groups"}, "no group has a role"),
])  # fmt: skip
def test_settings_that_cannot_be_are_refused(values: dict[str, Any], words: str) -> None:
    good = {"issuer": "https://login.example.org", "client_id": "x",
            "public_address": "https://shock.example.org"}  # fmt: skip
    SignOnSettings(**good)
    with pytest.raises(SignOnSettingsError, match=re.escape(words)):
        SignOnSettings(**{**good, **values})


def test_the_secret_is_in_no_text_of_the_settings() -> None:
    settings = SignOnSettings("https://a.example", "x", "https://b.example", client_secret="hush")
    assert "hush" not in repr(settings)


def test_without_passwords_somebody_must_come_in() -> None:
    with pytest.raises(SettingsError, match="--sso-issuer"):
        Settings("sqlite:///x.db", takes_passwords=False)


# --- the command line

SERVE = ("serve", "--sso-issuer", "https://login.example.org", "--sso-client-id", "x")


def test_the_extra_is_named_where_it_is_missing(
    store: Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import importlib.util

    present = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "authlib" else present(name)
    )
    text = refusal(*SERVE, "--db", sqlite(tmp_path))
    assert "authlib" in text and "pip install 'pyroshock[sso,web]'" in text


def test_options_of_the_command_are_checked_before_it_listens(store: Store, tmp_path: Path) -> None:
    db = ("--db", sqlite(tmp_path))
    assert "--public-address" in refusal(*SERVE, *db)
    public = ("--public-address", "https://shock.example.org")
    assert "no role" in refusal(*SERVE, *public, "--sso-role", "a=b", *db)
    assert "GROUP=ROLE" in refusal(*SERVE, *public, "--sso-role", "a", *db)
    (tmp_path / "secret").write_text("\n")
    file = ("--sso-client-secret-file", str(tmp_path / "secret"))
    assert "secret holds no secret" in refusal(*SERVE, *public, *file, *db)
    assert "--sso-issuer" in refusal("serve", "--no-passwords", *db)


def test_no_option_takes_the_secret_itself() -> None:
    text = run_pyroshock("serve", "--help").stdout
    assert "--sso-client-secret-file" in text and "--sso-client-secret " not in text


def test_people_are_invited_by_the_command(store: Store, tmp_path: Path) -> None:
    db = ("--db", sqlite(tmp_path))
    run_pyroshock("users", "invite", "eva", "--login", "Eva@Lab.example", "--role", "operator", *db)
    listed = run_pyroshock("users", "list", "--json", *db).stdout
    assert '"login": "eva@lab.example"' in listed
    assert "is that of user 'eva'" in refusal("users", "invite", "ada", "--login",
                                              "eva@lab.example", *db)  # fmt: skip
    assert "has the role operator" in refusal("users", "invite", "eva", "--login", "e", "--role",
                                              "reader", *db)  # fmt: skip
    assert "issuer is missing" in refusal("users", "invite", "eva", "--login", "e", "--subject",
                                          "1", *db)  # fmt: skip
    trail = run_pyroshock("audit", "--json", *db).stdout
    assert '"operation": "user-invite"' in trail
