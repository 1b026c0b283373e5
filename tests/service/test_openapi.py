"""The OpenAPI description holds: whatever fits it, or does not, is answered, and never with 5xx."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from fastapi.testclient import TestClient
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

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


def test_fuzzed_requests_are_answered(fuzzed: TestClient) -> None:
    security._limiter.storage.reset()
    schema = schemathesis.openapi.from_dict(fuzzed.get("/openapi.json").json())
    operations = [each.ok() for each in schema.get_all_operations()]
    assert len(operations) > 15
    for operation in operations:

        @given(st.data())
        @settings(
            max_examples=EXAMPLES,
            deadline=None,
            database=None,
            derandomize=True,
            phases=[Phase.generate],
            suppress_health_check=list(HealthCheck),
        )
        def ask(data: st.DataObject, operation: Any = operation) -> None:
            case = data.draw(operation.as_strategy())
            kwargs = case.as_transport_kwargs(base_url=HOME)
            kwargs.pop("cookies", None)
            answer = fuzzed.request(**kwargs)
            assert answer.status_code < 500 or answer.json().get("workers") is False, answer.text

        ask()
