"""Exchange of a whole database as one JSON document."""
