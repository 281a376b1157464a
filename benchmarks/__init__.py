"""How fast and how exact MOMA is beside other programs: `python -m benchmarks.NAME` from the project's root."""
