"""Mails, the library of models, and the audit log."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"

FACETS = {
    "species": 60,
    "condition": 100,
    "modality": 60,
    "phase": 60,
    "sex": 20,
    "age_band": 20,
    "study": 200,
    "license": 60,
}


def upgrade() -> None:
    """Make the tables."""
    op.add_column("jobs", sa.Column("email", sa.String(320)))
    op.create_table(
        "mails",
        sa.Column("id", sa.String(32), primary_key=True),
        sa.Column(
            "job",
            sa.String(32),
            sa.ForeignKey("jobs.id", ondelete="CASCADE"),
            nullable=False,
            unique=True,
        ),
        sa.Column("tries", sa.Integer(), nullable=False),
        sa.Column("due", sa.Float(), nullable=False, index=True),
        sa.Column("sent", sa.Float()),
        sa.Column("error", sa.Text()),
    )
    op.create_table(
        "models",
        sa.Column("id", sa.String(32), primary_key=True),
        sa.Column("identifier", sa.String(20), nullable=False, index=True),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("latest", sa.Boolean(), nullable=False),
        sa.Column("owner", sa.String(16), nullable=False),
        sa.Column("published", sa.Float(), nullable=False),
        sa.Column("title", sa.String(200), nullable=False),
        *(sa.Column(name, sa.String(n), nullable=False, index=True) for name, n in FACETS.items()),
        sa.Column("citation", sa.Text(), nullable=False),
        sa.Column("keywords", sa.JSON(), nullable=False),
        sa.Column("description", sa.Text(), nullable=False),
        sa.Column("words", sa.Text(), nullable=False),
        sa.Column("provenance", sa.JSON(), nullable=False),
        sa.UniqueConstraint("identifier", "version"),
    )
    op.create_index("models_shown", "models", ["latest", "published"])
    op.create_table(
        "audit",
        sa.Column("id", sa.Integer(), primary_key=True),
        sa.Column("at", sa.Float(), nullable=False),
        sa.Column("actor", sa.String(16), nullable=False),
        sa.Column("action", sa.String(40), nullable=False),
        sa.Column("subject", sa.String(64), nullable=False),
        sa.Column("detail", sa.JSON(), nullable=False),
    )
