"""Text that the commands print for people."""
