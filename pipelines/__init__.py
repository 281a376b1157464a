"""The beam: each step from a survey file to a report; the only code that knows all three pillars."""
