"""All parts of the service that requests need, made from its settings."""

from __future__ import annotations

from heartgen.service.artifacts import Artifacts
from heartgen.service.database import Database, upgrade
from heartgen.service.jobs import Jobs
from heartgen.service.library import Library
from heartgen.service.renditions import Renditions
from heartgen.service.settings import Settings
from heartgen.service.tokens import Tokens


class Service:
    """The parts of the service.

    Parameters
    ----------
    settings : Settings
        Of the operator.

    Attributes
    ----------
    database, artifacts, jobs, tokens, renditions, library : object
        Each of the class of that name.
    secret : bytes
        Key that signs what forms bring back.
    """

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        upgrade(settings.database_url)
        self.database = Database(settings.database_url)
        self.artifacts = Artifacts(settings.data, settings.free_space)
        self.jobs = Jobs(self.database)
        self.tokens = Tokens(self.database)
        self.renditions = Renditions(self.artifacts)
        self.library = Library(self.database, self.artifacts, self.renditions, settings.url)
        self.secret = settings.secret()
