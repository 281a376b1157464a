"""Results of a study, in lines of text."""

from collections.abc import Iterator

from pipelines.assess.study.study import Study

__all__ = ["part_line", "study_lines"]

_FEW = 5  # actions that are told without --verbose


def part_line(done: Study) -> str:
    """Return how far the samples of a part are."""
    told = done.summary
    rest = f"; {told['missing']} of other parts are not there yet" if told["missing"] else ""
    return f"part {told['part']}/{told['parts']} is done, {told['done']} samples are there{rest}"


def study_lines(done: Study, verbose: bool) -> Iterator[str]:
    """Yield the headline, the numbers, what decides and what to measure next."""
    told = done.summary
    yield told["headline"]
    yield from (f"caution: {text}" for text in told["cautions"])
    failure = told["failure"]
    if failure is not None:
        yield (
            f"P {failure['probability']:.4g}, {failure['probability_upper']:.4g} if all without an answer fall; "
            f"interval {failure['low']:.4g} to {failure['high']:.4g}; β {failure['index']:.4g}, "
            f"{failure['index_low']:.4g} to {failure['index_high']:.4g}"
        )
    for name, mean in told["means"].items():
        if mean["sigma"] is not None:
            yield f"{name}: mean {mean['value']:.5g}, standard deviation {mean['sigma']:.4g}"
    for number, design in enumerate(told["designs"], start=1):
        yield f"design point {number}: β {design['index']:.4g}, {design['evaluations']} evaluations"
    for row in told["sobol"]:
        yield f"{row['input']}: S {row['first']:.4f}, ST {row['total']:.4f}"
    for name, share in sorted(told["shares"]["by_input"].items(), key=lambda row: -row[1]):
        yield f"share of the variance: {name} {100 * share:.1f} %"
    actions = told["actions"] if verbose else told["actions"][:_FEW]
    for action in actions:
        yield f"measure next: {action['text']}: takes away {100 * action['share']:.1f} % of the variance"
    yield f"study {done.run}: {done.folder / 'report.html'}"
