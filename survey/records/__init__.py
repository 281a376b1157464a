"""The content of a survey file, before anything is computed."""
