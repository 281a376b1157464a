"""Proposals for stones that no survey shows: the core of walls (`core`) and missing stones (`missing`)."""
