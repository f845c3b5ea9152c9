"""Signatures of webhooks against the examples of their specification, and settings."""

import base64
from pathlib import Path

import pytest

from lexicon.errors import InputError
from tts2face.serving.service.job_service import sign
from tts2face.serving.service.settings import ServiceSettings


def test_the_signature_is_that_of_standard_webhooks() -> None:
    """Example of the specification's own libraries (standard-webhooks, tests of signing)."""
    secret = "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw"
    body = b'{"test": 2432232314}'
    assert sign(secret, "msg_p5jXN8AQM9LWM0D4loKWxJek", 1614265330, body) == (
        "v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE="
    )
    plain = base64.b64decode(secret.removeprefix("whsec_"))
    with pytest.raises(UnicodeDecodeError):
        plain.decode()  # so that a secret in base64 is another key than its letters
    assert sign("other", "msg_p5jXN8AQM9LWM0D4loKWxJek", 1614265330, body) != sign(secret, "x", 1614265330, body)


def test_hosts_need_a_secret_that_is_never_shown(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="webhook_hosts needs webhook_secret"):
        ServiceSettings(webhook_hosts=("example.org",))
    settings = ServiceSettings(data=tmp_path, webhook_hosts=("example.org",), webhook_secret="hush")
    assert "hush" not in settings.as_toml()
    assert "hush" not in repr(settings)
    assert "example.org" in settings.as_toml()


def test_the_password_of_the_database_is_not_shown() -> None:
    settings = ServiceSettings(database="postgresql://ann:s%40cret@db.example:5432/jobs")
    assert 'database = "postgresql://ann@db.example:5432/jobs"' in settings.as_toml()
    assert "cret" not in settings.as_toml()
