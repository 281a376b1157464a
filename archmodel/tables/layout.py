"""All tables of the entity database, declared on one base."""

from sqlalchemy.orm import Mapped, mapped_column

from archmodel.tables import (
    entities,  # noqa: F401
    entries,  # noqa: F401
    knowledge,  # noqa: F401
    opinions,  # noqa: F401
    registered,  # noqa: F401
    relations,  # noqa: F401
    runs,  # noqa: F401
    stratigraphy,  # noqa: F401
    structures,  # noqa: F401
    surveys,  # noqa: F401
    terms,  # noqa: F401
)
from archmodel.tables.base import Base

SCHEMA_VERSION = 2
"""Version of the layout that this program reads and writes.

A change of any table, column, key or index takes a new one: a script in `archmodel/migrations/versions`, the tables of
this version in `archmodel/migrations/layouts`, and a line in `tests/archmodel/migrations/test_layouts.py`.
"""


class SchemaVersion(Base):
    """One row that marks a MOMA database and holds the version of its layout."""

    __tablename__ = "moma_schema"

    version: Mapped[int] = mapped_column(primary_key=True)


metadata = Base.metadata
