"""The native survey format (`.moma`): reader and writer."""
