"""COMPAS: blocks of `compas_dem.models/BlockModel`, of assemblies of compas_assembly, and meshes, as plain JSON.

COMPAS itself is not needed. Documents of COMPAS 1 (`value`, `dva`, `dna`) are read as those of COMPAS 2 are.
"""

import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ground.errors import SurveyError
from ground.tables.numbers import unreadable
from survey.arrays import Array
from survey.formats.solids.bodies import RawBody, check_coordinates

_REMEDY = "write a BlockModel, an Assembly or meshes with compas.json_dump"


@dataclass(frozen=True)
class CompasBlock:
    """A block, or the reason why its shape is not known.

    Attributes
    ----------
    node : number in the graph of its model
    name : as the user gave it; "block-NODE" where none was given, or several blocks have it
    vertices : (nv, 3) in the frame of the model [m]
    faces : vertex indices of each face, by its number in the mesh
    support : the block is held
    material : identifier of its material; None: none is assigned
    error : reason why it has no shape; None: it has one
    """

    node: int
    name: str
    vertices: Array
    faces: Mapping[int, tuple[int, ...]]
    support: bool = False
    material: str | None = None
    error: SurveyError | None = None


@dataclass(frozen=True)
class CompasModel:
    """Blocks in the order of their nodes, properties of materials by identifier, edges of the graph."""

    guid: str
    blocks: tuple[CompasBlock, ...]
    materials: Mapping[str, Mapping[str, Any]]
    edges: frozenset[tuple[int, int]]


def compas_bodies(path: Path) -> Iterator[RawBody]:
    """Iterate over the blocks of a file.

    Raises
    ------
    SurveyError
        if it is no document of COMPAS with blocks
    """
    try:
        document = json.loads(path.read_bytes())
    except OSError as error:
        raise unreadable(path, error, "give an existing file") from error
    except ValueError as error:
        line = f":{error.lineno}" if isinstance(error, json.JSONDecodeError) else ""
        raise SurveyError(f"this is not JSON: {error}", where=f"{path}{line}", remedy=_REMEDY) from error
    for block in read_compas(document, str(path)).blocks:
        yield RawBody(
            block.name,
            block.vertices,
            list(block.faces.values()),
            error=block.error,
            kind="support" if block.support else None,
        )


def read_compas(document: object, where: str) -> CompasModel:
    """Read a block model, an assembly, a mesh or a list of meshes.

    Parameters
    ----------
    document : as `json.loads` returns it
    where : its source, for messages

    Raises
    ------
    SurveyError
        if it is of another kind, or malformed
    """
    try:
        if isinstance(document, Mapping) and _kind(document).endswith("Model"):
            model = _block_model(document, where)
        elif isinstance(document, Mapping) and _kind(document).endswith("Assembly"):
            model = _assembly(document, where)
        else:
            model = _meshes(document if isinstance(document, list) else [document], where)
    except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
        what = f"the document is malformed: {type(error).__name__} {error}"
        raise SurveyError(what, where=where, remedy=_REMEDY) from error
    if not model.blocks:
        raise SurveyError("the document has no blocks", where=where, remedy=_REMEDY)
    return model


def _kind(document: object) -> str:
    """Return the kind of object, such as "compas_dem.models/BlockModel"; empty if there is none."""
    if not isinstance(document, Mapping):
        return ""
    return str(document.get("dtype") or document.get("datatype") or "")


def _data(document: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the data of an object; documents of COMPAS 1 have it as a value, or without a kind."""
    data = document.get("data", document.get("value", document))
    return data if isinstance(data, Mapping) else document


def _block_model(document: Mapping[str, Any], where: str) -> CompasModel:
    data = _data(document)
    graph = _data(data["graph"])
    elements: Mapping[str, Mapping[str, Any]] = data["elements"]
    places = _places(data, elements)
    carved = {
        int(end) for edges in graph["edge"].values() for end, entry in edges.items() if entry.get("modifiers")
    }
    nodes = {int(node): str(entry["element"]) for node, entry in graph["node"].items()}
    names = _names({node: elements[guid] for node, guid in nodes.items()})
    blocks = []
    for node, guid in sorted(nodes.items()):
        element = _data(elements[guid])
        geometry = element.get("geometry")
        if geometry is None:  # a group of elements
            continue
        reason = None
        if not _kind(geometry).endswith("/Mesh"):
            reason = f"its geometry is {_kind(geometry) or 'unknown'}, not a mesh"
        elif node in carved or element.get("features"):
            reason = "features or modifiers cut its mesh"
        block = _block(node, names[node], {} if reason else geometry, places[guid], where, reason)
        support, material = bool(element.get("is_support")), element.get("material")
        material = None if material is None else str(material)
        blocks.append(replace(block, support=support, material=material))
    materials = {str(guid): _data(entry) for guid, entry in (data.get("materials") or {}).items()}
    return CompasModel(str(document.get("guid", "")), tuple(blocks), materials, _edges(graph))


def _assembly(document: Mapping[str, Any], where: str) -> CompasModel:
    graph = _data(_data(document)["graph"])
    nodes = {int(node): entry for node, entry in graph["node"].items() if entry.get("block") is not None}
    names = _names({node: entry["block"] for node, entry in nodes.items()})
    blocks = (
        replace(
            _block(node, names[node], entry["block"], np.eye(4), where), support=bool(entry.get("is_support"))
        )
        for node, entry in sorted(nodes.items())
    )
    return CompasModel(str(document.get("guid", "")), tuple(blocks), {}, _edges(graph))


def _meshes(documents: Sequence[object], where: str) -> CompasModel:
    meshes = [
        document for document in documents if isinstance(document, Mapping) and "vertex" in _data(document)
    ]
    if len(meshes) < len(documents):
        kinds = sorted({_kind(document) or type(document).__name__ for document in documents})
        raise SurveyError(f"of {', '.join(kinds)} no blocks are read", where=where, remedy=_REMEDY)
    names = _names(dict(enumerate(meshes)))
    blocks = tuple(_block(node, names[node], one, np.eye(4), where) for node, one in enumerate(meshes))
    return CompasModel("", blocks, {}, frozenset())


def _edges(graph: Mapping[str, Any]) -> frozenset[tuple[int, int]]:
    return frozenset((int(start), int(end)) for start, ends in graph.get("edge", {}).items() for end in ends)


def _names(documents: Mapping[int, Mapping[str, Any]]) -> dict[int, str]:
    """Return the name of each block: COMPAS names an object after its class where the user does not."""
    given = {node: str(one.get("name") or _data(one).get("name") or "") for node, one in documents.items()}
    times = Counter(given.values())
    own = {_kind(document).rpartition("/")[2] for document in documents.values()} | {"", "None"}
    return {
        node: name if times[name] == 1 and name not in own else f"block-{node}"
        for node, name in given.items()
    }


def _places(data: Mapping[str, Any], elements: Mapping[str, Mapping[str, Any]]) -> dict[str, Array]:
    """Return by element the transformation (4, 4) into the frame of the model, that of its groups included."""
    places: dict[str, Array] = {}

    def visit(node: Mapping[str, Any], outer: Array) -> None:
        """Place the elements below a node of the tree."""
        for child in node.get("children") or ():
            guid = str(child["element"])
            places[guid] = outer @ _matrix(_data(elements[guid]).get("transformation"))
            visit(child, places[guid])

    whole = _matrix(data.get("transformation"))
    visit(_data(data["tree"])["root"], whole)
    for guid, element in elements.items():
        places.setdefault(guid, whole @ _matrix(_data(element).get("transformation")))
    return places


def _matrix(document: Mapping[str, Any] | None) -> Array:
    return np.eye(4) if document is None else np.array(_data(document)["matrix"], dtype=float)


def _block(
    node: int,
    name: str,
    mesh: Mapping[str, Any],
    place: Array,
    where: str,
    reason: str | None = None,
) -> CompasBlock:
    """Make a block of a mesh; with a reason, one without a shape."""
    if reason is not None:
        error = SurveyError(f"block {name}: {reason}", where=where, remedy="bake its shape into a mesh")
        return CompasBlock(node, name, np.zeros((0, 3)), {}, error=error)
    data = _data(mesh)
    default = data.get("default_vertex_attributes") or data.get("dva") or {}
    vertices = data["vertex"]
    row = {int(key): at for at, key in enumerate(vertices)}
    points = np.array(
        [[float(vertex.get(axis, default.get(axis, 0.0))) for axis in "xyz"] for vertex in vertices.values()]
    ).reshape(-1, 3)
    points = points @ place[:3, :3].T + place[:3, 3]
    check_coordinates(points, "vertex", f"{where}: block {name}")
    faces = {int(key): tuple(row[int(at)] for at in face) for key, face in data["face"].items()}
    return CompasBlock(node, name, points, faces)
