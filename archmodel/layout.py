"""All tables of the entity database, declared on one base."""

from sqlalchemy.orm import Mapped, mapped_column

from archmodel import (  # noqa: F401  (each declares its tables)
    entities,
    entries,
    knowledge,
    registered,
    relations,
    runs,
    structures,
    surveys,
)
from archmodel.base import Base

__all__ = ["SCHEMA_VERSION", "SchemaVersion", "metadata"]

SCHEMA_VERSION = 4
"""Layout of the tables that this version of MOMA reads and writes."""


class SchemaVersion(Base):
    """One row that says that this is a MOMA database, and how its tables are laid out."""

    __tablename__ = "moma_schema"

    version: Mapped[int] = mapped_column(primary_key=True)


metadata = Base.metadata
