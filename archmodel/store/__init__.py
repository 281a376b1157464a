"""Storage of stones, runs and revisions."""
