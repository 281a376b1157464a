"""Contents of study.json: probabilities, shares of the variance, actions, and what was taken as certain."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from pipelines.assess.study.actions import (
    SLIGHT,
    actions,
    shares_by_group,
    shares_by_input,
    shares_by_stone,
)
from pipelines.assess.study.estimates import Estimates, failure_of
from pipelines.assess.study.file import StudyFile
from pipelines.assess.study.methods.counting import Probability, quantiles, reliability_index
from pipelines.assess.study.methods.first_order import NOT_LINEAR
from pipelines.assess.study.problem import Problem
from pipelines.assess.study.quantities import quantity_name
from pipelines.assess.study.sampling import Sampler
from pipelines.assess.study.settings import InputType
from pipelines.assess.workers.store import Snapshot
from pipelines.run.record import versions
from survey.conventions import FEW, TAIL

INDEX = "study.json"
"""Index of the results of a study."""

_TAILS = (TAIL, FEW)
_SHARES = (*_TAILS, 0.5, *(1.0 - share for share in reversed(_TAILS)))
"""Quantiles that are told."""
_MOST = 40  # actions that are told


def summary_of(
    file: StudyFile, problem: Problem, estimates: Estimates, sampler: Sampler, snapshot: Snapshot
) -> dict[str, Any]:
    """Return the contents of study.json."""
    gradient = estimates.gradient
    squares = np.zeros(problem.dimension) if gradient is None else gradient**2
    measures = [] if gradient is None else actions(problem, gradient)
    worth = [action for action in measures if action.share >= SLIGHT][:_MOST]
    summary: dict[str, Any] = {
        "scene": file.scene.name,
        "study": asdict(file.study),
        "unknowns": problem.dimension,
        "quantity": quantity_name(problem.quantities[0]),
        "bound": problem.differentiable,
        "means": {name: _plain(asdict(mean)) for name, mean in estimates.means.items()},
        "quantiles": {
            name: dict(zip(map(str, _SHARES), quantiles(values, _SHARES), strict=True))
            for name, values in estimates.values.items()
            if estimates.weights is None
        },
        "failure": _failure(problem, estimates),
        "fragility": [_plain({"level": level, **_told(one)}) for level, one in estimates.fragility],
        "linear": _linear(problem, estimates),
        "designs": [_design(problem, design) for design in estimates.designs],
        "sobol": _sobol(problem, estimates),
        "subset": None
        if estimates.subset is None
        else {
            "levels": list(estimates.subset.levels),
            "evaluations": estimates.subset.evaluations,
            "complete": estimates.subset.complete,
        },
        "shares": {
            "by_input": shares_by_input(problem, squares),
            "by_group": shares_by_group(problem, squares),
            "by_stone": dict(shares_by_stone(problem, measures)),
        },
        "actions": [asdict(action) for action in worth],
        "certain": certain(problem),
        "faults": [{"reason": first, "count": many} for first, many in sampler.faults.values()],
        "samples": {
            "taken": sampler.taken,
            "cpu": sampler.cpu,
            "digest": sampler.digest_of(estimates.samples),
        },
        "snapshot": snapshot.hash,
        "versions": dict(versions()),
        "files": [INDEX, "samples.csv", "actions.csv", "report.html"],
    }
    summary["cautions"] = _cautions(estimates, summary)
    summary["headline"] = _headline(summary)
    return summary


def _plain(values: Mapping[str, Any]) -> dict[str, Any]:
    return {
        name: None if isinstance(value, float) and not np.isfinite(value) else value
        for name, value in values.items()
    }


def _told(probability: Probability) -> dict[str, Any]:
    low, high = probability.index
    return _plain(
        {
            "probability": probability.low_value,
            "probability_upper": probability.high_value,
            "low": probability.low,
            "high": probability.high,
            "index": reliability_index(probability.low_value),
            "index_low": low,
            "index_high": high,
            "failing": probability.failing,
            "unknown": probability.unknown,
            "count": probability.count,
            "cov": probability.cov,
        }
    )


def _failure(problem: Problem, estimates: Estimates) -> dict[str, Any] | None:
    failure = failure_of(problem)
    if failure is None or estimates.probability is None:
        return None
    return {"level": failure.level, "above": failure.above, **_told(estimates.probability)}


def _linear(problem: Problem, estimates: Estimates) -> dict[str, Any] | None:
    linear = estimates.linear
    if linear is None:
        return None
    along = "" if linear.along < 0 else problem.unknowns.each[linear.along].label
    return _plain(
        {
            "mean": linear.mean,
            "sigma": linear.sigma,
            "departure": linear.departure,
            "along": along,
            "linear": bool(linear.linear),
            "sides": [
                {"along": problem.unknowns.each[side.along].label, "below": side.below, "above": side.above}
                for side in linear.sides
            ],
        }
    )


def _design(problem: Problem, design: Any) -> dict[str, Any]:
    values = problem.unknowns.values(design.point)
    order = np.argsort(-design.shares, kind="stable")[:12]
    order = order[design.shares[order] >= SLIGHT]
    return {
        "index": design.index,
        "probability": design.probability,
        "converged": design.converged,
        "evaluations": design.evaluations,
        "unknowns": [
            {
                "label": problem.unknowns.each[number].label,
                "value": float(values[number]),
                "sigmas": float(design.point[number]),
                "share": float(design.shares[number]),
            }
            for number in order.tolist()
        ],
        "shares": shares_by_input(problem, design.gradient**2),
    }


def _sobol(problem: Problem, estimates: Estimates) -> list[dict[str, Any]]:
    indices = estimates.indices
    if indices is None:
        return []
    return [
        {
            "input": table.name or str(table.type),
            "first": float(indices.first[number]),
            "total": float(indices.total[number]),
            "first_interval": indices.first_interval[number].tolist(),
            "total_interval": indices.total_interval[number].tolist(),
        }
        for number, table in enumerate(problem.inputs)
    ]


def certain(problem: Problem) -> list[str]:
    """Return what was taken as certain, in words."""
    asked = {table.type for table in problem.inputs}
    words = {
        InputType.FRICTION: "friction of joints",
        InputType.DENSITY: "density of stones",
        InputType.DEPTH: "depths behind the faces",
        InputType.PLANE: "planes of the faces",
        InputType.POINT: "corners of the faces",
        InputType.STRENGTH: "compressive strength of stones",
        InputType.DIRECTION: "direction of the load",
    }
    found = [text for kind, text in words.items() if kind not in asked]
    without = [model.record.code for model in problem.models if not model.record.depth_sigma]
    if InputType.DEPTH in asked and without:
        found.append(f"depth of {len(without)} stones whose survey states no sigma, e.g. {without[0]}")
    return [*found, "the model itself: rigid stones, their bond, and how joints are closed"]


def _cautions(estimates: Estimates, summary: Mapping[str, Any]) -> list[str]:
    told = []
    linear = summary["linear"]
    if linear is not None and not linear["linear"]:
        off = linear["departure"]
        size = "as it has no answer there" if off is None else f"by {100 * off:.0f} % of a standard deviation"
        told.append(
            f"first order is not good enough: along {linear['along'] or 'the gradient'} the quantity departs from it "
            f"{size} (limit {100 * NOT_LINEAR:.0f} %); several mechanisms may govern"
        )
    if linear is not None:
        told += [
            f"the derivative by {one['along']} is {one['below']:.3g} below its mean and {one['above']:.3g} above, a "
            "standard deviation: several mechanisms meet there, and shares and actions are those of one between them"
            for one in linear["sides"]
        ]
    told += [
        f"{fault['count']} samples have no answer, as the first: {fault['reason']}; they bound the probability from "
        "both sides"
        for fault in summary["faults"]
    ]
    if estimates.subset is not None and not estimates.subset.complete:
        told.append("subset simulation did not reach failure: its probability is an upper bound")
    if any(not design.converged for design in estimates.designs):
        told.append("a search for a design point did not converge")
    told += _departing(estimates)
    return told


def _departing(estimates: Estimates) -> list[str]:
    """Return a caution where the interval of the samples is not that of the first-order prediction."""
    nothing = estimates.linear is None and estimates.gradient is None
    if nothing or estimates.weights is not None:
        return []
    told = []
    for name, values in estimates.values.items():
        finite = values[np.isfinite(values)]
        if len(finite) < 100 or estimates.indices is not None:
            continue
        low, high = np.quantile(finite, [0.025, 0.975])
        half, normal = 0.5 * float(high - low), 1.96 * float(finite.std(ddof=1))
        # standard error of half of the interval of a normal sample: 0.26 sigma/sqrt(n/10) at both ends
        error = 1.96 * float(finite.std(ddof=1)) * np.sqrt(0.5 / len(finite))
        if normal > 0.0 and abs(half - normal) > max(2.0 * error, 0.005 * normal):
            told.append(
                f"{name} is not normal: 95 % of its samples lie within ± {half:.4g}, and a normal one's within "
                f"± {normal:.4g}"
            )
        break
    return told


def _headline(summary: Mapping[str, Any]) -> str:
    failure, first = summary["failure"], summary["cautions"][:1]
    if failure is None:
        name, mean = summary["quantity"], summary["means"].get(summary["quantity"])
        spread = "" if mean is None or mean["sigma"] is None else f", standard deviation {mean['sigma']:.4g}"
        said = (
            f"{name}: no probability was asked for"
            if mean is None
            else f"{name}: mean {mean['value']:.4g}{spread}"
        )
    else:
        way = "above" if failure["above"] else "below"
        said = (
            f"P({summary['quantity']} {way} {failure['level']:g}) = {failure['probability']:.3g}"
            f" ({failure['low']:.3g} to {failure['high']:.3g}), β = {failure['index']:.3g}"
            f" ({failure['index_low']:.3g} to {failure['index_high']:.3g})"
        )
        if summary["bound"] and not failure["above"]:
            said += "; P AT LEAST, as stones hold no more than the bound"
    if summary["actions"]:
        action = summary["actions"][0]
        said += f"; measure next: {action['text']}, which takes away {100 * action['share']:.0f} % of the variance"
    return "; but ".join([said, *first])
