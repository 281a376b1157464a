"""The steps between versions, in order."""

__all__: list[str] = []
