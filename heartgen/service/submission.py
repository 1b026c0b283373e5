"""A mask that arrives with its options: read from a form, checked, kept, and put in the queue."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from email_validator import EmailNotValidError, validate_email
from fastapi import HTTPException, Request
from fastapi.concurrency import run_in_threadpool
from pydantic import TypeAdapter, ValidationError
from starlette.datastructures import FormData, UploadFile

from heartgen.errors import InputError
from heartgen.images.schemes import label_from_text, scheme_from_text
from heartgen.images.selecting import Selection
from heartgen.options import OPTIONS, Options, chosen, options_from_text
from heartgen.service.artifacts import fingerprint
from heartgen.service.schemas import Line
from heartgen.service.service import Service
from heartgen.service.tables import Job
from heartgen.service.tokens import Caller

MOST_FIELDS = 40
"""Of a form."""

OPTION = "option."
"""How the fields of a page's form begin that are for options."""

KEY_HEADER = "Idempotency-Key"

_LINE: TypeAdapter[str] = TypeAdapter(Line)


def form_schema() -> dict[str, Any]:
    """The form of a submission, for the OpenAPI description."""
    text = {"type": "string", "maxLength": 200}
    return {
        "requestBody": {
            "required": True,
            "content": {
                "multipart/form-data": {
                    "schema": {
                        "type": "object",
                        "required": ["mask"],
                        "properties": {
                            "mask": {
                                "type": "string",
                                "format": "binary",
                                "description": "Mask or label map: NIfTI, NRRD, MetaImage, DICOM.",
                            },
                            "options": {
                                "type": "string",
                                "contentMediaType": "application/json",
                                "contentSchema": TypeAdapter(Options).json_schema(),
                                "description": "As of heartgen.Options.",
                            },
                            "labels": text
                            | {"description": "Scheme of a label map, as of --labels."},
                            "label": {"type": "array", "items": text, "maxItems": 20},
                            "rv_wall": {"type": "number", "description": "mm"},
                            "frame": text | {"description": "Of a cine: number from 1, ED or ES."},
                            "title": text | {"description": "For your own list."},
                            "email": text | {"description": "Where to tell of the result."},
                        },
                    }
                }
            },
        }
    }


async def submitted(
    request: Request, service: Service, caller: Caller, form: FormData | None = None
) -> tuple[Job, bool]:
    """Put what a request brings in the queue.

    Parameters
    ----------
    request : Request
        With a form.
    service : Service
        The parts of the service.
    caller : Caller
        Who asks.
    form : FormData or None
        Of the request, if it was read before.

    Returns
    -------
    job : Job
    new : bool
        Whether it was not submitted before.
    """
    if await run_in_threadpool(service.jobs.waiting, caller.owner) >= service.settings.queue_limit:
        raise HTTPException(429, "too many of your jobs wait: let some be done first")
    await run_in_threadpool(
        service.artifacts.check_space, int(request.headers.get("content-length", 0))
    )
    if form is None:
        form = await request.form(max_files=1, max_fields=MOST_FIELDS)
    try:
        return await run_in_threadpool(_taken_in, request, service, caller, form)
    finally:
        await form.close()


def _taken_in(
    request: Request, service: Service, caller: Caller, form: FormData
) -> tuple[Job, bool]:
    """The job of a form; nothing of it is kept if it is refused."""
    mask = form.get("mask")
    if not isinstance(mask, UploadFile):
        raise HTTPException(422, "there is no mask: attach one file in the field mask")
    options = _options(_text(form, "options")) if "options" in form else _written(form)
    selection = _selection(form)
    key = request.headers.get(KEY_HEADER) or None
    name = Path((mask.filename or "").replace("\\", "/")).name
    place, digest = service.artifacts.take_in(mask.file, mask.filename or "")
    told = asdict(selection) | {"label": list(selection.label)}
    job = Job(
        owner=caller.owner,
        idempotency_key=None if key is None else _line(key, KEY_HEADER),
        fingerprint=fingerprint(digest, Path(place).name, asdict(options), told),
        title=_text(form, "title") or _title(name),
        upload=place,
        upload_sha256=digest,
        options=asdict(options),
        selection=told,
        email=_address(service, _text(form, "email")),
    )
    return service.jobs.submit(job)


def _options(text: str) -> Options:
    """Options that are written as JSON."""
    try:
        choices = json.loads(text or "{}")
    except (ValueError, RecursionError):
        choices = None
    if not isinstance(choices, dict):
        raise InputError('options are not a JSON object: write them like {"lod": 2}')
    given = {name: tuple(v) if isinstance(v, list) else v for name, v in choices.items()}
    return chosen(None, given)


def _written(form: FormData) -> Options:
    """Options that are written as on a command line, each in a field of its own."""
    texts = {name: _text(form, f"{OPTION}{name}") for name in OPTIONS}
    return options_from_text({name: text for name, text in texts.items() if text})


def _selection(form: FormData) -> Selection:
    """What of the image is the myocardium; words that are not known are refused here."""
    label = tuple(_line(each, "label") for each in form.getlist("label") if each)
    labels, rv_wall = _text(form, "labels") or None, _text(form, "rv_wall")
    for each in label:
        label_from_text(each)
    if labels is not None:
        scheme_from_text(labels)
    try:
        wall = float(rv_wall) if rv_wall else None
    except ValueError:
        raise InputError(f"rv_wall {rv_wall!r} is not a number: give one, mm") from None
    if wall is not None and not 0 < wall < 100:
        raise InputError(f"an RV wall of {wall} mm cannot be built: give a positive number")
    return Selection(label, labels, wall, _text(form, "frame") or None)


def _text(form: FormData, name: str) -> str:
    """A field of a form; empty if it is not there."""
    value = form.get(name) or ""
    return (value if isinstance(value, str) else "") if name == "options" else _line(value, name)


def _line(value: Any, name: str) -> str:
    """A short text."""
    try:
        return _LINE.validate_python(value).strip()
    except ValidationError:
        raise InputError(
            f"{name} is not a text of at most 200 letters without control characters: shorten it"
        ) from None


def _title(name: str) -> str:
    """What a job is called by the name of its file."""
    kept = "".join(letter for letter in name if letter.isprintable())
    return kept[:200] or "mask"


def _address(service: Service, address: str) -> str | None:
    """Where to write to, if anywhere."""
    if not address:
        return None
    if service.settings.smtp is None:
        raise InputError("this service sends no mail: leave email empty")
    try:
        return validate_email(address, check_deliverability=False).normalized
    except EmailNotValidError as error:
        raise InputError(f"email {address!r} is no address: {error}") from None
