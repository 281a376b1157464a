"""Packages that are absent or cannot be loaded: what needs them says so, and what to install."""

import sys
from pathlib import Path

import numpy as np
import pytest

from ground.errors import MissingLibraryError
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.files import read_meshes, write_meshes
from mechanics.stones.meshing.mesh import VolumeMesh
from mechanics.stones.meshing.meshers.gmsh import mesh_with_gmsh

CORNERS = np.vstack([np.zeros(3), np.eye(3)])
TETRAHEDRON = VolumeMesh(Element.TET4, CORNERS, np.array([[0, 1, 2, 3]]))


@pytest.fixture(params=["absent", "unloadable"])
def without(request, monkeypatch):
    """A function after which a package cannot be imported."""

    def block(package):
        if request.param == "absent":
            monkeypatch.setitem(sys.modules, package, None)
            return
        monkeypatch.delitem(sys.modules, package, raising=False)
        folder = request.getfixturevalue("tmp_path")
        (folder / f"{package}.py").write_text("raise ImportError('no libX.so')", encoding="utf-8")
        monkeypatch.syspath_prepend(str(folder))

    return block


def test_files_of_meshes_name_meshio(without):
    without("meshio")
    for use in (read_meshes, lambda path: write_meshes(path, {"A": TETRAHEDRON})):
        with pytest.raises(MissingLibraryError, match="meshio, which is not installed; pip install meshio"):
            use(Path("stones.msh"))


def test_a_mesh_of_gmsh_names_it(without):
    without("gmsh")
    faces = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))
    with pytest.raises(MissingLibraryError, match=r"stone A: .*gmsh.*pip install gmsh"):
        mesh_with_gmsh(CORNERS, faces, 0.5, "A")
