"""A data file that builds the scene of a run in 3DEC 7: rigid blocks, supports, joint materials."""

from importlib.metadata import version

import numpy as np

from ground.errors import UsageError
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.laws.law import Law
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.stones.polyhedra import mass_properties
from pipelines.record.export.building import Building
from pipelines.record.export.same_scene import SameScene, is_fixed, laws_by_group


def threedec_content(building: Building, same: SameScene) -> bytes:
    """Return the data file.

    3DEC needs a stiffness in every joint. Where the law has none, it is that of the stones on both sides: Young's
    modulus over their mean size, so that the joints yield about as much as the stones would.

    Raises
    ------
    UsageError : a law has no counterpart in 3DEC
    """
    scene = same.scene
    lines = [
        f"; {_comment(building.title)}: the scene of run {same.run} of MOMA {version('moma-masonry')}, for 3DEC 7",
        "; blocks are rigid and lie as their joints were closed for that run; m, kg, s, Pa",
        "model new",
        "model large-strain on",
    ]
    groups = laws_by_group(scene, [part.block for part in same.parts])
    for part in same.parts:
        faces = " ...\n  ".join(
            "face "
            + " ".join(
                "(" + ",".join(repr(float(each)) for each in part.vertices[corner]) + ")"
                for corner in reversed(face)  # clockwise, seen from outside
            )
            for face in part.faces
        )
        lines.append(f"; {_comment(part.block.code)}")
        lines.append(
            f"block create polyhedron group 'G{groups.of[part.block.code]}' slot 'law' ...\n  {faces}"
        )
    for name, density in sorted({(p.block.material.name, p.block.material.density) for p in same.parts}):
        lines.append(f"; material {_comment(name)}")
        lines += [
            f"block property density {density!r} range id {at}"
            for at, part in enumerate(same.parts, 1)
            if part.block.material.name == name
        ]
    lines += [f"block fix range id {at}" for at, part in enumerate(same.parts, 1) if is_fixed(part.block)]
    stiffness = _stiffness(same)
    for law, pairs in groups.laws:
        properties = _law(law, *stiffness)
        for first, second in pairs:
            between = f"group-intersection 'G{first}' 'G{second}' by block slot 'law'"
            lines.append(f"block contact jmodel assign mohr range {between}")
            lines.append(f"block contact property {properties} range {between}")
    lines.append("model gravity (" + ",".join(repr(float(each)) for each in scene.gravity) + ")")
    lines += ["block mechanical damping local", "; model solve", ""]
    return "\n".join(lines).encode("utf-8")


def _comment(text: str) -> str:
    return " ".join(text.split())


def _stiffness(same: SameScene) -> tuple[float, float]:
    """Return the normal and the shear stiffness of joints without one of their own [Pa/m]."""
    each = [
        (
            part.block.material.young,
            part.block.material.poisson,
            mass_properties(np.asarray(part.vertices), tuple(map(tuple, part.faces))).volume,
        )
        for part in same.parts
    ]
    young, poisson = (float(np.mean([stiffness[at] for stiffness in each])) for at in (0, 1))
    normal = young / float(np.mean([stiffness[2] for stiffness in each])) ** (1 / 3)
    return normal, normal / (2 * (1 + poisson))


def _law(law: Law, normal: float, shear: float) -> str:
    """Return the properties of a joint with the law of Mohr and Coulomb."""
    values: dict[str, float]
    if isinstance(law, DryJoint) and not law.restitution:
        values = {"stiffness-normal": normal, "stiffness-shear": shear}
    elif isinstance(law, MortarJoint):
        values = {"stiffness-normal": normal, "stiffness-shear": shear}
        values |= {"cohesion": law.shear, "tension": law.tension}
    elif isinstance(law, ElasticJoint) and law.normal_stiffness and law.shear_stiffness:
        values = {"stiffness-normal": law.normal_stiffness, "stiffness-shear": law.shear_stiffness}
        values |= {"cohesion": law.shear, "tension": law.tension}
    else:
        raise UsageError(
            f"the law {type(law).__name__} of this scene has no counterpart in 3DEC that is written here",
            where="export",
            remedy="scenes of dry joints, of mortar, and of elastic joints with stated stiffness have",
        )
    values["friction"] = float(np.degrees(np.arctan(law.friction)))
    return " ".join(f"{name} {value!r}" for name, value in values.items())
