"""Migration of databases between versions of the layout, up and down, run by Alembic.

Public: `Migration`, `migrate` (migrate); `begin_layout`, `carry`, `carry_rows`, `end_layout`, `read` (steps).
"""
