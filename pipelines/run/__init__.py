"""Checking and running scenes (`moma check`, `moma run`).

Public: `run_scene`, `RunOptions`, `RunReport` (run); `check_scene` (check); `CheckReport` (check_report); `assemble`,
`Assembly` (assemble); `problems_of`, `in_rig`, `refuse_unsound` (soundness); `modelled`, `Wishes` (fidelity);
`run_planar`, `Write` (planar); `UnfinishedRun` (unfinished).
"""
