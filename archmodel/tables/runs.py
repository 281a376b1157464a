"""Runs and their results by entity, by joint, by contact point, by cell of disks, and by mechanism."""

from typing import Any

from sqlalchemy import ForeignKey, Index
from sqlalchemy.orm import Mapped, MappedColumn, mapped_column, relationship

from archmodel.quantities import quantities_of
from archmodel.tables.base import JSON_TYPE, Base, attribute
from archmodel.tables.entities import Entity
from archmodel.tables.entries import Entry
from archmodel.tables.structures import Structure

FIDELITIES = ("fixed", "rigid", "deformable")
"""Ways to model a stone in a run."""

STUDIED = "studied"
"""Outcome of a study, whose results of stones are shares of the variance, not motions."""


class Run(Base):
    """One simulation run.

    Attributes
    ----------
    scene, scene_text : the scene's name, and its file as it was run: all settings
    outcome : equilibrium, settled, moving, collapsed, undecided or interrupted; assessed: limit loads, pushed: a
        loading test, studied: a probability, all without steps
    steps, contacts : how many
    simulated, wall : simulated time and time of work [s]
    natural_map, penetration, balance, reaction, energy : the error measures of docs/theory.md §4 [-]
    versions : of the programs and libraries, by name
    summary : the contents of summary.json
    entry : the act of recording that it came with; its settings are those of the simulation, as run
    as_of : the last act of recording before its stones were read: what was held then is what was simulated
    """

    __tablename__ = "run"

    id: Mapped[int] = mapped_column(primary_key=True)
    entry_id: Mapped[int] = mapped_column(ForeignKey("entry.id"))
    as_of_id: Mapped[int | None] = mapped_column(ForeignKey("entry.id"))
    scene: Mapped[str]
    scene_text: Mapped[str]
    outcome: Mapped[str]
    steps: Mapped[int | None]
    contacts: Mapped[int | None]
    simulated: Mapped[float | None]
    wall: Mapped[float | None]
    natural_map: Mapped[float | None]
    penetration: Mapped[float | None]
    balance: Mapped[float | None]
    reaction: Mapped[float | None]
    energy: Mapped[float | None]
    versions: Mapped[dict[str, str]] = mapped_column(JSON_TYPE)
    summary: Mapped[dict[str, object]]

    entry: Mapped[Entry] = relationship(foreign_keys=[entry_id])
    as_of: Mapped[Entry | None] = relationship(foreign_keys=[as_of_id])
    results: Mapped[list["EntityResult"]] = relationship(back_populates="run")


def _of_stone(name: str) -> MappedColumn[Any]:
    """Declare a column by its quantity."""
    quantity = quantities_of("stone")[name]
    return attribute(quantity.unit, quantity.meaning)


class EntityResult(Base):
    """Results of one run for one entity.

    The primary key begins with the entity, so that its latest run is one step in that index. Stresses are null where
    the stone was rigid.

    Attributes
    ----------
    values : further numbers, by name
    """

    __tablename__ = "entity_result"
    __table_args__ = (Index("ix_entity_result_run_id", "run_id"),)

    entity_id: Mapped[int] = mapped_column(ForeignKey("entity.id"), primary_key=True)
    run_id: Mapped[int] = mapped_column(ForeignKey("run.id"), primary_key=True)
    von_mises_p99: Mapped[float | None] = _of_stone("von_mises_p99")
    von_mises_max: Mapped[float | None] = _of_stone("von_mises_max")
    von_mises_mean: Mapped[float | None] = _of_stone("von_mises_mean")
    displacement_max: Mapped[float] = _of_stone("displacement_max")
    contact_force_max: Mapped[float | None] = _of_stone("contact_force_max")
    values: Mapped[dict[str, float]] = mapped_column(JSON_TYPE)
    fidelity: Mapped[str] = attribute(None, "fixed, rigid or deformable", words=FIDELITIES)

    entity: Mapped[Entity] = relationship()
    run: Mapped[Run] = relationship(back_populates="results")


class StructureResult(Base):
    """Results of one run for one structure: a course, an arch, a wall.

    Attributes
    ----------
    values : by name, as in `archmodel.quantities`
    """

    __tablename__ = "structure_result"
    __table_args__ = (Index("ix_structure_result_run_id", "run_id"),)

    structure_id: Mapped[int] = mapped_column(ForeignKey("structure.id"), primary_key=True)
    run_id: Mapped[int] = mapped_column(ForeignKey("run.id"), primary_key=True)
    values: Mapped[dict[str, float]] = mapped_column(JSON_TYPE)

    structure: Mapped[Structure] = relationship()
    run: Mapped[Run] = relationship()


class JointResult(Base):
    """Result of one run for the joint of two entities.

    Attributes
    ----------
    number : of the joint in the run
    first_id, second_id : the two entities; forces act on the first
    x, y, z : centroid [m]
    nx, ny, nz : unit normal from the second to the first
    area : [m²]
    parted : it was closed at the start and is now wide open
    force_normal, force_shear : compression positive, and the size of the rest [N]
    pressure_mean, pressure_max : [Pa]; None of slivers
    kern, friction_use, slipping, open : [-]; None where there is nothing to say
    gap, opening, sliding : [m]
    width : as surveyed, which is the thickness of its mortar; None if not known [m]
    """

    __tablename__ = "joint_result"
    __table_args__ = (
        Index("ix_joint_result_first", "first_id", "run_id"),
        Index("ix_joint_result_second", "second_id", "run_id"),
    )

    run_id: Mapped[int] = mapped_column(ForeignKey("run.id"), primary_key=True)
    number: Mapped[int] = mapped_column(primary_key=True)
    first_id: Mapped[int] = mapped_column(ForeignKey("entity.id"))
    second_id: Mapped[int] = mapped_column(ForeignKey("entity.id"))
    x: Mapped[float]
    y: Mapped[float]
    z: Mapped[float]
    nx: Mapped[float]
    ny: Mapped[float]
    nz: Mapped[float]
    area: Mapped[float]
    parted: Mapped[bool]
    force_normal: Mapped[float]
    force_shear: Mapped[float]
    pressure_mean: Mapped[float | None]
    pressure_max: Mapped[float | None]
    kern: Mapped[float | None]
    friction_use: Mapped[float | None]
    slipping: Mapped[float | None]
    open: Mapped[float | None]
    gap: Mapped[float]
    opening: Mapped[float]
    sliding: Mapped[float]
    width: Mapped[float | None]

    run: Mapped[Run] = relationship()
    first: Mapped[Entity] = relationship(foreign_keys=[first_id])
    second: Mapped[Entity] = relationship(foreign_keys=[second_id])


class ContactPoint(Base):
    """One contact point at the end of a run.

    Attributes
    ----------
    number : of the point in the run
    joint : number of its joint; None between edges
    candidate_id, antagonist_id : the two entities; the force acts on the candidate
    x, y, z : [m]
    nx, ny, nz : unit normal from the antagonist to the candidate
    fx, fy, fz : mean force over the last step, world axes [N]
    area : that the point stands for; zero between edges [m²]
    gap, opening, slide : [m]
    status : open, stick, slip, bonded or broken
    """

    __tablename__ = "contact_point"
    __table_args__ = (
        Index("ix_contact_point_candidate", "candidate_id", "run_id"),
        Index("ix_contact_point_antagonist", "antagonist_id", "run_id"),
    )

    run_id: Mapped[int] = mapped_column(ForeignKey("run.id"), primary_key=True)
    number: Mapped[int] = mapped_column(primary_key=True)
    joint: Mapped[int | None]
    candidate_id: Mapped[int] = mapped_column(ForeignKey("entity.id"))
    antagonist_id: Mapped[int] = mapped_column(ForeignKey("entity.id"))
    x: Mapped[float]
    y: Mapped[float]
    z: Mapped[float]
    nx: Mapped[float]
    ny: Mapped[float]
    nz: Mapped[float]
    fx: Mapped[float]
    fy: Mapped[float]
    fz: Mapped[float]
    area: Mapped[float]
    gap: Mapped[float]
    opening: Mapped[float]
    slide: Mapped[float]
    status: Mapped[str]

    run: Mapped[Run] = relationship()
    candidate: Mapped[Entity] = relationship(foreign_keys=[candidate_id])
    antagonist: Mapped[Entity] = relationship(foreign_keys=[antagonist_id])


class CellResult(Base):
    """One cell of disks at one instant of a run: a group of disks that is followed through it.

    Attributes
    ----------
    cell : its name
    step, time : number of the step, [s]
    x, y : mean place of its disks [m]
    lambda_x, lambda_y : max - min of x and of y over that at the start [-]
    spread_x, spread_y : standard deviations of x and y over those at the start [-]
    volume, shear, turned : of the linear map nearest to the motion: change of area [-], ln of the ratio of the
        principal stretches [-], rotation [°]
    sigma_xx, sigma_yy, sigma_xy, p, q : mean stress, compression positive; (σ1 + σ2)/2, (σ1 - σ2)/2 [Pa]
    direction : of σ1 from the x axis [°]
    anisotropy, fabric_direction : of the directions of contacts [-], [°]
    a : half the difference of the principal values of the fabric over the area [1/m²]
    coordination, porosity : [-]
    """

    __tablename__ = "cell_result"

    run_id: Mapped[int] = mapped_column(ForeignKey("run.id"), primary_key=True)
    cell: Mapped[str] = mapped_column(primary_key=True)
    step: Mapped[int] = mapped_column(primary_key=True)
    time: Mapped[float]
    x: Mapped[float | None]
    y: Mapped[float | None]
    lambda_x: Mapped[float | None]
    lambda_y: Mapped[float | None]
    spread_x: Mapped[float | None]
    spread_y: Mapped[float | None]
    volume: Mapped[float | None]
    shear: Mapped[float | None]
    turned: Mapped[float | None]
    sigma_xx: Mapped[float | None]
    sigma_yy: Mapped[float | None]
    sigma_xy: Mapped[float | None]
    p: Mapped[float | None]
    q: Mapped[float | None]
    direction: Mapped[float | None]
    anisotropy: Mapped[float | None]
    fabric_direction: Mapped[float | None]
    a: Mapped[float | None]
    coordination: Mapped[float | None]
    porosity: Mapped[float | None]

    run: Mapped[Run] = relationship()


class MechanismStone(Base):
    """One entity that moves in the mechanism of a load of an assessment.

    Attributes
    ----------
    load : its name
    speed : over that of the fastest [-]
    vx, vy, vz, wx, wy, wz : velocity of its centre, and spin, the fastest corner of all at 1 [m/s, rad/s]
    """

    __tablename__ = "mechanism_stone"
    __table_args__ = (Index("ix_mechanism_stone_entity_id", "entity_id"),)

    run_id: Mapped[int] = mapped_column(ForeignKey("run.id"), primary_key=True)
    load: Mapped[str] = mapped_column(primary_key=True)
    entity_id: Mapped[int] = mapped_column(ForeignKey("entity.id"), primary_key=True)
    speed: Mapped[float]
    vx: Mapped[float]
    vy: Mapped[float]
    vz: Mapped[float]
    wx: Mapped[float]
    wy: Mapped[float]
    wz: Mapped[float]

    run: Mapped[Run] = relationship()
    entity: Mapped[Entity] = relationship()
