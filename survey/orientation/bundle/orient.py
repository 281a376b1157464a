"""Photographs, from marks to a checked orientation: soundness, start values, adjustment, blunders, statistics."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import ThreadpoolController

from ground.errors import GeometryError, MomaError, SurveyError
from ground.statistics.scale import CONSISTENT
from survey.arrays import Array
from survey.conventions import CHECKED, CRITICAL, MOST, SIGNIFICANT, TENTH
from survey.orientation.bundle.adjustment import Prepared, Solution, adjust, prepare
from survey.orientation.bundle.agreement import (
    AGREE,
    POOR,
    SEARCHES,
    exchanged_control,
    median_misfit,
    sigma0_of,
    useful_marks,
    with_marks,
)
from survey.orientation.bundle.contradictions import (
    Blunders,
    check_contradictions,
    check_control,
    check_control_alone,
)
from survey.orientation.bundle.control import MISSES, control_remarks, control_tests
from survey.orientation.bundle.gross_errors import healed
from survey.orientation.bundle.lengths import with_lengths
from survey.orientation.bundle.soundness import check_network
from survey.orientation.bundle.start import aligned, start_values, without_start
from survey.orientation.bundle.statistics import Statistics, statistics
from survey.orientation.network import Control, Network, listed

_GOOD = 5e-4  # the same, below which no other start is tried
_LARGE = SIGNIFICANT  # σ₀ from which the model is doubted rather than the marks
_MANY = TENTH  # part of the marks left out, from which it is
_SMALL = 1500  # parameters of the cameras below which one thread of BLAS is faster than several


@dataclass(frozen=True)
class Orientation:
    """Oriented photographs with their statistics.

    Attributes
    ----------
    network : with the start values that were used
    prepared, solution, statistics : of the adjustment
    removed : marks left out as blunders, each with its standardised residual before
    suspected : marks whose standardised residual exceeds the limit, those left out among them
    remarks : what was changed or left out, in words
    left_out : photographs that were left out, with the reason
    """

    network: Network
    prepared: Prepared
    solution: Solution
    statistics: Statistics
    removed: dict[int, float]
    suspected: tuple[int, ...]
    remarks: tuple[str, ...]
    left_out: Mapping[str, str] = field(default_factory=dict)

    @property
    def scale(self) -> float:
        """Factor of standard deviations: σ₀, 1 without redundancy."""
        return self.statistics.sigma0 if self.statistics.redundancy > 0 else 1.0

    @property
    def adjusted(self) -> Network:
        """Network with the adjusted values, without the marks that were left out."""
        values, network = self.solution.unknowns, self.network
        used = np.asarray(np.isfinite(self.statistics.residuals).all(axis=1))
        pairs = zip(network.photos, values.rotation, values.station, strict=True)
        return replace(
            with_marks(network, used),
            cameras=tuple(
                replace(camera, inner=inner)
                for camera, inner in zip(network.cameras, values.inner, strict=True)
            ),
            photos=tuple(replace(photo, rotation=turn, station=place) for photo, turn, place in pairs),
            start=values.point.copy(),
        )

    @property
    def residuals(self) -> Array:
        """(n, 2) residuals of the marks on the photographs, measured minus computed, right and down [px]."""
        return self.statistics.residuals * self.network.sigma * (1.0, -1.0)


def orient(network: Network, blunders: Blunders = "report") -> Orientation:
    """Orient the photographs of a network.

    Parameters
    ----------
    network : with marks; start values are used as far as it has them
    blunders : whether marks that the test finds wrong are left out

    Raises
    ------
    SurveyError
        naming file and line, if the network is unsound, or contradicts itself
    GeometryError
        if the marks do not determine the orientation
    """
    check_network(network)
    with _few_threads(network):
        failure: MomaError | None = None
        result: Orientation | None = None
        try:
            result = _checked(network, blunders)
        except MomaError as error:
            failure = error
        if result is not None and not _doubted(result):
            return result
        if blunders == "report" and failure is not None and not isinstance(failure, GeometryError):
            raise failure
        without = healed(network, None if result is None else _removed_parts(result))
        if without is None:
            if result is None:
                assert failure is not None
                raise failure
            return result
        if blunders == "report":
            raise SurveyError(
                "; ".join(without.remarks).replace(" left out, which", ":"),
                where=network.path,
                remedy='correct it, or let it be left out: blunders = "remove"',
            ) from failure
        again = _checked(without.network, blunders)
    return replace(again, remarks=(*without.remarks, *again.remarks), left_out=without.photos)


def _doubted(result: Orientation) -> bool:
    """Return whether the marks fit badly, or so many were left out that something else is wrong."""
    return _misfits(result) or bool((_removed_parts(result) > MOST).any())


def _misfits(result: Orientation) -> bool:
    statistics_found = result.statistics
    return (statistics_found.redundancy > 0 and statistics_found.sigma0 > _LARGE) or len(
        result.removed
    ) > _MANY * len(result.network.photo)


def _removed_parts(result: Orientation) -> Array:
    """Return the part of the marks of each photograph that was left out, (nf,)."""
    network = result.network
    count = len(network.photos)
    removed = np.bincount(network.photo[list(result.removed)].astype(np.int64), minlength=count)
    return np.asarray(removed / np.maximum(np.bincount(network.photo, minlength=count), 1))


def _checked(network: Network, blunders: Blunders) -> Orientation:
    """Orient the photographs of a network that is sound, and leave out single blunders."""
    used, remarks = useful_marks(network)
    photos = network.photos
    network, prepared, solution = _oriented(network, used)
    try:
        result = statistics(network, prepared, solution)
    except GeometryError:
        if sigma0_of(prepared, solution) > AGREE:
            check_control_alone(network)
        raise
    check_control(network, solution, result, blunders)
    removed, control = dict[int, float](), network.control
    if blunders == "remove":
        network, used, prepared, solution, result = _snooped(
            network, used, prepared, solution, result, removed
        )
    remarks += _left_out(control, network, solution, result)
    remarks += _tested_control(network, solution, result)
    remarks += control_remarks(network, solution, photos)
    suspected = {*removed, *_suspects(result).tolist()}
    if removed:
        remarks.append(
            "1 mark left out as a blunder"
            if len(removed) == 1
            else f"{len(removed)} marks left out as blunders"
        )
    doubts = list[str]()
    if result.redundancy > 0 and result.sigma0 > _LARGE:
        doubts.append(f"the marks fit {result.sigma0:.1f} times worse than stated")
    if len(removed) > _MANY * len(network.photo):
        doubts.append(f"{len(removed) / len(network.photo):.0%} of the marks are left out")
    if doubts:
        remarks.append(
            f"{' and '.join(doubts)}: check the camera (calibrate c, K1), the control points, and sigma"
        )
    return Orientation(
        network, prepared, solution, result, removed, tuple(sorted(suspected)), (*network.remarks, *remarks)
    )


def _left_out(
    controls: Sequence[Control], network: Network, solution: Solution, result: Statistics
) -> list[str]:
    """Return a remark on control points that were left out, by how much the others contradict them."""
    tests = control_tests(network, solution, result)
    pairs = zip(controls, network.control, tests, strict=True)
    names = [
        f"{network.names[new.point]} ({test:.1f} σ, {1e3 * off:.3g} mm)"
        for old, new, test in pairs
        if new.check and not old.check
        for off in [float(np.linalg.norm(new.place - solution.unknowns.point[new.point]))]
    ]
    out = [new for old, new in zip(controls, network.control, strict=True) if new.check and not old.check]
    places = {gcp.point: solution.unknowns.point[gcp.point] for gcp in out}
    pair = exchanged_control(network, out, places)
    return [f"control points left out, which the others contradict: {listed(names)}{pair}"] if names else []


def _tested_control(network: Network, solution: Solution, result: Statistics) -> list[str]:
    """Return remarks on control points that miss their places by more than chance."""
    tests = control_tests(network, solution, result)
    wrong = [
        (test, gcp)
        for gcp, test in zip(network.control, tests, strict=True)
        if test > MISSES and not gcp.check
    ]
    if not wrong:
        return []
    names = [
        f"{network.names[gcp.point]} ({test:.1f} σ)" for test, gcp in sorted(wrong, key=lambda pair: -pair[0])
    ]
    return [f"control points that miss their places: {listed(names)}"]


@contextmanager
def _few_threads(network: Network) -> Iterator[None]:
    """Keep BLAS to one thread where its matrices are small."""
    limits = 1 if 6 * len(network.photos) < _SMALL else None
    with ThreadpoolController().limit(limits=limits, user_api="blas"):
        yield


def _oriented(network: Network, used: NDArray[np.bool_]) -> tuple[Network, Prepared, Solution]:
    """Adjust from the start values of the file, and from none if these lead nowhere."""
    rests: list[tuple[float, Network, Prepared, Solution]] = []
    failure: MomaError | None = None
    chosen = aligned(with_marks(network, used))
    for with_start in (True, False):
        try:
            for start in start_values(chosen if with_start else without_start(chosen)):
                candidate = replace(
                    start,
                    photo=network.photo,
                    point=network.point,
                    image=network.image,
                    sigma=network.sigma,
                    lines=network.lines,
                )
                prepared = prepare(candidate, keep=used)
                solution = with_lengths(candidate, prepared, adjust(candidate, prepared))
                rests.append((median_misfit(candidate, prepared, solution), candidate, prepared, solution))
                if rests[-1][0] < _GOOD:
                    break
        except MomaError as error:
            failure = error
        if rests and min(misfit_of[0] for misfit_of in rests) < POOR:
            break
    if not rests:
        assert failure is not None
        check_control_alone(network)
        raise failure
    misfit, candidate, prepared, solution = min(rests, key=lambda one: one[0])
    check_contradictions(network, candidate, solution, misfit, failure)
    return candidate, prepared, solution


def _suspects(result: Statistics) -> NDArray[np.intp]:
    """Return the marks whose standardised residual exceeds the limit.

    Where most residuals are larger than the marks' σ tell, that σ is taken to be too small, by the median of them all.
    """
    tests = np.abs(result.standardised)
    size = np.where(np.isfinite(tests), tests, 0.0).max(axis=1)
    return np.flatnonzero(size > CRITICAL * _scale(tests))


def _scale(tests: Array) -> float:
    sound = tests[np.isfinite(tests) & (tests > 0.0)]
    return max(1.0, CONSISTENT * float(np.median(sound))) if len(sound) else 1.0


def _snooped(
    network: Network,
    used: NDArray[np.bool_],
    prepared: Prepared,
    solution: Solution,
    result: Statistics,
    removed: dict[int, float],
) -> tuple[Network, NDArray[np.bool_], Prepared, Solution, Statistics]:
    """Leave out blunders, the worst of each photograph and point at a time, until none is left.

    A control point that misses its place by more than any mark does is left out first: otherwise its marks would be
    blamed. It then checks only.
    """
    for _ in range(SEARCHES):
        tests = np.nan_to_num(np.abs(result.standardised)).max(axis=1)
        suspects = _suspects(result)
        rays = np.bincount(network.point[used], minlength=len(network.names))
        wrong = _wrong_control(network, solution, result, rays, float(tests.max(initial=0.0)))
        if wrong is not None:
            control = tuple(
                replace(gcp, check=gcp.check or k == wrong) for k, gcp in enumerate(network.control)
            )
            network = replace(network, control=control)
            free = prepared.unknowns.free.copy()
            free[network.control[wrong].point] = True
        else:
            out = _worst_marks(network, rays, suspects[np.argsort(-tests[suspects])])
            if not out:
                break
            removed |= {k: float(tests[k]) for k in out}
            used = used.copy()
            used[out] = False
            free = prepared.unknowns.free
        prepared = prepare(network, solution.unknowns._replace(free=free), used)
        solution = with_lengths(network, prepared, adjust(network, prepared))
        result = statistics(network, prepared, solution)
    return network, used, prepared, solution, result


def _wrong_control(
    network: Network, solution: Solution, result: Statistics, rays: NDArray[np.intp], most: float
) -> int | None:
    """Return the control point that is farthest off, if it is farther off than any mark, and enough others are left.

    A point with one ray is not determined without its place: its mark is blamed.
    """
    tests = control_tests(network, solution, result)
    tests[[gcp.check or rays[gcp.point] < 2 for gcp in network.control]] = 0.0
    if not len(tests) or tests.max() <= MISSES or np.sqrt(3.0) * tests.max() <= most:
        return None
    worst = int(np.argmax(tests))
    left = [gcp.place for k, gcp in enumerate(network.control) if not gcp.check and k != worst]
    return worst if len(left) >= CHECKED else None


def _worst_marks(network: Network, rays: NDArray[np.intp], suspects: NDArray[np.intp]) -> list[int]:
    """Choose marks to leave out, the worst first: one of a photograph and of a point."""
    controlled = np.zeros(len(network.names), dtype=bool)
    controlled[[gcp.point for gcp in network.control if not gcp.check]] = True
    photos, points, out = set[int](), set[int](), list[int]()
    for k in suspects:
        f, i = int(network.photo[k]), int(network.point[k])
        if f in photos or i in points or (rays[i] < 3 and not controlled[i]):
            continue
        photos.add(f)
        points.add(i)
        out.append(int(k))
    return out
