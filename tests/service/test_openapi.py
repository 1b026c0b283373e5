"""The OpenAPI description holds: whatever fits it, or does not, is answered, and never with 5xx."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from fastapi.testclient import TestClient
from hypothesis import HealthCheck, Phase, given, settings

from heartgen.service import security
from heartgen.service.app import make_app
from heartgen.service.settings import Settings
from tests.service.helpers import HOME

schemathesis: Any = pytest.importorskip("schemathesis")

pytestmark = pytest.mark.slow

EXAMPLES = 12
"""Requests of each operation."""


@pytest.fixture(params=["sqlite", "postgresql"], scope="module")
def fuzzed(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator:
    """Requests without a token, as many as one likes."""
    url = None
    if request.param == "postgresql":
        url = request.getfixturevalue("postgres").fresh()
    told = {"data": tmp_path_factory.mktemp("data"), "database": url, "rate_limit": 10**9}
    app = make_app(Settings(free_space=0, wait_limit=0.1, queue_limit=10**6, **told))
    yield TestClient(app, base_url=HOME, raise_server_exceptions=False)
    app.state.service.database.close()


def asking(client: TestClient, operation: Any) -> Any:
    """A test that asks for one operation, in ways that fit its description."""

    @given(operation.as_strategy())
    @settings(
        max_examples=EXAMPLES,
        deadline=None,
        database=None,
        derandomize=True,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    def ask(case: Any) -> None:
        told = case.as_transport_kwargs(base_url=HOME)
        told.pop("cookies", None)
        answer = client.request(**told)
        missing = operation.path == "/healthz"  # no workers run here
        assert answer.status_code < (504 if missing else 500), (case.method, case.path, answer.text)

    return ask


def test_fuzzed_requests_are_answered(fuzzed: TestClient) -> None:
    security._limiter.storage.reset()
    schema = schemathesis.openapi.from_dict(fuzzed.get("/openapi.json").json())
    operations = [each.ok() for each in schema.get_all_operations()]
    assert len(operations) > 15
    for operation in operations:
        asking(fuzzed, operation)()
