"""Contacts and results of blocks as COMPAS (compas_dem 0.6) has them: plain JSON, without COMPAS."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mechanics.arrays import Array
from pipelines.record.export.building import stable_uuid
from survey.geometry.solids import plane_frame

POISSON = 0.2
"""Poisson's ratio of the materials of compas_dem [-]."""


@dataclass(frozen=True)
class PairContact:
    """A joint of two blocks.

    Attributes
    ----------
    first, second : nodes of the blocks in the graph of the model
    name : from which identifiers follow
    centre, normal : (3,) centroid [m], unit normal from the second to the first block [-]
    area : [m²]
    points, forces : (n, 3) contact points [m] and the forces on the first block there [N]
    """

    first: int
    second: int
    name: str
    centre: Array
    normal: Array
    area: float
    points: Array
    forces: Array

    def turned(self) -> "PairContact":
        """Return the same joint seen from the other block."""
        return replace(self, first=self.second, second=self.first, normal=-self.normal, forces=-self.forces)

    def axes(self) -> Array:
        """Return two unit vectors in the joint and its normal as rows (3, 3), right-handed."""
        return plane_frame(self.normal)

    def order(self) -> list[int]:
        """Return the points in the order in which they lie around their middle."""
        arms = (self.points - self.points.mean(axis=0)) @ self.axes()[:2].T
        return [int(at) for at in np.argsort(np.arctan2(arms[:, 1], arms[:, 0]), kind="stable")]


def contact_document(contact: PairContact) -> dict[str, Any]:
    """Return a `FrictionContact` with the forces on the first block, in its frame."""
    axes, order = contact.axes(), contact.order()
    guid = str(stable_uuid("contact", contact.name))
    frame = {"point": contact.centre.tolist(), "xaxis": axes[0].tolist(), "yaxis": axes[1].tolist()}
    data = {
        "name": "FrictionContact",
        "points": [_geometry("Point", guid, at, contact.points[at].tolist()) for at in order],
        "frame": _geometry("Frame", guid, "frame", frame),
        "size": float(contact.area),
        "mesh": None,
        "holes": None,
        "forces": [_force(axes @ contact.forces[at]) for at in order],
    }
    return {"dtype": "compas_dem.interactions/FrictionContact", "data": data, "guid": guid}


def _force(local: Array) -> dict[str, float]:
    """Return a force as COMPAS splits it: along the joint, pressing and pulling."""
    return {
        "c_np": max(float(local[2]), 0.0),
        "c_nn": max(-float(local[2]), 0.0),
        "c_u": float(local[0]),
        "c_v": float(local[1]),
    }


def _geometry(kind: str, guid: str, at: object, data: object) -> dict[str, Any]:
    return {"dtype": f"compas.geometry/{kind}", "data": data, "guid": str(stable_uuid(guid, kind, str(at)))}


def transformation_document(matrix: Array, name: str) -> dict[str, Any]:
    """Return a `Transformation` of a matrix (4, 4)."""
    return _geometry("Transformation", name, "matrix", {"matrix": matrix.tolist()})


def results_document(
    guids: tuple[str, str, str],
    contacts: Iterable[PairContact],
    nodes: Mapping[int, dict[str, Any]],
    metadata: Mapping[str, Any],
    edges: frozenset[tuple[int, int]] = frozenset(),
) -> dict[str, Any]:
    """Return `compas_dem.problem/Results`.

    Two blocks that touch in several joints have one edge: its resultant is that of all, its points are those of the
    largest, and `contacts` has every one.

    Parameters
    ----------
    guids : of the results, of the model and of the problem
    contacts : joints with forces
    nodes : attributes by node
    metadata : of the run
    edges : of the graph of the model, whose directions are kept
    """
    pairs: dict[tuple[int, int], list[PairContact]] = {}
    for contact in contacts:
        seen = contact.turned() if (contact.second, contact.first) in edges else contact
        pairs.setdefault((seen.first, seen.second), []).append(seen)
    added = [list(edge) for edge in pairs if edges and edge not in edges]
    data = {
        "model_id": guids[1],
        "problem_id": guids[2],
        "displacement_scale": 1.0,
        "node_data": {str(node): attributes for node, attributes in nodes.items()},
        "edge_data": {f"{first},{second}": _edge(some) for (first, second), some in pairs.items()},
        "metadata": {**metadata, "added_edges": added} if added else dict(metadata),
    }
    return {"dtype": "compas_dem.problem/Results", "data": data, "name": "Results", "guid": guids[0]}


def _edge(contacts: Sequence[PairContact]) -> dict[str, Any]:
    """Return the attributes of an edge: resultant, points and their forces."""
    largest = max(contacts, key=lambda contact: contact.area)
    document, order = contact_document(largest), largest.order()
    local = largest.forces[order] @ largest.axes().T
    resultant = np.sum([contact.forces.sum(axis=0) for contact in contacts], axis=0)
    count = len(order)
    return {
        "contact_data": document,
        "contacts": [contact_document(contact) for contact in contacts],
        "contact_points": largest.points[order].tolist(),
        "contact_frame": document["data"]["frame"],
        "face_contact": count >= 3,
        "edge_contact": count == 2,
        "point_contact": count == 1,
        "force_normal": local[:, 2].tolist(),
        "force_tangent1": local[:, 0].tolist(),
        "force_tangent2": local[:, 1].tolist(),
        "resultant_local": (largest.axes() @ resultant).tolist(),
        "resultant_global": resultant.tolist(),
        "force_magnitude": float(np.linalg.norm(resultant)),
    }
