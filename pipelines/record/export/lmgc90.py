"""A Python script that builds the scene of a run with pylmgc90: rigid polyhedra, supports, contact laws."""

from importlib.metadata import version

import numpy as np

from ground.errors import UsageError
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.law import Law
from mechanics.scene.laws.mortar import MortarJoint
from pipelines.record.export.building import Building
from pipelines.record.export.same_scene import SameScene, is_fixed, laws_by_group

_HEAD = '''\
"""{title}: the scene of run {run} of MOMA {program}, for LMGC90.

Bodies are rigid and lie as their joints were closed for that run; stones that deform there are rigid here. A stone that
is not convex stands as its convex parts, which are separate bodies.
"""

import os

import numpy as np
from pylmgc90 import pre

GRAVITY = {gravity}  # m/s²
STEP = {step}  # s
DURATION = {duration}  # s
ALERT = {alert}  # m; pairs of bodies closer than this are looked at

bodies, materials, models = pre.avatars(), pre.materials(), pre.models()
laws, sights = pre.tact_behavs(), pre.see_tables()
rigid = pre.model(name="rigid", physics="MECAx", element="Rxx3D", dimension=3)
models.addModel(rigid)


def stone(material, color, vertices, faces, fixed):
    """Add a polyhedron whose faces are triangles, numbered from 1."""
    body = pre.rigidPolyhedron(
        model=rigid, material=material, color=color, generation_type="full", vertices=np.array(vertices),
        faces=np.array(faces),
    )
    if fixed:
        body.imposeDrivenDof(component=[1, 2, 3, 4, 5, 6], dofty="vlocy")
    bodies.addAvatar(body)


'''

_TAIL = """\
os.makedirs("DATBOX", exist_ok=True)
pre.writeDatbox(
    dim=3, mats=materials, mods=models, bodies=bodies, tacts=laws, sees=sights, gravy=GRAVITY, datbox_path="DATBOX"
)
"""


def lmgc90_content(building: Building, same: SameScene) -> bytes:
    """Return the script.

    Raises
    ------
    UsageError : a law has no counterpart in LMGC90
    """
    scene = same.scene
    lines = [
        _HEAD.format(
            title=building.title.replace('"""', "'''").replace("\\", "/"),
            run=same.run,
            program=version("moma-masonry"),
            gravity=[float(each) for each in scene.gravity],
            step=scene.time.step,
            duration=scene.time.duration,
            alert=scene.contact.alert_distance * _largest(same),
        )
    ]
    names = {
        name: f"MAT{at:02d}" for at, name in enumerate(sorted({p.block.material.name for p in same.parts}), 1)
    }
    densities = {part.block.material.name: part.block.material.density for part in same.parts}
    for name, short in names.items():
        lines.append(
            f"{short} = pre.material(name={short!r}, materialType='RIGID', density={densities[name]!r})  # {name!r}"
        )
        lines.append(f"materials.addMaterial({short})")
    groups = laws_by_group(scene, [part.block for part in same.parts])
    lines.append("")
    for part in same.parts:
        low = np.asarray(part.vertices).tolist()
        triangles = [
            [face[0] + 1, face[at] + 1, face[at + 1] + 1]
            for face in part.faces
            for at in range(1, len(face) - 1)
        ]
        color = _color(groups.of[part.block.code])
        lines.append(
            f"stone({names[part.block.material.name]}, {color!r}, {low}, {triangles}, {is_fixed(part.block)})"
            f"  # {part.block.code!r}"
        )
    lines.append("")
    for at, (law, pairs) in enumerate(groups.laws, 1):
        lines.append(f"law = pre.tact_behav(name='law{at:02d}', {_law(law)})")
        lines.append("laws.addBehav(law)")
        for first, second in pairs:
            lines.append(
                "sights.addSeeTable(pre.see_table(CorpsCandidat='RBDY3', candidat='POLYR', "
                f"colorCandidat={_color(first)!r}, CorpsAntagoniste='RBDY3', antagoniste='POLYR', "
                f"colorAntagoniste={_color(second)!r}, behav=law, alert=ALERT))"
            )
    return ("\n".join(lines) + "\n\n" + _TAIL).encode()


def _largest(same: SameScene) -> float:
    """Return the largest extent of a body along an axis [m]: distances of alert are relative to the size of stones."""
    return max(float(np.ptp(np.asarray(part.vertices), axis=0).max()) for part in same.parts)


def _color(group: int) -> str:
    """Return the color of five characters by which LMGC90 tells groups of bodies apart."""
    return f"G{group:04d}"


def _law(law: Law) -> str:
    """Return the arguments of a law of contact."""
    if isinstance(law, DryJoint) and not law.restitution and law.dynamic_friction is None:
        return f"law='IQS_CLB', fric={law.friction!r}"
    if isinstance(law, MortarJoint):
        dynamic = law.friction if law.dynamic_friction is None else law.dynamic_friction
        return (
            f"law='IQS_MOHR_DS_CLB', cohn={law.tension!r}, coht={law.shear!r}, dyfr={dynamic!r}, "
            f"stfr={law.friction!r}"
        )
    raise UsageError(
        f"the law {type(law).__name__} of this scene has no counterpart in LMGC90 that is written here",
        where="export",
        remedy="scenes of dry joints without restitution, and of mortar, have",
    )
