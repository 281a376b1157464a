"""Result files: VTK, CSV, checkpoints, and the folder that holds them.

Public: `write_frames` (vtk); `write_vtkhdf`, `GrowingResults` (vtkhdf); `write_joints`, `write_series` (run_csv);
`joint_values`, `stone_results` (stone_values); `peak_records`, `realisations`, `rocking_caution` (peaks);
`UnstructuredGrid`, `Cells`, `write_vtu`, `write_pvd` (vtu); `replacing`, `check_replaceable` (folder);
`Checkpoints` (checkpoints).
"""
