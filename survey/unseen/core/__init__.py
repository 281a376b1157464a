"""Core between the two facings of a wall."""
