"""Tokens, and jobs with their state."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None


def upgrade() -> None:
    """Make the tables."""
    op.create_table(
        "tokens",
        sa.Column("id", sa.String(16), primary_key=True),
        sa.Column("name", sa.String(200), nullable=False),
        sa.Column("hash", sa.String(64), nullable=False),
        sa.Column("scopes", sa.JSON(), nullable=False),
        sa.Column("created", sa.Float(), nullable=False),
        sa.Column("revoked", sa.Float()),
    )
    op.create_table(
        "jobs",
        sa.Column("id", sa.String(32), primary_key=True),
        sa.Column("owner", sa.String(16), nullable=False, index=True),
        sa.Column("idempotency_key", sa.String(200)),
        sa.Column("fingerprint", sa.String(64), nullable=False, index=True),
        sa.Column("title", sa.String(200), nullable=False),
        sa.Column("upload", sa.String(100), nullable=False),
        sa.Column("upload_sha256", sa.String(64), nullable=False, index=True),
        sa.Column("options", sa.JSON(), nullable=False),
        sa.Column("selection", sa.JSON(), nullable=False),
        sa.Column("state", sa.String(16), nullable=False),
        sa.Column("step", sa.String(40)),
        sa.Column("progress", sa.Float(), nullable=False),
        sa.Column("reason", sa.Text()),
        sa.Column("summary", sa.JSON()),
        sa.Column("starts", sa.Integer(), nullable=False),
        sa.Column("server", sa.String(32)),
        sa.Column("lease", sa.Float()),
        sa.Column("created", sa.Float(), nullable=False),
        sa.Column("started", sa.Float()),
        sa.Column("finished", sa.Float()),
        sa.UniqueConstraint("owner", "idempotency_key"),
    )
    op.create_index("jobs_queue", "jobs", ["state", "created"])
