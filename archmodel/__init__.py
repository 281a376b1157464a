"""The architectural model: entities, what is known of them, and what was computed, in a database.

``archmodel.database`` opens it, ``archmodel.store`` fills it, ``archmodel.query`` asks it. Nothing is
imported here, so that programs which only need the plain values of ``archmodel.records`` do not load
SQLAlchemy.
"""

__all__: list[str] = []
