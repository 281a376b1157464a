"""Readers and writers of photographs and their orientation, one module per format.

Public: `read_photomodeler`, `write_photomodeler` (photomodeler); `read_colmap`, `write_colmap` (colmap);
`read_metashape`,
`write_metashape` (metashape); `read_dbat`, `write_dbat` (dbat); `read_control`, `with_control`, `write_control`
(control); `read_marks` (marks); `read_orientation`, `write_orientation` (result);
`read_calibration` (opencv); `refuse_other_programs` (other_programs).
"""
