"""Diagnosis: which of several causes, each of unknown amount, explains a measured deformation, and when it acted.

Public: `Diagnosis`, `diagnose` (diagnose); `Runner`, `Trial`, `Tried`, `run_trial`, `runner` (trials); `DiagnosisFile`,
`read_diagnosis` (file).
"""
