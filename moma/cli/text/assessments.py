"""Assessments and comparisons in words."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pipelines.assess.assess import Assessment
    from pipelines.assess.compare import SurveyComparison
    from pipelines.assess.pushover.push import Pushed

_MAX_STONES = 6  # stones of a mechanism that are named without -v
_COURSES = 5  # courses with the largest misfits that are listed without -v


def assessment_lines(done: "Assessment", verbose: bool) -> list[str]:
    """Return the lines of an assessment: what decides, what each number is, each load with its mechanism."""
    summary = done.summary
    lines = [
        f"{summary['scene']}: {summary['headline']}",
        "  held: Coulomb's friction without dilatancy, the largest load that a run from rest holds",
        "  bound: associative friction, a rigorous upper bound",
        f"  {summary['free']} stones that may move, {summary['contacts']} contact points, "
        f"weight {1e-3 * summary['weight']:.2f} kN",
        *(f"  {caution}" for caution in summary["cautions"]),
    ]
    for load in summary["loads"]:
        lines += [f"  {load['headline']}", *_code(load.get("code")), *_mechanism(load["mechanism"], verbose)]
    return [*lines, f"  run {done.run}", *(f"  {done.folder / name}" for name in summary["files"])]


def _code(check: dict[str, Any] | None) -> list[str]:
    """Return the numbers and comparisons of a check by a code, each with its article and formula."""
    if check is None:
        return []
    return [
        *([f"    CAUTION: {check['caution']}"] if check["caution"] else []),
        *(
            f"    {value['symbol']} = {value['value']:.4g} {value['unit']}   {value['formula']}   [{value['article']}]"
            for value in check["values"]
        ),
        *(
            f"    {'passed' if rule['passed'] else 'NOT PASSED'}: {rule['name']}: {rule['capacity']:.4g} against "
            f"{rule['demand']:.4g} {rule['unit']}, ratio {rule['ratio']:.2f}   {rule['formula']}   [{rule['article']}]"
            for rule in check["checks"]
        ),
    ]


def _mechanism(mechanism: dict[str, Any], verbose: bool) -> list[str]:
    codes = [stone["code"] for stone in mechanism["stones"]]
    if not codes:
        return []
    named = codes if verbose else codes[:_MAX_STONES]
    more = f" and {len(codes) - len(named)} more" if len(codes) > len(named) else ""
    return [
        f"    moves: {', '.join(named)}{more}; "
        f"{mechanism['opening_joints']} joints open, {mechanism['sliding_joints']} slide"
    ]


def comparison_lines(done: "SurveyComparison", verbose: bool) -> list[str]:
    """Return the lines of a comparison: the whole, each wall, and the courses with the largest misfits."""
    from pipelines.reports.movement import unrested

    summary = done.summary
    courses = sorted(summary["courses"], key=lambda course: -_ratio(course))
    shown = courses if verbose else courses[:_COURSES]
    return [
        f"{summary['scene']}: {_misfit(summary)}{unrested(summary['outcome'])}",
        "  χ² near its degrees of freedom: the movement explains what was measured; in brackets, if nothing had moved",
        *(f"  {caution}" for caution in summary["cautions"]),
        *(f"  {_wall(wall)}, {wall['quantity']}: {_misfit(wall)}" for wall in summary["walls"]),
        "  courses" + ("" if len(shown) == len(courses) else " that differ most"),
        *(
            f"    {_wall(course)}, course {course['course']}: {_misfit(course)}{_shape(course)}"
            for course in shown
        ),
        f"  run {done.run}",
        *(f"  {done.folder / name}" for name in summary["files"]),
    ]


def _wall(wall: dict[str, Any]) -> str:
    return str(wall["facade"]) + ("" if wall["zone"] is None else f" {wall['zone']}")


def _ratio(course: dict[str, Any]) -> float:
    return float(course["chi2"]) / max(int(course["dof"]), 1)


def _misfit(course: dict[str, Any]) -> str:
    return f"χ² {course['chi2']:.4g} of {course['dof']} ({course['chi2_still']:.4g})"


def _shape(course: dict[str, Any]) -> str:
    """Return slope and sag of a course, measured and simulated."""
    slope = course["slope"]
    text = (
        f"; slope {1e3 * slope['measured']:+.1f} ± {1e3 * slope['sigma']:.1f}, "
        f"simulated {1e3 * slope['simulated']:+.1f} mm/m"
    )
    if course["measured"] is None:
        return text
    return (
        f"{text}; mid-span {1e3 * course['measured']:+.1f} ± {1e3 * course['sigma']:.1f}, "
        f"simulated {1e3 * course['simulated']:+.1f} mm"
    )


def pushover_lines(done: "Pushed") -> list[str]:
    """Return the lines of a loading test: what the stones bear, how stiff they are, and how sure that is."""
    summary, errors = done.summary, done.summary["errors"]
    measured = summary["measured"] or {"ratio": {}}
    band = summary["band"] or {"by_one_sigma": {}}
    return [
        f"{summary['scene']}: {summary['headline']}",
        *(f"  {caution}" for caution in summary["cautions"]),
        f"  initial stiffness {1e-6 * summary['early_stiffness']:.3g} and {1e-6 * summary['stiffness']:.3g} kN/mm, "
        "secants at 15 and 30 % of the largest force",
        f"  {summary['steps']} steps, {errors['unsolved']} not solved; "
        f"error of the rate {1e-3 * errors['rate']:.2g} kN",
        *(
            f"  one standard deviation of {name}: {1e-3 * change:+.3g} kN"
            for name, change in band["by_one_sigma"].items()
        ),
        *(
            f"  measured {name} {1e-3 * measured['strength'][name]:.4g} kN; predicted over it {ratio:.3f}"
            for name, ratio in measured["ratio"].items()
            if ratio is not None
        ),
        f"  run {done.run}",
        *(f"  {done.folder / name}" for name in summary["files"]),
    ]
