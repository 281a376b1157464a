"""Text of a diagnosis."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pipelines.assess.diagnosis.diagnose import Diagnosis

__all__ = ["diagnosis_lines"]


def diagnosis_lines(done: "Diagnosis", verbose: bool) -> list[str]:
    """Return the lines of a diagnosis: its verdict, the date with its evidence, and the hypotheses in their order."""
    summary = done.summary
    dating = summary["dating"]
    battered = " --battered" if done.battered else ""
    return [
        summary["verdict"],
        *(
            ()
            if dating is None
            else (f"  {dating['verdict']}", *(f"    {one}" for one in dating["evidence"]))
        ),
        *(f"  {caution}" for caution in summary["cautions"]),
        "  hypotheses, by AICc; P: of so large a χ² by chance",
        *(line for hypothesis in summary["hypotheses"] for line in _hypothesis(hypothesis)),
        *(_groups(summary["groups"]) if verbose else ()),
        f"  {summary['runs']} runs, {summary['cpu']:.0f} s of the processor",
        "  look closer, and keep the best in the database: "
        f"moma compare {done.folder / 'best.toml'}{battered}",
        *(f"  {done.folder / name}" for name in summary["files"]),
    ]


def _hypothesis(one: dict[str, Any]) -> list[str]:
    stood = f" (when {', '.join(f'phase {phase}' for phase in one['stood'])} stood)" if one["stood"] else ""
    if one["chi2"] is None:
        return [f"    {one['name']}{stood}", *(f"      {remark}" for remark in one["remarks"])]
    return [
        f"    {one['name']}{stood}: χ² {one['chi2']:.4g} of {one['dof']}, P {one['probability']:.2g}, "
        f"AICc {one['behind']:+.3g}",
        *(f"      {_amplitude(own)}" for own in one["amplitudes"]),
        *(f"      {remark}" for remark in one["remarks"]),
    ]


def _amplitude(own: dict[str, Any]) -> str:
    between = (
        "not determined"
        if own["low"] is None
        else f"{own['low']:.4g} to {own['high']:.4g} {own['unit']} (95 %)"
    )
    return f"{own['name']} = {own['value']:.4g} {own['unit']}: {between}"


def _groups(groups: list[dict[str, Any]]) -> list[str]:
    return [
        "  χ² of the best, in brackets if nothing had moved",
        *(
            f"    {group['facade']}{'' if group['zone'] is None else ' ' + group['zone']}, "
            f"{'plumb' if group['course'] is None else 'course ' + str(group['course'])}: "
            f"{group['chi2']:.4g} of {group['dof']} ({group['chi2_still']:.4g})"
            for group in groups
        ),
    ]
