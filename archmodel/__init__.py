"""The architectural model: entities, what is known of them, and what was computed, in a database.

Where things are::

    tables       base, entries, entities, structures, relations, knowledge, surveys, runs, registered → layout
    databases    database, sqlite, postgresql, bulk; migrating, migrations/
    surveys in   records → rows, measures → store; remeasuring; hypotheses
    runs in      run_records → run_rows → store_runs
    relations    relating, arch_rows → relation_store, composing, arches, computed_values; stone_columns
    saying       declaring, arranging, statements, correcting, withdrawing, registering; recording, finding, values
    asking       query ← expressions ← grammar, tokens; scope, columns, attributes, said; functions ← places,
                 related, told, lookups, usages; geojson, schema_tree
    walking      graph, load_paths
    telling      description, description_knowledge, description_relations, run_description; history, versions,
                 wording; trace
    exchange     exchange ← exchange_writing, exchange_reading, …; exchange_schema

Nothing is imported here, so that programs which only need the plain values of ``records`` and ``run_records`` do
not load SQLAlchemy.
"""

__all__: list[str] = []
