"""The architectural model: entities, knowledge of them, and results of runs, in a database.

Rooms, each on those above it::

    tables       what the database holds: entities, structures, relations, knowledge, surveys, runs
    database     opening it, on SQLite or PostgreSQL
    migrations   carrying it to another version of its layout
    store        stones, runs and revisions of rows, into it and out of it
    query        the query language and its API
    relations    neighbours, courses, arches and load paths computed from the geometry
    stratigraphy relations between units, their order in time, the matrix
    assertions   declaring, correcting and withdrawing knowledge
    describe     descriptions of a stone or a structure, its history and its sources
    exchange     the whole of it as one JSON document

Nothing is imported here, so that programs that need only the plain values of ``store.stone_record`` and
``store.run_record`` do not load SQLAlchemy.
"""
