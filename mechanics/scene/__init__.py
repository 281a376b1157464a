"""Scenes as a user states them: blocks, laws, loads, supports and settings.

Public: `Scene`, `Block`, `Part`, `Fidelity`, `ContactSettings`, `LawRule`, `TimeSettings`, `SolverSettings`
(scene); `State` (state); `Stage`, `whole_scene` (stages).
"""
