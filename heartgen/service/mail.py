"""Result mails: written from the outbox in the database, sent by SMTP, tried again and again."""

from __future__ import annotations

import logging
import smtplib
import ssl
import time
from email.message import EmailMessage
from email.utils import formatdate, make_msgid
from html import escape
from threading import Event, Thread
from urllib.parse import unquote, urlsplit

from sqlalchemy import select
from sqlalchemy.exc import SQLAlchemyError

from heartgen.errors import HeartgenError
from heartgen.service.service import Service
from heartgen.service.tables import Job, Mail, State

logger = logging.getLogger("heartgen.service")

TICK = 1.0
"""Seconds between two looks into the outbox."""

FIRST_PAUSE = 15.0
"""Seconds after which a mail is tried again; twice as many each time."""

PATIENCE = 30.0
"""Seconds for the SMTP server to answer."""

SENDING = 120.0
"""Seconds in which nobody else tries a mail that is being sent."""

PORTS = {"smtp": 587, "smtps": 465}


class Mailer:
    """Sends what is in the outbox.

    Parameters
    ----------
    service : Service
        The parts of the service.
    pause : float
        Seconds after which a mail is tried again, the first time.
    """

    def __init__(self, service: Service, pause: float = FIRST_PAUSE) -> None:
        self.service, self.pause = service, pause
        self._ended = Event()
        self._thread = Thread(target=self._run, daemon=True, name="mailer")

    def start(self) -> None:
        """Begin, if there is a server to send by."""
        if self.service.settings.smtp is not None:
            self._thread.start()

    def stop(self) -> None:
        """End; what was not sent waits for the next server."""
        self._ended.set()
        if self._thread.is_alive():
            self._thread.join()

    def _run(self) -> None:
        while not self._ended.wait(TICK):
            try:
                while not self._ended.is_set() and self._send_next():
                    pass
            except SQLAlchemyError as error:
                logger.warning("the database does not answer: %s", type(error).__name__)

    def _send_next(self) -> bool:
        """Send the mail that is due; whether there was one."""
        settings, now = self.service.settings, time.time()
        due = select(Mail).where(
            Mail.sent.is_(None), Mail.due <= now, Mail.tries < settings.mail_tries
        )
        with self.service.database.writing() as session:
            mail = session.scalar(due.order_by(Mail.due).limit(1).with_for_update(skip_locked=True))
            if mail is None:
                return False
            mail.tries, mail.due = mail.tries + 1, now + SENDING
            job = session.get(Job, mail.job)
        try:
            if job is not None and job.email:
                self._deliver(compose(self.service, job))
            error = None
        except (OSError, smtplib.SMTPException, HeartgenError, ValueError) as failure:
            error = f"{type(failure).__name__}: {failure}"[:500]
            logger.warning("mail not sent: %s", type(failure).__name__, extra={"job": mail.job})
        with self.service.database.writing() as session:
            kept = session.get(Mail, mail.id)
            if kept is not None:
                kept.error, kept.sent = error, None if error else time.time()
                kept.due = time.time() + self.pause * 2 ** (kept.tries - 1)
        return True

    def _deliver(self, message: EmailMessage) -> None:
        """Hand a mail over to the SMTP server."""
        assert self.service.settings.smtp is not None
        place = urlsplit(self.service.settings.smtp.get_secret_value())
        kind = smtplib.SMTP_SSL if place.scheme == "smtps" else smtplib.SMTP
        port = place.port or PORTS[place.scheme]
        with kind(place.hostname or "localhost", port, timeout=PATIENCE) as server:
            server.ehlo_or_helo_if_needed()
            if place.scheme == "smtp" and server.has_extn("starttls"):
                server.starttls(context=ssl.create_default_context())
            if place.username:
                server.login(unquote(place.username), unquote(place.password or ""))
            server.send_message(message)


def compose(service: Service, job: Job) -> EmailMessage:
    """The mail about a job: summary, picture and link, as plain text and HTML.

    Parameters
    ----------
    service : Service
        The parts of the service.
    job : Job
        That has ended.
    """
    settings, title = service.settings, " ".join(job.title.split())
    message = EmailMessage()
    message["Subject"] = f"heartgen: {title} is {job.state}"
    message["From"], message["To"] = settings.mail_from, job.email
    message["Date"], message["Message-ID"] = formatdate(), make_msgid(domain="heartgen.invalid")
    message["Auto-Submitted"] = "auto-generated"
    link, facts = f"{settings.url}/jobs/{job.id}", facts_of(job)
    lines = [title, "", *(f"{name}: {value}" for name, value in facts.items()), "", link, ""]
    message.set_content("\n".join([*lines, "Research use, not for diagnosis.", ""]))
    picture = _picture(service, job)
    place = make_msgid(domain="heartgen.invalid")
    rows = "".join(
        f"<tr><td>{escape(name)}</td><td>{escape(value)}</td></tr>" for name, value in facts.items()
    )
    image = f'<p><img src="cid:{place[1:-1]}" width="450" alt="The mesh"></p>' if picture else ""
    message.add_alternative(
        f"<h2>{escape(title)}</h2><table>{rows}</table>{image}"
        f'<p><a href="{escape(link)}">Result</a></p><p>Research use, not for diagnosis.</p>',
        subtype="html",
    )
    if picture:
        html = message.get_payload()[1]  # type: ignore[index]
        html.add_related(picture, "image", "png", cid=place)  # type: ignore[union-attr]
    return message


def facts_of(job: Job) -> dict[str, str]:
    """What is told of a job that has ended.

    Parameters
    ----------
    job : Job
        Of the database.
    """
    if job.summary is None:
        return {"State": str(job.state), "Reason": job.reason or ""}
    told = job.summary
    return {
        "Status": str(told["status"]),
        "Error, mean": f"{told['error_mean']:.3f} mm",
        "Error, largest": f"{told['error_max']:.3f} mm",
        "Quality, mean": f"{told['quality_mean']:.3f}",
        "Quality, least": f"{told['quality_min']:.3f}",
        "Time": f"{told['seconds']:.1f} s",
    }


def _picture(service: Service, job: Job) -> bytes | None:
    """The mesh, if there is one and it can be drawn."""
    if job.state != State.DONE:
        return None
    try:
        return service.renditions.file(f"results/{job.fingerprint}", "preview").read_bytes()
    except (HeartgenError, OSError):
        return None
