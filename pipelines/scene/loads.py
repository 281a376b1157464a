"""Loads and initial motions: from [[loads]] and [[throw]] of a scene file to the loads of the mechanics."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from ground.settings import Setting
from ground.toml.keys import Series, Stones, Vector, VectorSeries, keys_of
from ground.toml.schema import Key, TomlDocument
from mechanics.scene.loads.accelerogram import Accelerogram
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.gravity import GravityRamp, TiltingTable
from mechanics.scene.loads.ground_motion import Component, GroundMotion
from mechanics.scene.loads.load import Force, GravityChange, Loads, Motion
from mechanics.scene.loads.motions import ImposedMotion, settlement, spreading
from mechanics.scene.loads.record_files import read_accelerogram, read_station
from mechanics.scene.loads.record_formats import UNITS, unit_of
from mechanics.scene.loads.record_processing import band_pass, without_drift
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import Block, Fidelity
from mechanics.stones.polyhedra import mass_properties
from pipelines.scene.array_tables import ArrayTable, file_beside, read_entries
from pipelines.scene.stages import LoadTable

_TABLES = (".csv", ".txt", ".dat", ".tsv")  # endings of records that seldom state a unit

Codes = frozenset[str]
Groups = Mapping[tuple[str, ...], Sequence[Codes]]
Blocks = Mapping[str, Block]


@dataclass(frozen=True, kw_only=True)
class _Tilt:
    """Load of type tilt."""

    axis: Annotated[Vector, Setting("Axis about which the table turns, right-handed.", "-")]
    rate: Annotated[float | None, Setting("Constant rate; or give `angle`.", "°/s", above=0)] = None
    limit: Annotated[float, Setting("Angle at which a constant rate ends.", "°", above=0)] = 90.0
    start: Annotated[float, Setting("Start time of a constant rate.", "s", at_least=0)] = 0.0
    angle: Annotated[Series | None, Setting("Angle with time; or give `rate`.", "°")] = None


@dataclass(frozen=True, kw_only=True)
class _ForceLoad:
    """Load of type force."""

    stones: Annotated[Stones, Setting("Codes or expressions of the stones on which it acts.")]
    force: Annotated[VectorSeries, Setting("Force on each of them, constant or with time.", "N")]
    point: Annotated[
        Vector | None,
        Setting(
            "Point of application on a single stone, which carries it along; if not given, the centre of "
            "mass.",
            "m",
        ),
    ] = None


@dataclass(frozen=True, kw_only=True)
class _SettlementLoad:
    """Load of type settlement."""

    stones: Annotated[Stones, Setting("Codes or expressions of the fixed stones that move.")]
    displacement: Annotated[Vector, Setting("Displacement at the end.", "m")]
    duration: Annotated[float, Setting("Duration.", "s", above=0)]
    start: Annotated[float, Setting("Start time.", "s", at_least=0)] = 0.0


@dataclass(frozen=True, kw_only=True)
class _Spreading:
    """Load of type spreading."""

    first: Annotated[
        Stones, Setting("Codes or expressions of the fixed stones that move back by half of `distance`.")
    ]
    second: Annotated[Stones, Setting("Codes or expressions of those that move forward by the other half.")]
    direction: Annotated[Vector, Setting("Direction of the second ones; its length does not matter.", "-")]
    distance: Annotated[float, Setting("Distance by which the groups part.", "m")]
    duration: Annotated[float, Setting("Duration.", "s", above=0)]
    start: Annotated[float, Setting("Start time.", "s", at_least=0)] = 0.0


@dataclass(frozen=True, kw_only=True)
class _MotionLoad:
    """Load of type motion."""

    stones: Annotated[Stones, Setting("Codes or expressions of the fixed stones that move.")]
    velocity: Annotated[VectorSeries, Setting("Velocity, constant or with time.", "m/s")] = (0.0, 0.0, 0.0)
    spin: Annotated[Series, Setting("Angular velocity, constant or with time; needs `pivot`.", "°/s")] = 0.0


@dataclass(frozen=True, kw_only=True)
class _Pivot:
    """Place of the axis of a spin."""

    pivot: Annotated[Vector | None, Setting("A point of that axis at the start.", "m")] = None


@dataclass(frozen=True, kw_only=True)
class _GroundMotionLoad:
    """Load of type ground_motion."""

    stones: Annotated[Stones, Setting("Codes or expressions of the fixed stones that move.")]
    x: Annotated[
        str | None,
        Setting("File of the record along x: of PEER, ESM or ITACA, K-NET, SMC, MiniSEED, SAC, or a table."),
    ] = None
    y: Annotated[str | None, Setting("File of the record along y.")] = None
    z: Annotated[str | None, Setting("File of the record along z.")] = None
    station: Annotated[
        str | None,
        Setting(
            "Instead of x, y and z: all components of one station, e.g. `IT.AQV.*.ASC`; east is x, north is "
            "y."
        ),
    ] = None
    unit: Annotated[
        str | None,
        Setting(
            "Unit of the acceleration in files that state none: `g`, `%g`, `m/s²`, `cm/s²`, `mm/s²` or "
            "`gal`, in any spelling (`m/s2`, `m/s^2`, `m s⁻²`)."
        ),
    ] = None
    dt: Annotated[float | None, Setting("Time step of records in files that state none.", "s", above=0)] = (
        None
    )
    azimuth: Annotated[float, Setting("Angle by which x and y are first turned about z.", "°")] = 0.0


@dataclass(frozen=True, kw_only=True)
class _RecordProcessing:
    """Filter and correction of records."""

    low: Annotated[float | None, Setting("Lower corner of a Butterworth filter, if any.", "Hz", above=0)] = (
        None
    )
    high: Annotated[float | None, Setting("Upper corner of a Butterworth filter, if any.", "Hz", above=0)] = (
        None
    )
    order: Annotated[int, Setting("Order of the filter, applied both ways.", at_least=1, at_most=10)] = 4
    baseline: Annotated[
        int,
        Setting(
            "Degree of the polynomial that is subtracted from the displacement, at least 2; 0: none.",
            at_least=0,
            at_most=12,
        ),
    ] = 0


LOAD_TYPES: Mapping[str, tuple[Key, ...]] = {
    "gravity_ramp": keys_of(GravityRamp),
    "tilt": keys_of(_Tilt),
    "force": (*keys_of(_ForceLoad), *keys_of(StoneForce)),
    "settlement": keys_of(_SettlementLoad),
    "spreading": keys_of(_Spreading),
    "motion": (*keys_of(_MotionLoad), *keys_of(ImposedMotion), *keys_of(_Pivot)),
    "ground_motion": (*keys_of(_GroundMotionLoad), *keys_of(GroundMotion), *keys_of(_RecordProcessing)),
}

LOAD_KEYS = keys_of(LoadTable)
"""Keys of every load."""


@dataclass(frozen=True, kw_only=True)
class _Confirmed:
    """Runs of a candidate."""

    confirm: Annotated[bool, Setting("Confirm the candidate by runs, as `--confirm` does for all loads.")] = (
        False
    )
    pushover: Annotated[bool, Setting("Lead the mechanism to collapse by a run: the capacity curve.")] = False


@dataclass(frozen=True, kw_only=True)
class _Checked(_Confirmed):
    """Runs of a candidate, and its check by a code."""

    code: Annotated[
        str | None,
        Setting(
            "Check the mechanism by this code, for the place of `[site]`, as `--code` does for all pushes on "
            "all stones."
        ),
    ] = None


_RUNS, _CHECKS = keys_of(_Confirmed), keys_of(_Checked)


@dataclass(frozen=True, kw_only=True)
class _HorizontalPush:
    """Question of type horizontal."""

    direction: Annotated[Vector, Setting("Direction of the push, λ times the weight of each stone.", "-")]
    stones: Annotated[
        Stones, Setting("Codes or expressions of the stones on which it acts; if not given, on all.")
    ] = ()


@dataclass(frozen=True, kw_only=True)
class _TiltQuestion:
    """Question of type tilt."""

    axis: Annotated[Vector, Setting("Axis about which the table turns, right-handed; its tangent is λ.", "-")]


@dataclass(frozen=True, kw_only=True)
class _WeightQuestion:
    """Question of type weight."""

    stones: Annotated[
        Stones, Setting("Codes or expressions of the stones whose weight grows by λ of itself.")
    ]


@dataclass(frozen=True, kw_only=True)
class _ForceQuestion:
    """Question of type force."""

    stones: Annotated[
        Stones, Setting("Codes or expressions of the stones on which it acts, spread as their weight is.")
    ]
    force: Annotated[Vector, Setting("Force on all of them at λ = 1.", "N")]
    point: Annotated[
        Vector | None, Setting("Where it acts on a single stone; if not given, at the centre of mass.", "m")
    ] = None


@dataclass(frozen=True, kw_only=True)
class _ThrustQuestion:
    """Question of type thrust."""

    stones: Annotated[Stones, Setting("Codes or expressions of the fixed stones on which it acts.")]
    direction: Annotated[Vector, Setting("Direction in which the thrust counts.", "-")]


@dataclass(frozen=True, kw_only=True)
class _SettlementQuestion:
    """Question of type settlement."""

    stones: Annotated[Stones, Setting("Codes or expressions of the fixed stones on which it acts.")]
    direction: Annotated[Vector, Setting("Direction in which they yield.", "-")]


ASSESS_TYPES: Mapping[str, tuple[Key, ...]] = {
    "horizontal": (*keys_of(_HorizontalPush), *_CHECKS),
    "tilt": (*keys_of(_TiltQuestion), *_CHECKS),
    "weight": (*keys_of(_WeightQuestion), *_RUNS),
    "force": (*keys_of(_ForceQuestion), *_RUNS),
    "thrust": keys_of(_ThrustQuestion),
    "settlement": keys_of(_SettlementQuestion),
    "thickness": (),
}


@dataclass(frozen=True, kw_only=True)
class _Throw:
    """Table [[throw]]."""

    stones: Annotated[Stones, Setting("Codes or expressions of the stones that begin in motion.")]
    velocity: Annotated[Vector, Setting("Velocity of the centre of mass.", "m/s")] = (0.0, 0.0, 0.0)
    spin: Annotated[Vector, Setting("Angular velocity about the axes x, y, z.", "°/s")] = (0.0, 0.0, 0.0)


THROW_KEYS = keys_of(_Throw)


def read_loads(document: TomlDocument, toml: Mapping[str, Any]) -> tuple[ArrayTable, ...]:
    """Check all loads and read their records; their stones are still expressions."""
    entries = read_entries(document, toml, "loads", LOAD_TYPES, LOAD_KEYS)
    for entry in entries:
        if entry.type == "tilt" and (entry.values["rate"] is None) == (entry.values["angle"] is None):
            document.fail("a tilt by rate or by angle", *entry.path, remedy="give either 'rate' or 'angle'")
        if entry.type == "motion" and entry.values["pivot"] is None and entry.values["spin"].value.any():
            document.fail("a spin without a pivot", *entry.path, "spin", remedy="give a point of its axis")
    return tuple(
        _with_records(document, entry) if entry.type == "ground_motion" else entry for entry in entries
    )


def read_throws(document: TomlDocument, toml: Mapping[str, Any]) -> tuple[ArrayTable, ...]:
    """Check all initial motions; their stones are still expressions."""
    return read_entries(document, toml, "throw", {"throw": THROW_KEYS})


def build_loads(
    document: TomlDocument, entries: Iterable[ArrayTable], groups: Groups, blocks: Blocks
) -> Loads:
    """Return the loads on the blocks, given by code; `groups` are the codes that each entry names.

    Raises
    ------
    SceneError : at the entry whose stones do not suit it
    """
    gravity: list[GravityChange] = []
    forces: list[Force] = []
    motions: list[Motion] = []
    supports: dict[str, str] = {}
    for entry in entries:
        codes, values = groups[entry.path], entry.values
        with document.at(*entry.path):
            if entry.type in _GRAVITY:
                gravity.append(_GRAVITY[entry.type](values))
            elif entry.type in FORCES:
                _check_rigid(document, entry, codes[0], blocks)
                forces.append(FORCES[entry.type](document, entry, codes[0], blocks))
            else:
                _check_supports(document, entry, codes, blocks, supports)
                motions += _MOTIONS[entry.type](values, codes)
    return Loads(tuple(gravity), tuple(forces), tuple(motions))


def thrown(
    document: TomlDocument, entries: Iterable[ArrayTable], groups: Groups, blocks: Blocks
) -> dict[str, tuple[float, ...]]:
    """Return the initial velocity (6,) [m/s, rad/s] of every stone that begins in motion, by code."""
    thrown_stones: dict[str, tuple[float, ...]] = {}
    for entry in entries:
        velocity = (*entry.values["velocity"], *(float(np.radians(angle)) for angle in entry.values["spin"]))
        for code in sorted(groups[entry.path][0]):
            if blocks[code].fidelity is Fidelity.FIXED:
                what = f"stone {code} is thrown, but it is fixed"
                document.fail(what, *entry.path, "stones", remedy="leave it out, or let it be rigid")
            if code in thrown_stones:
                document.fail(f"stone {code} is thrown twice", *entry.path, "stones", remedy="name it once")
            thrown_stones[code] = velocity
    return thrown_stones


def _with_records(document: TomlDocument, entry: ArrayTable) -> ArrayTable:
    """Return the entry with records in place of their file names."""
    values = dict(entry.values)
    axes = [axis for axis in "xyz" if values[axis] is not None]
    if bool(axes) == (values["station"] is not None):
        document.fail(
            "a ground motion without a record" if not axes else "records by axes and by station",
            *entry.path,
            remedy="give at least one of x, y, z, or station",
        )
    if values["unit"] is not None and unit_of(values["unit"]) is None:
        remedy = f"give {', '.join(UNITS)}"
        document.fail(f"unknown unit {values['unit']!r}", *entry.path, "unit", remedy=remedy)
    for axis in axes:
        path = file_beside(document, values[axis])
        if values["unit"] is None and path.suffix.lower() in _TABLES and not path.exists():
            what = f"the unit of the acceleration in {values[axis]!r} is not known, and there is no such file"
            document.fail(what, *entry.path, axis, remedy="give 'unit', and check the path")
        record = read_accelerogram(path, values["unit"], values["dt"], axis)
        with document.at(*entry.path, axis):
            values[axis] = _processed(record, values)
    if not axes:
        accelerograms = read_station(file_beside(document, values["station"]), values["unit"], values["dt"])
        with document.at(*entry.path, "station"):
            values["station"] = tuple(_processed(record, values) for record in accelerograms)
    return ArrayTable(entry.path, entry.type, values, entry.groups)


def _processed(record: Accelerogram, values: Mapping[str, Any]) -> Accelerogram:
    """Return a record filtered and corrected as the keys of its load ask for."""
    if values["low"] is not None or values["high"] is not None:
        record = band_pass(record, values["low"], values["high"], values["order"])
    return without_drift(record, values["baseline"]) if values["baseline"] else record


def _tilt(values: Mapping[str, Any]) -> TiltingTable:
    if values["angle"] is None:
        return TiltingTable.at_rate_degrees(values["axis"], values["rate"], values["limit"], values["start"])
    return TiltingTable(values["axis"], _in_radians(values["angle"]))


def _gravity_ramp(values: Mapping[str, Any]) -> GravityRamp:
    return GravityRamp(values["duration"])


_GRAVITY: Mapping[str, Callable[[Mapping[str, Any]], GravityChange]] = {
    "gravity_ramp": _gravity_ramp,
    "tilt": _tilt,
}


def _force(document: TomlDocument, entry: ArrayTable, codes: Codes, blocks: Blocks) -> StoneForce:
    values, point = entry.values, entry.values["point"]
    if point is None:
        return StoneForce(codes, values["force"], follows=values["follows"])
    if len(codes) > 1:
        what = f"one point for {len(codes)} stones"
        document.fail(what, *entry.path, "point", remedy="name one stone, or leave the point out")
    (code,) = codes
    block = blocks[code]
    x, y, z = (np.array(point) - mass_properties(block.vertices, block.faces, code).centroid).tolist()
    return StoneForce(codes, values["force"], (x, y, z), values["follows"])


FORCES: Mapping[str, Callable[[TomlDocument, ArrayTable, Codes, Blocks], Force]] = {"force": _force}
"""Loads that push stones, which stay rigid, by their type."""


def _check_rigid(document: TomlDocument, entry: ArrayTable, codes: Codes, blocks: Blocks) -> None:
    """Refuse a force on stones that are not rigid."""
    for code in sorted(codes):
        if blocks[code].fidelity is not Fidelity.RIGID:
            what = f"a force on stone {code}, which is {blocks[code].fidelity}"
            document.fail(what, *entry.path, "stones", remedy="forces act on rigid stones; leave it out")


def _check_supports(
    document: TomlDocument, entry: ArrayTable, groups: Sequence[Codes], blocks: Blocks, taken: dict[str, str]
) -> None:
    """Refuse to move stones that are not fixed, or are moved by another load; `taken` maps codes to loads."""
    for (key, _), codes in zip(entry.groups, groups, strict=True):
        for code in sorted(codes):
            if blocks[code].fidelity is not Fidelity.FIXED:
                what = f"stone {code} is to be moved, but it is {blocks[code].fidelity}"
                document.fail(what, *entry.path, key, remedy="name it under 'fixed' in [bodies]")
            if code in taken:
                what = f"stone {code} is moved by two loads, {taken[code]} and {entry.type}"
                document.fail(what, *entry.path, key, remedy="name it in one of them")
            taken[code] = entry.type


def _settlement(values: Mapping[str, Any], groups: Sequence[Codes]) -> tuple[Motion, ...]:
    return (settlement(groups[0], values["displacement"], values["duration"], values["start"]),)


def _spreading(values: Mapping[str, Any], groups: Sequence[Codes]) -> tuple[Motion, ...]:
    names = ("direction", "distance", "duration", "start")
    return spreading(groups[0], groups[1], **{name: values[name] for name in names})


def _motion(values: Mapping[str, Any], groups: Sequence[Codes]) -> tuple[Motion, ...]:
    pivot = values["pivot"] or (0.0, 0.0, 0.0)
    spin = _in_radians(values["spin"])
    return (ImposedMotion(groups[0], values["velocity"], spin, values["axis"], pivot),)


def _ground_motion(values: Mapping[str, Any], groups: Sequence[Codes]) -> tuple[Motion, ...]:
    turn = np.radians(values["azimuth"])
    along, across = (np.cos(turn), np.sin(turn), 0.0), (-np.sin(turn), np.cos(turn), 0.0)
    directions = {"x": along, "y": across, "z": (0.0, 0.0, 1.0)}
    components = tuple(
        Component(directions[axis], values[axis]) for axis in "xyz" if values[axis] is not None
    )
    axes = np.array([directions[axis] for axis in "xyz"])
    components += tuple(
        Component(tuple((np.array(record.direction) @ axes).tolist()), record)
        for record in values["station"] or ()
    )
    return (GroundMotion(groups[0], components, values["scale"], values["start"]),)


_MOTIONS: Mapping[str, Callable[[Mapping[str, Any], Sequence[Codes]], tuple[Motion, ...]]] = {
    "settlement": _settlement,
    "spreading": _spreading,
    "motion": _motion,
    "ground_motion": _ground_motion,
}


def _in_radians(history: History) -> History:
    return History(history.time, np.radians(history.value), history.outside)
