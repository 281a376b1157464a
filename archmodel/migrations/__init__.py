"""How databases of older layouts become those of newer ones, and back; run by `archmodel.migrations.migrate`.

`layouts` holds the tables of each version as they were declared then, `versions` the steps between them. Nothing here
may use the tables of the program as it is now: they change, these do not.
"""

__all__: list[str] = []
