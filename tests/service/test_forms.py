"""Forms and pages hold: whatever is typed into a field, or asked for, is answered without 5xx."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest
from fastapi.testclient import TestClient
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from heartgen.service import security
from heartgen.service.app import make_app
from heartgen.service.security import COOKIE
from heartgen.service.settings import Settings
from tests.service.helpers import HOME, finish, submit

pytestmark = pytest.mark.slow

EXAMPLES = 25
"""Requests of each form and page."""

HARD = ["\0", "\x1b[2J", "🫀" * 300, "x" * 10**5]
"""What each field is given once."""

NASTY = [*HARD, "", "a\0b", "../../etc/passwd", "HG-\0", "1e999", "-1", "NaN", "{}", "=,="]
NASTY += ["[" * 5000, "\r\nSet-Cookie: a=b", "<script>", "%00", "' OR 1=1 --"]

FITTING = {"title": "A heart", "no_names": "yes"}
"""What has to be typed in."""

SHORT = 2000
"""Letters of an address that a client sends at most."""

TEXTS = st.one_of(st.sampled_from(NASTY), st.text(max_size=300))

few = settings(
    max_examples=EXAMPLES,
    deadline=None,
    database=None,
    derandomize=True,
    phases=[Phase.generate],
    suppress_health_check=list(HealthCheck),
)


@dataclass
class Form:
    """A form of a page.

    Attributes
    ----------
    action : str
        Where it goes.
    fields : dict of str to str
        Names and values.
    files : list of str
        Names of fields for files.
    """

    action: str
    fields: dict[str, str] = field(default_factory=dict)
    files: list[str] = field(default_factory=list)

    @property
    def fitting(self) -> dict[str, str]:
        """Values that pass."""
        return {name: value or FITTING.get(name, "") for name, value in self.fields.items()}


class Forms(HTMLParser):
    """Collects the forms of a page that change something."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[Form] = []
        self.inside = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        told = {name: value or "" for name, value in attrs}
        if tag == "form":
            self.inside = told["method"] == "post"
            if self.inside:
                self.found.append(Form(told["action"]))
        elif self.inside and tag in ("input", "select", "textarea"):
            if told.get("type") == "file":
                self.found[-1].files.append(told["name"])
            else:
                self.found[-1].fields[told["name"]] = told.get("value", "")


@pytest.fixture
def fuzzed(settings: Settings, monkeypatch: pytest.MonkeyPatch) -> Iterator[TestClient]:
    """Requests of a visitor, as many as one likes; of what is published, nothing is drawn."""
    monkeypatch.setattr("heartgen.service.library.SHOWN", ())
    monkeypatch.setattr("heartgen.service.security.WRONG_TRIES", 10**9)
    security._limiter.storage.reset()
    app = make_app(settings.model_copy(update={"rate_limit": 10**9, "queue_limit": 10**6}))
    token = app.state.service.tokens.create("visitor", ["jobs", "library", "publish"])
    client = TestClient(app, base_url=HOME, raise_server_exceptions=False, follow_redirects=False)
    client.headers["Cookie"] = f"{COOKIE}={token}"
    yield client
    app.state.service.database.close()


@pytest.fixture
def jobs(fuzzed: TestClient, mask: Path, result: Path) -> tuple[str, str]:
    """One that is done, and one that waits."""
    done = submit(fuzzed, mask).json()["id"]
    finish(fuzzed.app.state.service, result, done)
    return done, submit(fuzzed, mask, options='{"lod": 5}').json()["id"]


def forms_of(client: TestClient, places: list[str]) -> list[Form]:
    """All forms of some pages."""
    reader = Forms()
    for place in places:
        page = client.get(place)
        assert page.status_code == 200
        reader.feed(page.text)
    return reader.found


def typed(form: Form) -> st.SearchStrategy[dict[str, str]]:
    """A form that passes, but for some fields that are changed, left out or added."""
    names = st.one_of(st.sampled_from(list(form.fields)), TEXTS)
    return st.dictionaries(names, TEXTS, max_size=3).map(lambda other: form.fitting | other)


def ask(client: TestClient, form: Form, mask: bytes) -> None:
    """Send a form again and again."""
    names = st.one_of(st.just("heart.nii.gz"), TEXTS)
    contents = st.one_of(st.just(mask), st.binary(max_size=500))

    def send(values: dict[str, str], name: str, content: bytes) -> None:
        files: Any = {each: (name, content) for each in form.files} or None
        answer = client.post(form.action, data=values, files=files)
        assert answer.status_code < 500, (form.action, values, name, answer.text)

    for changed in form.fields:
        for text in HARD:
            send(form.fitting | {changed: text}, "heart.nii.gz", mask)
    few(given(typed(form), names, contents)(send))()


def test_forms_are_answered_whatever_is_typed(
    fuzzed: TestClient, jobs: tuple[str, str], mask: Path
) -> None:
    places = ["/", "/login", *(f"/jobs/{job}" for job in jobs)]
    forms = forms_of(fuzzed, places)
    asked = {form.action.rpartition("/")[2] for form in forms}
    assert asked == {"submit", "login", "logout", "cancel", "publish"}
    for form in forms:
        ask(fuzzed, form, mask.read_bytes())
    assert fuzzed.get("/library").status_code == 200


def test_pages_are_answered_whatever_is_asked(fuzzed: TestClient, jobs: tuple[str, str]) -> None:
    heads = ["/jobs/", "/library/", "/library/HG-0123456789/v", "/static/", "/static/api/", "/"]

    @given(
        st.sampled_from(heads),
        TEXTS,
        st.dictionaries(st.sampled_from(["q", "offset", "species", "license", "x"]), TEXTS),
    )
    @few
    def look(head: str, tail: str, query: dict[str, str]) -> None:
        for place in (head + quote(tail[:SHORT], errors="replace"), "/library"):
            told = {name: text[:SHORT] for name, text in query.items()}
            answer = fuzzed.get(place, params=told)
            assert answer.status_code < 500, (place, query, answer.text)

    look()


@pytest.mark.parametrize("place", ["/submit", "/login", "/logout", "/v1/jobs", "/jobs/{}/publish"])
def test_bodies_that_are_no_form_are_refused(
    fuzzed: TestClient, jobs: tuple[str, str], place: str
) -> None:
    kinds = ["", "multipart/form-data", "multipart/form-data; boundary=x", "text/plain"]
    kinds += ["application/x-www-form-urlencoded; charset=utf-7", "application/json"]
    part = b'--x\r\nContent-Disposition: form-data; name="mask"; filename="\xff\x00.nii"\r\n\r\n'

    @given(
        st.sampled_from(kinds),
        st.one_of(st.binary(max_size=200), st.just(part), st.just(part * 50)),
    )
    @few
    def send(kind: str, body: bytes) -> None:
        answer = fuzzed.post(place.format(jobs[0]), content=body, headers={"Content-Type": kind})
        assert 400 <= answer.status_code < 500, (kind, body, answer.text)

    send()
