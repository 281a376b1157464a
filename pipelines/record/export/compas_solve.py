"""MOMA as a solver of COMPAS: `moma_solve(problem, model)` returns `Results`, without an import of COMPAS."""

import json
import sys
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ground.errors import UsageError
from mechanics.results.result import BodyResult, Result
from mechanics.simulate import simulate
from pipelines.record.export.building import stable_uuid
from pipelines.record.export.compas_contacts import PairContact, results_document, transformation_document
from pipelines.record.export.compas_problem import CompasProblem, read_problem


def moma_solve(problem: Any, model: Any, moving: float = 1.0, tolerance: float = 0.0) -> Any:
    """Solve a problem of compas_dem 0.6 over its block model.

    Blocks are rigid; joints have friction, with the strengths and stiffnesses that the problem states. Forces on an
    edge act on its first block, as in the results of compas_dem's other solvers.

    Parameters
    ----------
    problem, model : documents of `Problem` and `BlockModel`, as `json.loads` returns them, or as text; or objects of
        COMPAS
    moving : time in which supports reach the places that are prescribed [s]
    tolerance : distance within which faces of neighbours are brought into one plane [m], for models whose coordinates
        are rounded: twice their last digit; 0: none are

    Returns
    -------
    `Results` in the form of the problem: a document, or an object of COMPAS. Its metadata has the outcome, its reason
    and cautions, and the errors; forces of a structure that did not come to rest are those of the last step.

    Raises
    ------
    SceneError, SurveyError, GeometryError : the problem or the model cannot be simulated
    """
    read = read_problem(_document(problem), _document(model), moving, tolerance)
    result = simulate(read.scene)
    document = _results(read, result)
    if isinstance(problem, Mapping):
        return document
    text = json.dumps(document)
    if isinstance(problem, str | bytes):
        return text
    return sys.modules["compas.data"].json_loads(text)  # loaded, as the problem is one of its objects


def _document(given: Any) -> Mapping[str, Any]:
    """Return the document of an object, or of a text."""
    if hasattr(given, "to_jsonstring"):  # any object of COMPAS
        given = sys.modules["compas.data"].json_dumps(given)
    document = json.loads(given) if isinstance(given, str | bytes) else given
    if not isinstance(document, Mapping) or "data" not in document:
        remedy = "give an object of compas_dem, or what compas.json_dumps makes of it"
        raise UsageError(
            f"{type(given).__name__} is no document of COMPAS", where="moma_solve", remedy=remedy
        )
    return document


def _results(read: CompasProblem, result: Result) -> dict[str, Any]:
    nodes = [int(body.code) for body in result.bodies]
    guids = (str(stable_uuid("results", read.guid)), read.model.guid, read.guid)
    attributes = {
        node: {"transformation": transformation_document(_motion(body), f"{read.guid} {node}")}
        for node, body in zip(nodes, result.bodies, strict=True)
    }
    metadata = {
        "solver": "MOMA",
        "outcome": str(result.outcome),
        "reason": result.reason,
        "cautions": list(result.cautions),
        "balance": float(result.errors.balance),
        "natural_map": float(result.errors.natural_map),
        "weight": float(result.weight),
        "reaction": float(result.reaction),
        "volumes": {str(node): float(body.volume) for node, body in zip(nodes, result.bodies, strict=True)},
    }
    return results_document(guids, _contacts(nodes, result), attributes, metadata, read.model.edges)


def _motion(body: BodyResult) -> Any:
    """Return the rigid motion (4, 4) that takes the corners of a block from their places before to those after."""
    before, after = body.reference.mean(axis=0), body.position.mean(axis=0)
    left, _, right = np.linalg.svd((body.reference - before).T @ (body.position - after))
    handed = np.diag([1.0, 1.0, np.linalg.det(right.T @ left.T)])
    matrix = np.eye(4)
    matrix[:3, :3] = right.T @ handed @ left.T
    matrix[:3, 3] = after - matrix[:3, :3] @ before
    return matrix


def _contacts(nodes: list[int], result: Result) -> Iterator[PairContact]:
    """Yield the joints that have contact points."""
    contacts, joints = result.contacts, result.joints
    for at in range(len(joints)):
        first, second = (int(body) for body in joints.bodies[at])
        rows = np.flatnonzero(contacts.joint == at)
        if not len(rows):
            continue
        signs = np.where(contacts.bodies[rows, 0] == first, 1.0, -1.0)
        yield PairContact(
            nodes[first],
            nodes[second],
            f"{nodes[first]} {nodes[second]} {at}",
            joints.centroid[at],
            joints.frame[at, 0],
            float(joints.area[at]),
            contacts.point[rows],
            contacts.force[rows] * signs[:, None],
        )
