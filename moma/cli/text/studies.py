"""Results of a study, in lines of text."""

from collections.abc import Iterator

from pipelines.assess.study.study import Study

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
