"""The page /docs in Chromium without a network."""

import re

import httpx

from tests.interchange.exports.programs import page_content
from tests.running import RunningService

NO_NETWORK = "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1"  # names are not found, whatever asks


def test_the_reference_needs_no_network(service: RunningService) -> None:
    shown = page_content(f"{service.url}/docs", "/v1/audio/speech", NO_NETWORK)
    assert {"/v1/clips", "/v1/jobs/{job_id}", "/readyz"} <= set(re.findall(r'data-path="([^"]+)"', shown))
    loaded = re.findall(r"<(?:script|link|img|iframe)[^>]* (?:src|href)=\"([^\"]+)\"", shown)
    assert loaded
    assert all(one.startswith(("docs/", "data:")) for one in loaded)


def test_the_reference_may_load_and_send_nothing_elsewhere(client: httpx.Client) -> None:
    page = client.get("/docs")
    policy = page.headers["content-security-policy"]
    assert not re.search(r"https?:|[*]|unsafe-eval|script-src[^;]*unsafe-inline", policy)
    assert "default-src 'none'" in policy
    for name in re.findall(r'(?:src|href)="(docs/[^"]+)"', page.text):
        packed = client.get(f"/{name}")
        assert packed.status_code == 200
        assert packed.content == client.get(f"/{name}", headers={"accept-encoding": "identity"}).content
        assert client.head(f"/{name}").status_code == 200
