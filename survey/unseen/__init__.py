"""Proposals for stones that no survey shows."""
