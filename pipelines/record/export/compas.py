"""Block models and results as COMPAS (compas_dem 0.6) writes them: plain JSON, without COMPAS."""

import json
from collections.abc import Iterator
from typing import Any

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.store.stone_arrays import Faces
from archmodel.tables.entities import Entity
from archmodel.tables.runs import ContactPoint, EntityResult, JointResult
from ground.units import MEGA
from mechanics.arrays import Array
from pipelines.record.export.building import Building, stable_uuid
from pipelines.record.export.compas_contacts import (
    POISSON,
    PairContact,
    contact_document,
    results_document,
)

_MESH_DEFAULTS = {"x": 0.0, "y": 0.0, "z": 0.0}


def model_content(building: Building, session: Session) -> bytes:
    """Return a `BlockModel` with all stones; with a run, its supports and the joints with their forces."""
    guids = [str(stable_uuid("block", code)) for code in building.codes]
    kinds = dict(zip(building.codes, building.kinds, strict=True))
    supports = {code for code, kind in kinds.items() if kind == "support"}
    edges: dict[str, dict[str, Any]] = {str(row): {} for row in range(len(guids))}
    if building.run is not None:
        fixed = select(Entity.code).join(EntityResult).where(
            EntityResult.run_id == building.run, EntityResult.fidelity == "fixed"
        )  # fmt: skip
        supports |= {str(code) for code in session.scalars(fixed)}
        for contact in _contacts(building, session):
            edge = edges[str(contact.first)].setdefault(str(contact.second), {"contacts": []})
            edge["contacts"].append(contact_document(contact))
    used = building.values("material")
    names = sorted({str(name) for name in used if name is not None})
    materials = {str(stable_uuid("material", name)): _material(building, name) for name in names}
    elements = {
        guid: _block(code, guid, *building.shapes[row], code in supports, used[row])
        for row, (code, guid) in enumerate(zip(building.codes, guids, strict=True))
    }
    data: dict[str, Any] = {
        "transformation": None,
        "elements": elements,
        "materials": materials,
        "tree": {
            "attributes": {},
            "root": {
                "name": "root",
                "children": [{"name": "ElementNode", "element": guid} for guid in guids],
            },
        },
        "graph": {
            "attributes": {},
            "default_node_attributes": _MESH_DEFAULTS | {"element": None},
            "default_edge_attributes": {"modifiers": None, "contacts": None},
            "node": {str(row): {"element": guid} for row, guid in enumerate(guids)},
            "edge": edges,
            "max_node": len(guids) - 1,
        },
    }
    return _written(
        {
            "dtype": "compas_dem.models/BlockModel",
            "data": data,
            "inheritance": ["compas_model.models/Model"],
            "name": building.title,
            "guid": _model_guid(building),
        }
    )


def results_content(building: Building, session: Session) -> bytes:
    """Return the `Results` of a run: by edge of the graph its resultant, its points and their forces."""
    guids = (str(stable_uuid("results", str(building.run))), _model_guid(building))
    document = results_document(
        (*guids, str(stable_uuid("problem", str(building.run)))),
        _contacts(building, session),
        {},
        {"solver": "MOMA", "run": building.run, "outcome": building.outcome},
    )
    return _written(document)


def _model_guid(building: Building) -> str:
    return str(stable_uuid("model", building.title))


def _written(document: dict[str, Any]) -> bytes:
    return json.dumps(document, ensure_ascii=False, allow_nan=False).encode() + b"\n"


def _block(
    code: str, guid: str, vertices: Array, faces: Faces, support: bool, material: object
) -> dict[str, Any]:
    """Return a block; its mesh has the corners and the faces of the solid."""
    mesh = {
        "attributes": {},
        "default_vertex_attributes": _MESH_DEFAULTS,
        "default_edge_attributes": {},
        "default_face_attributes": {},
        "vertex": {str(at): {"x": x, "y": y, "z": z} for at, (x, y, z) in enumerate(vertices.tolist())},
        "face": {str(at): list(face) for at, face in enumerate(faces)},
        "facedata": {str(at): {} for at in range(len(faces))},
        "edgedata": {},
        "max_vertex": len(vertices) - 1,
        "max_face": len(faces) - 1,
    }
    geometry = {
        "dtype": "compas.datastructures/Mesh",
        "data": mesh,
        "inheritance": [],
        "guid": str(stable_uuid("mesh", code)),
    }
    data: dict[str, Any] = {
        "transformation": None,
        "features": [],
        "name": code,
        "material": None if material is None else str(stable_uuid("material", str(material))),
        "geometry": geometry,
        "is_support": support,
    }
    return {"dtype": "compas_dem.elements/Block", "data": data, "name": code, "guid": guid}


def _material(building: Building, name: str) -> dict[str, Any]:
    """Return a material; COMPAS has strengths and moduli in MPa."""
    material = {label: value for label, (value, _) in building.materials.get(name, {}).items()}

    def in_megapascals(label: str) -> float | None:
        """Return a property of the material [MPa]; None where not known."""
        return material[label] / MEGA if label in material else None

    data = {
        "name": name,
        "fck": in_megapascals("compressive_strength"),
        "ft": in_megapascals("tensile_strength"),
        "Ecm": in_megapascals("young"),
        "density": material.get("density"),
        "poisson": material.get("poisson", POISSON),
    }
    guid = str(stable_uuid("material", name))
    return {"dtype": "compas_dem.material/Stone", "data": data, "name": name, "guid": guid}


def _contacts(building: Building, session: Session) -> Iterator[PairContact]:
    """Yield the joints of the run that have contact points, between rows of the stones."""
    rows = {code: row for row, code in enumerate(building.codes)}
    codes = {number: str(code) for number, code in session.execute(select(Entity.id, Entity.code))}
    points: dict[int, list[ContactPoint]] = {}
    found = select(ContactPoint).where(ContactPoint.run_id == building.run, ContactPoint.joint.is_not(None))
    for contact in session.scalars(found.order_by(ContactPoint.number)):
        points.setdefault(int(contact.joint or 0), []).append(contact)
    joints = select(JointResult).where(JointResult.run_id == building.run).order_by(JointResult.number)
    for joint in session.scalars(joints):
        ends = (codes[joint.first_id], codes[joint.second_id])
        first, second = (rows.get(code) for code in ends)
        some = points.get(joint.number, [])
        if first is None or second is None or not some:
            continue
        # forces of points act on the candidate, those of the joint on its first stone
        signs = np.array([1.0 if contact.candidate_id == joint.first_id else -1.0 for contact in some])
        yield PairContact(
            first,
            second,
            "\x1f".join((*ends, str(joint.number))),
            np.array([joint.x, joint.y, joint.z]),
            np.array([joint.nx, joint.ny, joint.nz]),
            joint.area,
            np.array([[contact.x, contact.y, contact.z] for contact in some]),
            np.array([[contact.fx, contact.fy, contact.fz] for contact in some]) * signs[:, None],
        )
