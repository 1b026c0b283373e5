"""Asked by Alembic to bring a database up to date; `heartgen.service.database.upgrade` calls it."""

from __future__ import annotations

from alembic import context

from heartgen.service.tables import Base

context.configure(
    connection=context.config.attributes["connection"],
    target_metadata=Base.metadata,
    render_as_batch=True,
)
with context.begin_transaction():
    context.run_migrations()
