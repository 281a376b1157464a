"""Seconds and bytes of one unit of each amount, as measured by `python -m benchmarks.cost --fit`."""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Rate:
    """Seconds, or bytes, of a stage: a sum over amounts.

    Attributes
    ----------
    per : for one unit of each amount
    below, above : factors by which most measured runs lay below and above it, at most
    """

    per: Mapping[str, float]
    below: float
    above: float

    def __call__(self, amounts: Mapping[str, float]) -> float:
        """Return the sum."""
        return sum(rate * amounts[name] for name, rate in self.per.items())


MACHINE = "AMD EPYC, 2 cores, Linux, Python 3.11.7"

RATES: Mapping[tuple[str, str], Rate] = {
    ("rigid", "mesh"): Rate(per={"one": 0.00153, "stones": 0.000952}, below=1.25, above=1.25),
    ("rigid", "start"): Rate(per={"contacts": 0.000267}, below=4.44, above=8.49),
    ("rigid", "settled"): Rate(per={"one": 0.00162, "contacts": 3.34e-06}, below=1.25, above=22.32),
    ("rigid", "relaxing"): Rate(
        per={"one": 0.00146, "contacts": 4.74e-06, "tangle": 9.24e-09}, below=1.25, above=1.34
    ),
    ("rigid", "moving"): Rate(per={"one": 0.00103, "tangle": 1.62e-07}, below=1.29, above=1.7),
    # shaken walls, columns and portals of 7 to 69 stones (tests/mechanics/results/forecast/test_moving_scenes.py)
    ("rigid", "driven"): Rate(per={"one": 0.03, "contacts": 2e-05}, below=1.75, above=1.75),
    ("rigid", "asleep"): Rate(per={"one": 0.000722, "stones": 1.12e-06}, below=2.0, above=2.0),
    ("rigid", "stress"): Rate(per={"stones": 8.35e-05, "contacts": 1.96e-05}, below=1.25, above=1.91),
    ("elastic", "mesh"): Rate(per={"stones": 0.00149, "distinct_nodes": 7.06e-05}, below=1.25, above=1.35),
    ("elastic", "assemble"): Rate(
        per={"one": 0.0111, "contacts": 4.38e-05, "condensed": 1.18e-07}, below=1.67, above=2.35
    ),
    ("elastic", "start"): Rate(
        per={"fronts": 0.00613, "condensed": 6.37e-07, "flops": 4.71e-09}, below=4.52, above=5.97
    ),
    ("elastic", "settled"): Rate(per={"fronts": 0.000261, "flops": 1.08e-10}, below=1.31, above=2.39),
    ("elastic", "relaxing"): Rate(per={"fronts": 0.00234, "flops": 8.82e-10}, below=2.0, above=2.0),
    ("elastic", "moving"): Rate(per={"fronts": 0.00578}, below=2.0, above=2.0),
    ("elastic", "stress"): Rate(
        per={"stones": 0.000247, "nodes": 1.13e-05, "contacts": 8.57e-05}, below=1.25, above=1.31
    ),
}

MEMORY: Mapping[str, Rate] = {
    "rigid": Rate(per={"contacts": 7320.0, "stones": 2280.0, "one": 240000000.0}, below=1.25, above=1.45),
    "elastic": Rate(
        per={"nodes": 1710.0, "blocks": 12.5, "factor": 28.9, "one": 260000000.0}, below=1.25, above=1.69
    ),
}

CALIBRATION: Mapping[str, float] = {
    "loops": 0.0019607619999999493,
    "passes": 0.004918503999999935,
    "products": 0.03172349899999993,
}
