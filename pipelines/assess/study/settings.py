"""Settings of a study: its method, its uncertain inputs, their correlation, and the quantities that are asked for."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

from ground.settings import Setting
from survey.conventions import FEW

Texts = tuple[str, ...]


class Method(StrEnum):
    """Way from inputs to a probability."""

    MONTE_CARLO = "monte_carlo"
    LATIN_HYPERCUBE = "latin_hypercube"
    SOBOL = "sobol"
    FIRST_ORDER = "first_order"
    FORM = "form"
    SUBSET = "subset"


class InputType(StrEnum):
    """Thing that is not known."""

    FRICTION = "friction"
    COHESION = "cohesion"
    TENSION = "tension"
    STIFFNESS = "stiffness"
    DENSITY = "density"
    STRENGTH = "strength"
    YOUNG = "young"
    LOAD = "load"
    DIRECTION = "direction"
    RECORD = "record"
    DEPTH = "depth"
    PLANE = "plane"
    POINT = "point"
    STATION = "station"


class Shape(StrEnum):
    """Distribution of an input."""

    NORMAL = "normal"
    LOGNORMAL = "lognormal"
    UNIFORM = "uniform"
    TRIANGULAR = "triangular"


class Acts(StrEnum):
    """Effect of an input on what the scene and the survey state."""

    VALUE = "value"
    FACTOR = "factor"
    CHANGE = "change"


@dataclass(frozen=True)
class StudyTable:
    """Table [study]."""

    scene: Annotated[str, Setting("Scene file, beside this one.")]
    method: Annotated[
        Method,
        Setting(
            "monte_carlo; latin_hypercube; sobol: shares of the variance, with interactions; first_order: from one "
            "gradient; form: design points, and samples about them; subset: small probabilities without gradients."
        ),
    ] = Method.MONTE_CARLO
    samples: Annotated[
        int,
        Setting(
            "Samples; with sobol, of each of two sets; with form, about the design points; with subset, of each level.",
            at_least=2,
            at_most=10_000_000,
        ),
    ] = 500
    controls: Annotated[
        int,
        Setting(
            "Further samples of the first bound among the quantities, alone: its mean, so known better, corrects those "
            "of the others. 0: none.",
            at_least=0,
            at_most=10_000_000,
        ),
    ] = 0
    seed: Annotated[int, Setting("Seed of the random numbers.", at_least=0)] = 1
    confidence: Annotated[float, Setting("Confidence of intervals.", "-", above=0.5, below=1)] = 1.0 - FEW


@dataclass(frozen=True)
class InputTable:
    """Table of [[inputs]]."""

    type: Annotated[
        InputType,
        Setting(
            "friction, cohesion, tension, stiffness: of joints; density, strength (in compression), young: of stones; "
            "load: factor of entries of [[loads]]; direction: angle by which pushes turn about the vertical [°]; "
            "record: file of a folder; depth: behind the face; plane: height and tilts of each face by the survey's "
            "covariance; point: measured corners of each face; station: shift of all that a station measured."
        ),
    ]
    name: Annotated[str | None, Setting("Name in reports; if not given, the type.")] = None
    distribution: Annotated[Shape, Setting("Distribution of what its stones have in common.")] = Shape.NORMAL
    acts: Annotated[
        Acts, Setting("It replaces the value of the scene or survey, multiplies it, or is added to it.")
    ] = Acts.VALUE
    mean: Annotated[
        float | None,
        Setting("Mean; if not given, the value of the scene or survey, 1 of a factor, 0 of a change."),
    ] = None
    sigma: Annotated[
        float | None, Setting("Standard deviation; of depths, if not given, that of the survey.", at_least=0)
    ] = None
    cov: Annotated[float | None, Setting("Standard deviation over the mean.", "-", at_least=0)] = None
    low: Annotated[float | None, Setting("Least value, of uniform and triangular ones.")] = None
    high: Annotated[float | None, Setting("Largest value, of uniform and triangular ones.")] = None
    mode: Annotated[float | None, Setting("Most probable value, of triangular ones.")] = None
    scatter: Annotated[
        float, Setting("Standard deviation of each stone about what its stones have in common.", at_least=0)
    ] = 0.0
    stones: Annotated[
        Texts, Setting("Codes or expressions of the stones, and of joints that have one of them; none: all.")
    ] = ()
    rule: Annotated[
        str | None, Setting("Depths that come from this rule of the survey alone, as its source is written.")
    ] = None
    law: Annotated[
        int | None,
        Setting("Joints of this entry of [[laws]], from 1; 0: of [contact]; if not given, all.", at_least=0),
    ] = None
    entry: Annotated[int | None, Setting("Entry of [[loads]], from 1.", at_least=1)] = None
    folder: Annotated[str | None, Setting("Folder of records, each as probable as the others.")] = None


@dataclass(frozen=True)
class CorrelationTable:
    """Table of [[correlations]]."""

    inputs: Annotated[Texts, Setting("Names of two or more inputs.")]
    value: Annotated[
        float | None, Setting("Correlation of each pair of the group.", "-", at_least=-1, at_most=1)
    ] = None
    matrix: Annotated[
        tuple[float, ...], Setting("Or their matrix of correlations, row by row in one list.", "-")
    ] = ()


class QuantityType(StrEnum):
    """Thing that is asked for."""

    BOUND = "bound"
    CANDIDATE = "candidate"
    HELD = "held"
    FACTOR = "factor"
    OUTCOME = "outcome"
    SUMMARY = "summary"
    AGGREGATE = "aggregate"


@dataclass(frozen=True)
class QuantityTable:
    """Table of [[quantities]]."""

    type: Annotated[
        QuantityType,
        Setting(
            "bound, candidate, held: limit load λ by the programme of associative friction, by Coulomb's, and by steps "
            "from rest; factor: geometric factor of safety; outcome: 1 where a run comes to rest, 0 where stones fall; "
            "summary: a number of the summary of a run; aggregate: of an attribute of stones."
        ),
    ]
    name: Annotated[str | None, Setting("Name in reports; if not given, type and load.")] = None
    load: Annotated[
        str | None, Setting('Load of a limit, as of `moma assess --load`: "horizontal x", "tilt y".')
    ] = None
    key: Annotated[
        str | None, Setting("Key of the summary, with dots; or attribute of stones, such as depth or area.")
    ] = None
    of: Annotated[str, Setting("sum, mean, min or max, of an aggregate.")] = "mean"
    stones: Annotated[Texts, Setting("Codes of the stones of an aggregate; none: all.")] = ()
    fails_below: Annotated[float | None, Setting("It fails where the quantity is less.")] = None
    fails_above: Annotated[float | None, Setting("It fails where the quantity is more.")] = None
    levels: Annotated[
        tuple[float, ...], Setting("Levels at which the fragility curve is given; none: chosen.")
    ] = ()
