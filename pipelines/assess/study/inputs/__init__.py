"""Uncertain inputs of a study: their distributions, their unknowns, and a scene with the values of a sample.

Public: `Distribution`, `correlation_root` (distributions); `Unknown`, `Unknowns`, `expand` (unknowns);
`changed_stones`, `realise` (realise); `MovedStones` (moved).
"""
