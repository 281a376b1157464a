"""Checking and running scenes (`moma check`, `moma run`)."""
