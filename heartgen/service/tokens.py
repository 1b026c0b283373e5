"""Tokens: who may do what. Of a token the database has the hash alone."""

from __future__ import annotations

import hashlib
import hmac
import secrets
import time
from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy import select

from heartgen.errors import InputError
from heartgen.service.database import Database
from heartgen.service.tables import Token

SCOPES = {
    "jobs": "submit masks, see and cancel the own jobs, take away their results",
    "library": "search the library and take away models",
    "publish": "publish own results in the library, and withdraw them",
    "admin": "withdraw any model, export and import the library, see metrics",
}
"""What a token may be for."""

PREFIX = "hg"
"""Of all tokens, so that scanners of leaked secrets know them."""

ID_BYTES, SECRET_BYTES = 6, 32

ANONYMOUS = "anonymous"
"""Owner of what is submitted without a token."""


@dataclass(frozen=True)
class Caller:
    """Who asks.

    Attributes
    ----------
    owner : str
        Identifier of the token.
    scopes : frozenset of str
        What it is for.
    """

    owner: str
    scopes: frozenset[str]


NOBODY = Caller(ANONYMOUS, frozenset(SCOPES))
"""Who asks without a token where none is needed: the one user of this machine."""


class Tokens:
    """The tokens in a database.

    Parameters
    ----------
    database : Database
        Where their hashes are.
    """

    def __init__(self, database: Database) -> None:
        self.database = database

    def create(self, name: str, scopes: Sequence[str]) -> str:
        """Make a token; it is told once.

        Parameters
        ----------
        name : str
            Of whoever gets it, for the list.
        scopes : sequence of str
            Of `SCOPES`.
        """
        unknown = sorted(set(scopes) - set(SCOPES))
        if unknown or not scopes:
            raise InputError(
                f"scopes {', '.join(unknown) or '(none)'} are not known: choose among "
                f"{', '.join(SCOPES)}"
            )
        identifier, secret = secrets.token_hex(ID_BYTES), secrets.token_urlsafe(SECRET_BYTES)
        token = f"{PREFIX}_{identifier}_{secret}"
        with self.database.writing() as session:
            session.add(
                Token(id=identifier, name=name[:200], hash=_hash(token), scopes=sorted(set(scopes)))
            )
        return token

    def caller(self, token: str) -> Caller | None:
        """Who has a token; None if nobody has, or it was revoked.

        Parameters
        ----------
        token : str
            As it was told.
        """
        prefix, _, rest = token.partition("_")
        identifier = rest.partition("_")[0]
        if prefix != PREFIX or not identifier.isalnum() or not identifier.isascii():
            return None
        with self.database.reading() as session:
            known = session.get(Token, identifier)
        if known is None or known.revoked is not None:
            return None
        if not hmac.compare_digest(known.hash, _hash(token)):
            return None
        return Caller(known.id, frozenset(known.scopes))

    def all(self) -> Sequence[Token]:
        """All tokens, oldest first."""
        with self.database.reading() as session:
            return session.scalars(select(Token).order_by(Token.created)).all()

    def revoke(self, identifier: str) -> None:
        """Take back a token, by its identifier.

        Parameters
        ----------
        identifier : str
            As the list tells it.
        """
        with self.database.writing() as session:
            known = session.get(Token, identifier)
            if known is None:
                raise InputError(f"there is no token {identifier!r}: see heartgen token list")
            known.revoked = known.revoked or time.time()


def _hash(token: str) -> str:
    """SHA-256: tokens are long and random, so that nothing slower is needed."""
    return hashlib.sha256(token.encode("utf-8", "surrogatepass")).hexdigest()
