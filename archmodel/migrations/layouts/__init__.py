"""The tables of each version of the layout, as they were declared when it was the program's."""

__all__: list[str] = []
