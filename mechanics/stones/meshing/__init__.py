"""Finite-element meshes of single stones: elements, sizes, quality and files.

Public: `Element` (elements); `SolidMesh`, `VolumeMesh` (mesh); `SizeField` (sizes); `MeshQuality`, `MeshReport`,
`mesh_quality` (quality); `read_meshes`, `write_meshes` (files).
"""
