"""Assessments in words."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pipelines.assess.assess import Assessment

__all__ = ["assessment_lines"]

_FEW = 6  # stones of a mechanism that are named without -v


def assessment_lines(done: "Assessment", verbose: bool) -> list[str]:
    """Return the lines of an assessment: what decides, what each number is, each load with its mechanism."""
    summary = done.summary
    lines = [
        f"{summary['scene']}: {summary['headline']}",
        "  bound: associative friction, a rigorous upper bound",
        "  candidate: Coulomb's friction without dilatancy; the stones may fall at less",
        f"  {summary['free']} stones that may move, {summary['contacts']} contact points, "
        f"weight {1e-3 * summary['weight']:.2f} kN",
        *(f"  {caution}" for caution in summary["cautions"]),
    ]
    for one in summary["loads"]:
        lines += [f"  {one['headline']}", *_code(one.get("code")), *_mechanism(one["mechanism"], verbose)]
    if done.run is not None:
        lines.append(f"  run {done.run}")
    return [*lines, *(f"  {done.folder / name}" for name in summary["files"])]


def _code(found: dict[str, Any] | None) -> list[str]:
    """Return the numbers and comparisons of a check by a code, each with its article and formula."""
    if found is None:
        return []
    return [
        *([f"    CAUTION: {found['caution']}"] if found["caution"] else []),
        *(
            f"    {one['symbol']} = {one['value']:.4g} {one['unit']}   {one['formula']}   [{one['article']}]"
            for one in found["values"]
        ),
        *(
            f"    {'passed' if one['passed'] else 'NOT PASSED'}: {one['name']}: {one['capacity']:.4g} against "
            f"{one['demand']:.4g} {one['unit']}, ratio {one['ratio']:.2f}   {one['formula']}   [{one['article']}]"
            for one in found["checks"]
        ),
    ]


def _mechanism(found: dict[str, Any], verbose: bool) -> list[str]:
    codes = [stone["code"] for stone in found["stones"]]
    if not codes:
        return []
    named = codes if verbose else codes[:_FEW]
    more = f" and {len(codes) - len(named)} more" if len(codes) > len(named) else ""
    return [
        f"    moves: {', '.join(named)}{more}; "
        f"{found['opening_joints']} joints open, {found['sliding_joints']} slide"
    ]
