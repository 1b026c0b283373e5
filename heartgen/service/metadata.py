"""What is said of a published model, by whoever publishes it and by us; also as JSON-LD."""

from __future__ import annotations

import re
import time
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, StringConstraints

from heartgen.formats import FORMATS
from heartgen.service.schemas import Line, Passage
from heartgen.service.tables import Model

FACETS = ("species", "condition", "modality", "phase", "sex", "age_band", "study", "license")
"""By which models are found, besides words."""

LICENSES = {
    "CC0-1.0": "https://creativecommons.org/publicdomain/zero/1.0/",
    "CC-BY-4.0": "https://creativecommons.org/licenses/by/4.0/",
    "CC-BY-SA-4.0": "https://creativecommons.org/licenses/by-sa/4.0/",
    "CC-BY-NC-4.0": "https://creativecommons.org/licenses/by-nc/4.0/",
    "CC-BY-NC-SA-4.0": "https://creativecommons.org/licenses/by-nc-sa/4.0/",
}
"""Under which a model may be published (SPDX), and their texts."""

Sex = Literal["female", "male", "mixed", "unknown"]

AgeBand = Literal[
    "unknown", "fetal", "0-9", "10-19", "20-29", "30-39", "40-49", "50-59", "60-69", "70-79", "80+"
]
"""Years; a band, since an exact age may tell who somebody is."""

License = Literal["CC0-1.0", "CC-BY-4.0", "CC-BY-SA-4.0", "CC-BY-NC-4.0", "CC-BY-NC-SA-4.0"]

DICOM_NAME = re.compile(r"\w\^+\w")
"""How DICOM writes names of people."""


def _nameless(text: str) -> str:
    """Refuse what looks like a name that came with an image."""
    if DICOM_NAME.search(text):
        raise ValueError("this looks like the name of a person, as DICOM writes it: leave it out")
    return " ".join(text.split())


Words = Annotated[Line, AfterValidator(_nameless)]
Named = Annotated[Words, StringConstraints(min_length=1, max_length=60)]


class Metadata(BaseModel):
    """What is said of a model by whoever publishes it. No names of people in any of it."""

    model_config = ConfigDict(extra="forbid")

    title: Annotated[Words, StringConstraints(min_length=3)]
    species: Named = "human"
    condition: Named = Field("unknown", description="Such as healthy, DCM, HCM.")
    modality: Named = Field("unknown", description="Such as cine MRI, CT.")
    phase: Named = Field("unknown", description="Such as ED, ES.")
    sex: Sex = "unknown"
    age_band: AgeBand = "unknown"
    study: Words = ""
    license: License = "CC-BY-4.0"
    citation: Passage = Field("", description="Of the data: how their makers want to be cited.")
    keywords: list[Named] = Field(default_factory=list, max_length=30)
    description: Passage = ""
    no_names: Literal[True] = Field(description="That no person is named, nor can be recognized.")


class ModelOut(BaseModel):
    """A model of the library."""

    identifier: str
    version: int
    latest: bool
    published: float
    title: str
    species: str
    condition: str
    modality: str
    phase: str
    sex: str
    age_band: str
    study: str
    license: str
    citation: str
    cite_as: str
    keywords: list[str]
    description: str
    provenance: dict[str, Any]
    url: str


class Found(BaseModel):
    """What a search found: how many, some of them, and how many there are under each facet."""

    total: int
    models: list[ModelOut]
    facets: dict[str, dict[str, int]]


def words_of(metadata: Metadata, identifier: str) -> str:
    """All that a search looks at.

    Parameters
    ----------
    metadata : Metadata
        Of a model.
    identifier : str
        Of the model.
    """
    told = metadata.model_dump(exclude={"no_names", "keywords"})
    return " ".join([identifier, *told.values(), *metadata.keywords]).lower()


def model_out(model: Model, url: str) -> ModelOut:
    """A model as the library shows it.

    Parameters
    ----------
    model : Model
        Of the database.
    url : str
        Of the service.
    """
    place = f"{url}/library/{model.identifier}/v{model.version}"
    return ModelOut(
        **{name: getattr(model, name) for name in ModelOut.model_fields if hasattr(model, name)},
        url=place,
        cite_as=cite_as(model, place),
    )


def cite_as(model: Model, place: str) -> str:
    """How to cite a model.

    Parameters
    ----------
    model : Model
        Of the database.
    place : str
        Its page.
    """
    year = time.gmtime(model.published).tm_year
    source = f" Data: {' '.join(model.citation.split())}" if model.citation else ""
    return (
        f"{model.title} ({model.identifier}, version {model.version}, {year}). heartgen model "
        f"library. {place}.{source}"
    )


def json_ld(model: Model, url: str) -> dict[str, Any]:
    """A model as a Dataset of schema.org, for those who harvest.

    Parameters
    ----------
    model : Model
        Of the database.
    url : str
        Of the service.
    """
    shown = model_out(model, url)
    files = f"{url}/v1/models/{model.identifier}/versions/{model.version}/files"
    variables = {name: getattr(model, name) for name in FACETS if name not in ("license", "study")}
    return {
        "@context": "https://schema.org/",
        "@type": "Dataset",
        "@id": shown.url,
        "identifier": model.identifier,
        "version": str(model.version),
        "name": model.title,
        "description": model.description
        or f"Personalized cubic Hermite mesh of the heart: {model.title}",
        "url": shown.url,
        "license": LICENSES[model.license],
        "keywords": list(model.keywords),
        "datePublished": time.strftime("%Y-%m-%d", time.gmtime(model.published)),
        "creditText": shown.cite_as,
        "citation": model.citation or None,
        "isAccessibleForFree": True,
        "thumbnailUrl": f"{files}/preview",
        "variableMeasured": [
            {"@type": "PropertyValue", "name": name, "value": value}
            for name, value in variables.items()
        ],
        "distribution": [
            {"@type": "DataDownload", "name": str(kind), "contentUrl": f"{files}/{name}"}
            for name, kind in FORMATS.items()
        ],
    }
