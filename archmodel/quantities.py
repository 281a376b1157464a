"""Catalogue of results of runs, assessments and survey reports: name, unit, meaning and label of each, stated once.

Files, pages, tables, queries, columns of the database and the documentation take them from here. The function that
computes a result of a structure stands under the same name in `pipelines.results.structure_values`.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Quantity:
    """One result.

    Attributes
    ----------
    name : in files, in columns of the database and in queries; unique among those of its bearer
    unit : SI unit; "-" of ratios, counts and directions; None of texts
    label : in a heading or a legend
    meaning : in a few words
    of : bearer of the result: stone, joint, contact, peak, run, stage, summary (where names are paths of keys), or a
        kind of structure; others are arrays of files, and rows of reports; *row* bears what names the rows of a table
    """

    name: str
    unit: str | None
    label: str
    meaning: str
    of: str

    @property
    def heading(self) -> str:
        """Label at the head of a column: with a capital, but for symbols and abbreviations.

        >>> [Quantity(label, None, label, "", "").heading for label in ("largest gap", "λx", "rms")]
        ['Largest gap', 'λx', 'rms']
        """
        capital = re.match("[a-z]{4}", self.label) is not None
        return f"{self.label[0].upper()}{self.label[1:]}" if capital else self.label

    @property
    def described(self) -> str:
        """Meaning and unit, for tables of documentation."""
        return self.meaning if self.unit is None else f"{self.meaning} [{self.unit}]"


def _of(bearer: str, table: str) -> Iterator[Quantity]:
    """Yield quantities of a bearer from lines of name, unit (none of texts), meaning and, if not the name, label."""
    for line in table.strip().splitlines():
        name, unit, meaning, *label = (" ".join(cell.split()) for cell in line.split("|"))
        yield Quantity(name, unit or None, label[0] if label else name.replace("_", " "), meaning, bearer)


QUANTITIES: tuple[Quantity, ...] = (
    *_of(
        "stone",
        """
        displacement_max | m | largest displacement of its points at the end | displacement at the end
        von_mises_max | Pa | largest Von Mises stress | largest Von Mises stress
        von_mises_mean | Pa | mean Von Mises stress | mean Von Mises stress
        contact_force_max | N | largest contact force | largest contact force
        variance_share | - | share of the variance of a study that the best measurement of the stone takes away
        von_mises_p99 | Pa | Von Mises stress that 1 % of its volume exceeds | Von Mises stress exceeded in 1 % of the \
        volume
        principal_tension | Pa | largest principal stress, positive in tension | largest tension
        principal_compression | Pa | smallest principal stress, negative in compression | largest compression
        mean_pressure | Pa | mean pressure over its volume | mean pressure
        tension_zone | - | part of its volume in tension, beyond what the error of the stress explains | volume in \
        tension
        overstressed_zone | - | part of its volume with tension above the tensile strength
        utilisation | - | largest stress over strength, in tension or compression | stress over strength
        utilisation_tension | - | largest tension over the tensile strength
        utilisation_compression | - | largest compression over the compressive strength
        stress_error | - | estimated relative error of its stress | error of the stress
        joint_pressure | Pa | largest pressure in its joints
        joint_kern | - | largest of its joints: up to 1, the resultant is within the kern
        joint_opening | m | largest opening of its joints
        joint_sliding | m | largest sliding in its joints since the start
        joint_friction_use | - | largest part of friction and cohesion that a joint of it uses
        displacement_peak | m | largest displacement of its points during the run
        displacement_peak_time | s | time of that
        relative_displacement_peak | m | largest displacement during the run, seen from the supports
        joint_opening_peak | m | largest opening of its joints during the run
        joint_sliding_peak | m | largest sliding in its joints during the run
        joint_pressure_peak | Pa | largest pressure in its joints during the run
        sag_measured | m | height of its bed above the mean of its course, as surveyed
        sag_simulated | m | the same of the movement in the run, by moma compare
        sag_sigma | m | standard deviation of their difference
        plumb_measured | m | outward position of its face from the mean of its wall, as surveyed
        plumb_simulated | m | the same of the movement in the run, by moma compare
        plumb_sigma | m | standard deviation of their difference
        von_mises_peak | Pa | largest Von Mises stress in the frames of the run
        """,
    ),
    *_of(
        "joint",
        """
        first | | code of one stone
        second | | code of the other
        x | m | centroid of the joint
        y | m | centroid of the joint
        z | m | centroid of the joint
        area | m² | of the polygon
        force_normal | N | resultant across the joint, positive in compression | normal force
        force_shear | N | resultant along the joint | shear force
        eccentricity | m | of the resultant, from the centroid; unknown without compression
        kern | - | up to 1: a linear pressure presses everywhere (rectangle of width b: 6 e/b); unknown without \
        compression | over the kern
        edge | - | 0: the resultant meets the centroid, 1: the edge, where a hinge forms | over the edge
        pressure_mean | Pa | resultant across the joint over its area | mean pressure
        pressure_max | Pa | largest of the contact points, each with its neighbours | largest pressure
        gap | m | largest gap
        opening | m | largest growth of the gap since the start; of joints found later, their gap
        sliding | m | largest slide of a contact point since the start
        slipping | - | part of the area of the contact points that slips
        open | - | part of the area of the contact points that bears nothing
        friction_use | - | shear over what friction and cohesion can bear; unknown where that is nothing | friction \
        used
        sliver | - | 1: its area is tiny beside the faces of its stones; pressure and kern say nothing
        parted | - | 1: it was closed at the start and is now wide open
        """,
    ),
    *_of(
        "joint in joints.vtu",
        """
        bodies | - | numbers of the two stones
        normal | - | from the second stone to the first
        in_kern | - | 1: it is pressed, with the resultant within the kern
        force | N | resultant
        moment | N m | about the centroid
        centre_of_pressure | m | where the resultant meets the joint; NaN without compression
        eccentricity | m | the same from the centroid, along the principal axes, the longer first
        """,
    ),
    *_of(
        "joint in the database",
        """
        width | m | as surveyed, which is the thickness of its mortar
        """,
    ),
    *_of(
        "contact",
        """
        force | N | on the first of `bodies`
        pressure | Pa | normal force over area; NaN between edges
        normal | - | towards the first of `bodies`
        gap | m | negative: overlap
        opening | m | growth of the gap since the start
        slide | m | how far the two stones have moved along each other here since the start
        area | m² | that the point stands for
        status | - | 0 open, 1 stick, 2 slip, 3 bonded, 4 broken, 5 crush
        bodies | - | numbers of the two stones
        joint | - | number in `joints.vtu`, of the joints that there are at the start; -1: none
        """,
    ),
    *_of(
        "point of a stone",
        """
        displacement | m | since the start
        velocity | m/s | at the instant of the frame
        stress | Pa | xx, yy, zz, xy, yz, zx
        von_mises | Pa | Von Mises stress | Von Mises stress
        principal | Pa | σ1 ≥ σ2 ≥ σ3
        principal_direction_1 | - | direction of σ1, the largest tension; either sense is meant
        principal_direction_3 | - | direction of σ3, the largest compression
        mean_pressure | Pa | minus a third of the trace
        utilisation | - | the larger of σ1/f_t and -σ3/f_c (Rankine)
        contact_force | N | of the contacts on the nodes of deformable stones, mean over the last step; with it and \
        the weight any program of finite elements finds the stress of a single stone again
        """,
    ),
    *_of(
        "cell of a stone",
        """
        stone | - | number of the stone in the scene, from 0
        fidelity | - | 0 fixed, 1 rigid, 2 deformable
        stress_error | - | estimated relative error of the stone's stress (Zienkiewicz & Zhu 1987)
        """,
    ),
    *_of(
        "course",
        """
        crack_width | m | of a course: largest opening of a joint of its stones at the end
        """,
    ),
    *_of(
        "peak",
        """
        displacement | m | of the points of a stone that is not fixed | Displacement
        relative_displacement | m | the same, seen from the supports | Displacement relative to the supports
        opening | m | of a joint; of joints of the start also after stones have parted | Opening of a joint
        sliding | m | in a joint; of joints of the start also after stones have parted | Sliding in a joint
        pressure | Pa | as `pressure_max` of a joint; slivers are left out | Pressure in a joint
        von_mises | Pa | of a deformable stone, in the frames | Von Mises stress
        tension | Pa | of a deformable stone, in the frames | Tension in a stone
        compression | Pa | of a deformable stone, in the frames | Compression in a stone
        reaction | N | of all supports | Reaction of the supports against gravity
        shear | N | of all supports: the base shear | Reaction of the supports across gravity
        """,
    ),
    *_of(
        "run",
        """
        natural_map | - | Distance of the contact forces from satisfying friction and non-penetration: the residual \
        η of the natural map, dimensionless. Below the solver's tolerance the step is solved. | Contact law
        penetration | - | Deepest overlap of two stones over the size of the smallest one. | Overlap
        balance | - | Unbalanced force over the stone's weight; worst stone. | Balance of each stone
        reaction | - | Reaction of the supports minus weight, over the weight. | Balance of the whole
        energy | - | Energy that no term of the balance explains, over the reference energy of the run. | Energy
        unconverged_steps | - | Steps that the solver left above its tolerance. | Unsolved steps
        stress | - | Relative error of the stress of all deformable stones, estimated from its jumps between finite \
        elements. | Stress
        """,
    ),
    *_of(
        "summary",
        """
        contacts | - | contact points at the end | Contact points
        steps | - | time steps
        time.simulated | s | time at the end | Simulated
        time.rest | s | time from which the stones rest; null where they do not
        reaction.weight | N | of the stones that are not fixed | Weight carried
        reaction.total_vertical | N | of all supports, against gravity | Reaction of the supports
        displacement.max | m | of the points of a stone that is not fixed, during the run | Largest displacement
        displacement.time | s | time of that; null at the end
        displacement.end | m | the same at the end
        settlement.max | m | largest displacement of a stone along gravity, at the end
        von_mises.p99 | Pa | that 1 % of the volume exceeds | Von Mises stress, exceeded in 1 % of the volume
        von_mises.mean | Pa | over the volume | Von Mises stress, mean
        von_mises.max | Pa | at a node | Von Mises stress, largest
        stress.tension.value | Pa | largest principal stress, positive in tension
        stress.compression.value | Pa | smallest principal stress, negative in compression
        stress.utilisation.value | - | largest stress over strength; null where no strength is known
        stress.error.value | - | largest estimated error of the stress of a stone
        joints.count | - | joints of the start, and those found later
        joints.pressed | - | of these under compression, without slivers
        joints.parted | - | of these wide open at the end and closed at the start
        joints.out_of_kern | - | of these with a resultant outside the kern, without slivers
        joints.largest_opening | m | largest growth of a gap since the start
        joints.largest_sliding | m | largest slide of a contact point since the start
        joints.largest_pressure | Pa | as `pressure_max` of a joint, without slivers
        joints.slivers.count | - | joints of no more than `limit` of the faces of their stones
        joints.slivers.pressed | - | of these under compression
        joints.slivers.force | N | sum of the resultants across slivers
        joints.slivers.largest_force | N | largest of these
        joints.slivers.largest_pressure | Pa | as `pressure_max` of a joint
        energies.external | J | work of loads and driven bodies
        energies.contact | J | work of the contacts; friction makes it negative
        energies.scheme | J | dissipated by the scheme, damping and relaxation
        tolerance.length | m | movements below it are within the solver's tolerance
        """,
    ),
    *_of(
        "stage",
        """
        outcome | | of the stage
        laid | - | stones laid, removed and held in it | Of these
        weight | N | of the stones that are not fixed | Weight
        reaction | N | of all supports, against gravity | Reaction
        displacement | m | largest of a stone since it was laid | Largest displacement
        bed | m | thickest mortar that makes up for movements before a stone was laid; negative: cut off | Thickest bed
        balance | - | unbalanced force over the stone's weight, worst stone, at the end | Balance
        """,
    ),
    *_of(
        "row",
        """
        stone | | code of a stone
        joint | | codes of its two stones
        wall | | facade, and zone where it has some
        facade | | name of the facade | Wall
        zone | | of the facade
        course | - | number of the course
        kind | | of a stone
        cell | | of disks, by its name
        stage | | of building, by its name
        stones | - | how many
        quantity | | what the row is about
        """,
    ),
    *_of(
        "cell of disks",
        """
        step | - | number of the step
        time | s | at the end of the step
        x | m | mean place of the disks
        y | m | mean place of the disks
        lambda_x | - | max - min of x over that at the start | λx
        lambda_y | - | max - min of y over that at the start | λy
        spread_x | - | standard deviation of x over that at the start
        spread_y | - | standard deviation of y over that at the start
        volume | - | change of the area by the linear map nearest to the motion
        shear | - | ln of the ratio of its principal stretches
        turned | ° | its rotation, counter-clockwise
        sigma_xx | Pa | mean stress, compression positive | σxx
        sigma_yy | Pa | mean stress, compression positive | σyy
        sigma_xy | Pa | mean stress | σxy
        p | Pa | (σ1 + σ2)/2
        q | Pa | (σ1 - σ2)/2
        direction | ° | angle of σ1 from the x axis | σ1 from x
        anisotropy | - | 2 (φ1 - φ2) of the fabric
        a | 1/m² | (f1 - f2)/2 of the fabric over the area
        fabric_direction | ° | angle of φ1 from the x axis | φ1 from x
        coordination | - | contacts that bear a force per disk
        porosity | - | share of the area that no disk fills
        """,
    ),
    *_of(
        "disks",
        """
        radius | m | of a disk
        velocity | m/s | of its centre
        spin | rad/s | counter-clockwise
        turn | rad | since the start, counter-clockwise
        pressure | Pa | mean pressure in the share of a disk; 0 where it has none
        force | N | mean force of a contact over the step
        force_normal | N | the same across the contact, positive in compression
        force_tangential | N | the same along the contact
        gap | m | negative: overlap
        """,
    ),
    *_of(
        "run of disks",
        """
        overlap.max | - | over the smallest radius | Largest overlap
        overlap.mean | - | of the contacts that touch, over all steps, over the smallest radius | Mean overlap
        natural_map.median | - | residual of the natural map, over the steps | Residual η, median
        natural_map.max | - | the largest of them | Residual η, largest
        unconverged_share | - | share of the steps above the tolerance | Unsolved steps
        energy | - | that no term of the balance explains, over the largest in play | Energy
        """,
    ),
    *_of(
        "load in assessment.json",
        """
        name | | the question | Question
        limit | - | largest load factor under which one step from rest moves nothing, by the rule that judges runs; of \
        other questions the least | Held or least
        limit_lost | - | the next that was tried; of other questions the greatest | Lost or greatest
        bound | - | load factor with associative friction, which no forces in these joints exceed | Bound
        candidate_lowest | - | load factor that other forces of the same friction hold | Lowest candidate
        held | - | largest load factor that runs hold, by `--confirm` | Runs hold
        lost | - | least that they lose | Runs lose
        tilt | ° | of the ground, that is as much as the load | Tilt
        """,
    ),
    *_of(
        "value of a code",
        """
        symbol | | as in the code
        value | | with its unit
        formula | | that gives it
        article | | of the code
        """,
    ),
    *_of(
        "check of a code",
        """
        name | | of the check | Check
        capacity | | with its unit
        demand | | with its unit
        ratio | - | capacity over demand
        passed | | the verdict | Verdict
        formula | | that gives the capacity
        article | | of the code
        """,
    ),
    *_of(
        "measure_again",
        """
        changes | | verdict that changes with it; nothing where none does | What depends on it
        reason | | why it is doubtful | Why
        action | | what to measure | What to do
        line | - | of the survey file
        """,
    ),
    *_of(
        "beds",
        """
        text | | what moved, where and by how much | Finding
        dating | | courses that were laid after it | Age
        probability | - | of as much by chance | By chance
        excluded | m | would have been found in 95 of 100 surveys, if all courses shared it | Excluded: more than
        """,
    ),
    *_of(
        "faces",
        """
        lean | ° | of the plane of the wall, outwards; in survey.json in radians | Leans out by
        scatter | m | of the faces about it | Faces scatter by
        text | | what moved, where and by how much | Finding
        probability | - | of as much by chance | By chance
        excluded | m | would have been found in 95 of 100 surveys | Excluded: lean or bulge of more than
        excluded_stone | m | the same of a single stone | a stone out by more than
        """,
    ),
    *_of(
        "odd",
        """
        text | | how the stone is out of place | Finding
        score | - | departure over its standard deviation | Significance
        """,
    ),
    *_of(
        "depths",
        """
        against | | evidence that the depth contradicts
        text | | depth, and what is expected | Finding
        score | - | difference over its standard deviation | Significance
        """,
    ),
    *_of(
        "since",
        """
        distance | m | from the place in the earlier campaign, with its standard deviation | Displacement
        score | - | the same over its standard deviation | Significance
        displacement | m | along the axes | x, y, z
        outwards | m | along the normal of its face
        significant | | moved, once in a hundred comparisons by chance | Verdict
        """,
    ),
    *_of(
        "control",
        """
        name | | of the point | Control point
        residual_x | m | site minus transformed coordinate | Residual in x
        residual_y | m | the same | y
        residual_z | m | the same | z
        standardised | - | length of the residual over its standard deviation | Test
        limit | - | that a sound point keeps below
        rejected | | left out as a blunder | Left out
        """,
    ),
    *_of(
        "evidence",
        """
        point | | name of the corner | Corner
        sigma | m | standard deviations along x, y and z | σ
        how | | it was located | Located as
        rays | | photographs, with the places on them in pixels | Marks
        """,
    ),
    *_of(
        "courses",
        """
        level | m | height of the line at its middle | Bed at
        slope | - | to the right of the viewer, with the probability of as much by chance | Slope (chance)
        sag | m | of the best parabola at mid-span, with its probability | Mid-span over chord (chance)
        rms | m | of the corners about the line
        worst | m | deviation of the farthest corner | Farthest corner
        scatter | m | of the beds | Beds scatter by
        height | m | from this bed to the next, in `course_heights` | Height to next bed
        finding | | what is found, or excluded, of the course
        """,
    ),
    *_of(
        "grade",
        """
        symbol | | of the parameter | Symbol
        parameter | | of the masonry quality index
        grade | | F fulfilled, PF partly, NF not
        text | | why | Evidence
        """,
    ),
    *_of(
        "index",
        """
        direction | | of the loads | Loads
        index | - | masonry quality index, 0 to 10
        category | | A good, B average, C inadequate
        """,
    ),
    *_of(
        "kinds",
        """
        length | m | usual length of a face, with the scatter of the stones
        height | m | usual height of a face, with the scatter of the stones
        source | | what the usual face is known from | Evidence
        odd | m | stones that differ by more than three standard deviations | Stones beyond 3 σ
        """,
    ),
    *_of(
        "contradictions",
        """
        kind | | as stated | Called
        text | | what its proportions say | But
        significance | - | excess over its standard deviation
        """,
    ),
    *_of(
        "stones",
        """
        rms | m | of the residuals of the points that were not left out
        sigma0 | - | 1 if the points are as precise as stated | σ₀
        redundancy | - | accepted points minus 3
        blunders | | points left out as blunders, and worn corners | Left out
        shape | | verdict on a plane as its shape | Face
        tilt_sigma | ° | of the less certain tilt of its plane | Tilt σ
        length | m | length and height of its face, with the standard deviation | Length × height
        deviation | m | from the usual face of its kind | Off the usual
        depth | m | with its standard deviation
        depth_source | | evidence for the depth | Evidence for the depth
        """,
    ),
    *_of(
        "photographs",
        """
        photograph | | its name
        omega | ° | turn about x | ω
        phi | ° | turn about y | φ
        kappa | ° | turn about z | κ
        x | m | place of the camera
        y | m | place of the camera
        z | m | place of the camera
        marks | - | on the photograph
        rms | px | of the residuals of its marks
        """,
    ),
    *_of(
        "camera",
        """
        parameter | | of the camera's model
        value | | in the unit of the calibration
        sigma | | in the same unit; held: not adjusted | Standard deviation
        """,
    ),
    *_of(
        "control of photographs",
        """
        id | | of the point | Point
        use | | fixed, weighted or check
        residual_x | m | given minus adjusted place | Residual in x
        residual_y | m | the same | y
        residual_z | m | the same | z
        test | - | length of the residual over its standard deviation
        """,
    ),
    *_of(
        "suspected marks",
        """
        photograph | | its name
        point | | marked on it
        line | - | of the file
        residual | px | along x and y
        test | - | residual over its standard deviation
        verdict | | suspected, or left out
        """,
    ),
    *_of(
        "correlations",
        """
        of | | camera or photograph
        a | | one parameter | Parameter
        b | | the other | and
        value | - | correlation of the two | Correlation
        """,
    ),
    *_of(
        "peak in summary.json",
        """
        value | | largest during the run | Largest
        time | s | of that | At
        stones | | the stone, or the two of the joint | Stone or joint
        end | | at the end | At the end
        """,
    ),
    *_of(
        "expected error",
        """
        value | - | against a much finer model | Error to expect
        """,
    ),
    *_of(
        "designs",
        """
        number | - | of the design point | Design point
        index | - | distance from the mean, in standard deviations | β
        probability | - | of failure, by first order | Φ(-β)
        unknowns | | those that decide, with their values | Unknowns that decide, with their values there
        """,
    ),
    *_of(
        "sobol",
        """
        input | | unknown, or group of them
        first | - | first-order index, with its interval | Alone
        total | - | total index, with its interval | With interactions
        """,
    ),
    *_of(
        "actions",
        """
        text | | what to measure | Measurement
        share | - | of the variance, to first order | Variance taken away
        """,
    ),
    *_of(
        "shares",
        """
        input | | unknown, or group of them
        share | - | of the variance
        """,
    ),
    *_of(
        "band",
        """
        parameter | | with a scatter
        scatter | - | coefficient of variation
        change | N | by one standard deviation | Change of the largest force by one standard deviation
        """,
    ),
    *_of(
        "compared wall",
        """
        chi2 | - | squared misfit of what is measured and simulated | χ²
        chi2_still | - | the same, if nothing had moved | χ² if nothing had moved
        dof | - | degrees of freedom of both | Degrees of freedom
        """,
    ),
    *_of(
        "compared course",
        """
        measured | m | as surveyed | Sag, measured
        simulated | m | the same of the run | Sag, simulated
        sigma | m | standard deviation of their difference | σ
        slope_measured | - | as surveyed | Slope, measured
        slope_simulated | - | the same of the run | Slope, simulated
        slope_sigma | - | standard deviation of their difference | σ
        """,
    ),
    *_of(
        "hypothesis",
        """
        name | | what may have moved | Hypothesis
        chi2 | - | squared misfit | χ²
        dof | - | degrees of freedom | Degrees of freedom
        probability | - | of as large a misfit by chance
        behind | - | corrected Akaike criterion over that of the best | AICc behind the best
        amplitude | | of the movement, by its name
        value | | most probable
        low | | end of its interval | From
        high | | end of its interval | To
        """,
    ),
)
"""All results."""


def quantities_of(*bearers: str) -> Mapping[str, Quantity]:
    """Return the quantities of some bearers by name; of equal names, that of the bearer named last."""
    return {one.name: one for bearer in bearers for one in QUANTITIES if one.of == bearer}


def units_of(*bearers: str) -> Mapping[str, str]:
    """Return the units by name, without those of texts, ratios and counts."""
    found = quantities_of(*bearers).values()
    return {one.name: one.unit for one in found if one.unit is not None and one.unit != "-"}
