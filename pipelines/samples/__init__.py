"""Samples that are shipped, as the generators in `synthetic/` wrote them.

Public: `WrittenSample`, `copy_sample`, `sample_names`, `write_new` (copy).
"""
