"""Gmsh MSH files, versions 2.2 and 4.1.

Public: `msh_bodies` (bodies); `MshFile` (sections).
"""
