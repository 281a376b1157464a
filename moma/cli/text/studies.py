"""Results of a study, in lines of text."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from pipelines.assess.study.study import Study

if TYPE_CHECKING:
    from pipelines.assess.diagnosis.diagnose import Diagnosis


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
            else (f"  {dating['verdict']}", *(f"    {line}" for line in dating["evidence"]))
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


def _hypothesis(hypothesis: dict[str, Any]) -> list[str]:
    stood = (
        f" (when {', '.join(f'phase {phase}' for phase in hypothesis['stood'])} stood)"
        if hypothesis["stood"]
        else ""
    )
    if hypothesis["chi2"] is None:
        return [f"    {hypothesis['name']}{stood}", *(f"      {remark}" for remark in hypothesis["remarks"])]
    return [
        f"    {hypothesis['name']}{stood}: χ² {hypothesis['chi2']:.4g} of {hypothesis['dof']}, "
        f"P {hypothesis['probability']:.2g}, AICc {hypothesis['behind']:+.3g}",
        *(f"      {_amplitude(amplitude)}" for amplitude in hypothesis["amplitudes"]),
        *(f"      {remark}" for remark in hypothesis["remarks"]),
    ]


def _amplitude(amplitude: dict[str, Any]) -> str:
    between = (
        "not determined"
        if amplitude["low"] is None
        else f"{amplitude['low']:.4g} to {amplitude['high']:.4g} {amplitude['unit']} (95 %)"
    )
    return f"{amplitude['name']} = {amplitude['value']:.4g} {amplitude['unit']}: {between}"


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


_MAX_ACTIONS = 5  # actions that are told without --verbose


def part_line(done: Study) -> str:
    """Return how far the samples of a part are."""
    summary = done.summary
    return (
        f"part {summary['part']}/{summary['parts']} is done: its {summary['done']} samples are there; when all parts "
        "are, the same command without --part writes the results"
    )


def study_lines(done: Study, verbose: bool) -> Iterator[str]:
    """Yield the headline, the numbers, what decides and what to measure next."""
    summary = done.summary
    yield summary["headline"]
    yield from (f"caution: {text}" for text in summary["cautions"])
    failure = summary["failure"]
    if failure is not None:
        yield (
            f"P {failure['probability']:.4g}, {failure['probability_upper']:.4g} if all without an answer fall; "
            f"interval {failure['low']:.4g} to {failure['high']:.4g}; β {failure['index']:.4g}, "
            f"{failure['index_low']:.4g} to {failure['index_high']:.4g}"
        )
    for name, mean in summary["means"].items():
        if mean["sigma"] is not None:
            yield f"{name}: mean {mean['value']:.5g}, standard deviation {mean['sigma']:.4g}"
    for number, design in enumerate(summary["designs"], start=1):
        yield f"design point {number}: β {design['index']:.4g}, {design['evaluations']} evaluations"
    for row in summary["sobol"]:
        yield f"{row['input']}: S {row['first']:.4f}, ST {row['total']:.4f}"
    for name, share in sorted(summary["shares"]["by_input"].items(), key=lambda row: -row[1]):
        yield f"share of the variance: {name} {100 * share:.1f} %"
    actions = summary["actions"] if verbose else summary["actions"][:_MAX_ACTIONS]
    for action in actions:
        yield f"measure next: {action['text']}: takes away {100 * action['share']:.1f} % of the variance"
    yield f"study {done.run}: {done.folder / 'report.html'}"
