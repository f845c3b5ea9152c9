"""Webhooks: messages about the end of jobs, signed as by the specification Standard Webhooks."""

import base64
import hashlib
import hmac
import http.client
import json
import time
from urllib.parse import urlsplit

from tts2face import __version__
from tts2face.jobs.job_client import Delivery, JobClient
from tts2face.jobs.job_records import JobRecord
from tts2face.service.errors import RefusedError
from tts2face.service.jobs.job_models import job_detail
from tts2face.service.settings import ServiceSettings

TIMEOUT_S = 10.0
SECRET_PREFIX = "whsec_"  # of secrets in base64
SCHEMES = {"https": http.client.HTTPSConnection, "http": http.client.HTTPConnection}


def check_webhook(url: str, settings: ServiceSettings) -> None:
    """Refuse a webhook whose host is not in the setting `webhook_hosts`.

    Raises
    ------
    RefusedError
        With the reason.
    """
    try:
        parts = urlsplit(url)
        place = parts.hostname if parts.port is None else f"{parts.hostname}:{parts.port}"
    except ValueError as wrong:
        raise RefusedError(400, "invalid_webhook", f"the webhook is no URL: {wrong}") from wrong
    if parts.scheme not in SCHEMES or "@" in parts.netloc or not url.isascii() or not url.isprintable() or " " in url:
        raise RefusedError(400, "invalid_webhook", "the webhook must be a URL https://HOST/PATH without a password")
    if place not in settings.webhook_hosts:
        raise RefusedError(
            400,
            "invalid_webhook",
            f"the host {str(place)[:80]!r} gets no webhooks; add it to the setting webhook_hosts",
        )


def sign(secret: str, message_id: str, timestamp: int, body: bytes) -> str:
    """Value of the header ``webhook-signature``: HMAC-SHA256 of id, time and body."""
    key = base64.b64decode(secret.removeprefix(SECRET_PREFIX)) if secret.startswith(SECRET_PREFIX) else secret.encode()
    content = f"{message_id}.{timestamp}.".encode() + body
    return "v1," + base64.b64encode(hmac.digest(key, content, hashlib.sha256)).decode()


def message_of(record: JobRecord) -> bytes:
    """Body of the message about a job."""
    content = {"type": f"job.{record.state}", "job": job_detail(record).model_dump(exclude={"webhook"})}
    return json.dumps(content, ensure_ascii=False, separators=(",", ":")).encode()


def send_message(url: str, message_id: str, body: bytes, secret: str) -> bool:
    """Send a message; whether the receiver has accepted it. Redirects are not followed."""
    parts, now = urlsplit(url), int(time.time())
    connection = SCHEMES[parts.scheme](parts.hostname or "", parts.port, timeout=TIMEOUT_S)
    headers = {
        "Content-Type": "application/json",
        "User-Agent": f"tts2face/{__version__}",
        "webhook-id": message_id,
        "webhook-timestamp": str(now),
        "webhook-signature": sign(secret, message_id, now, body),
    }
    path = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
    try:
        connection.request("POST", path, body, headers)
        status: int = connection.getresponse().status
        return 200 <= status < 300
    except (OSError, http.client.HTTPException):
        return False
    finally:
        connection.close()


def deliver(client: JobClient, delivery: Delivery, settings: ServiceSettings) -> bool:
    """Send the message about a job once and note the result; the id of the message is that of the job."""
    record = client.table.get(delivery.job_id)
    if record is None:
        return False
    is_delivered = send_message(delivery.url, record.id, message_of(record), settings.webhook_secret)
    client.note_delivery(delivery, is_delivered=is_delivered)
    return is_delivered
