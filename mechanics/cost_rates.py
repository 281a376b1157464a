"""What one unit of each amount took, as `python -m benchmarks.cost --fit` measured it."""

from collections.abc import Mapping
from dataclasses import dataclass

__all__ = ["CALIBRATION", "MACHINE", "MEMORY", "RATES", "Rate"]


@dataclass(frozen=True)
class Rate:
    """Seconds, or bytes, of a stage: a sum over amounts.

    Attributes
    ----------
    per : for one unit of each amount
    spread : factor by which most measured runs lay above or below, at most
    """

    per: Mapping[str, float]
    spread: float

    def __call__(self, amounts: Mapping[str, float]) -> float:
        """The sum."""
        return sum(rate * amounts[name] for name, rate in self.per.items())


MACHINE = "AMD EPYC, 2 cores, Linux, Python 3.11.7"

RATES: Mapping[tuple[str, str], Rate] = {
    ("rigid", "mesh"): Rate(per={"one": 0.00136, "stones": 0.000928}, spread=1.25),
    ("rigid", "start"): Rate(per={"contacts": 0.000103, "tangle": 1.44e-06}, spread=3.84),
    ("rigid", "settled"): Rate(per={"one": 0.00159, "contacts": 3.46e-06}, spread=6.11),
    ("rigid", "relaxing"): Rate(per={"one": 0.0017, "contacts": 5.51e-06, "tangle": 5.33e-08}, spread=2.0),
    ("rigid", "moving"): Rate(per={"contacts": 1.43e-07, "tangle": 2.2e-07}, spread=2.0),
    ("rigid", "stress"): Rate(per={"stones": 4.83e-05, "contacts": 2.45e-05}, spread=1.25),
    ("elastic", "mesh"): Rate(
        per={"one": 0.00613, "stones": 0.00129, "distinct_nodes": 5.4e-07, "nodes": 2.93e-06}, spread=1.25
    ),
    ("elastic", "assemble"): Rate(
        per={"one": 0.0267, "contacts": 2.81e-05, "condensed": 8.58e-08}, spread=1.69
    ),
    ("elastic", "start"): Rate(per={"fronts": 0.00212, "flops": 3.79e-09}, spread=4.24),
    ("elastic", "settled"): Rate(per={"nodes": 1.51e-06, "fronts": 0.000134, "flops": 9.57e-11}, spread=2.26),
    ("elastic", "relaxing"): Rate(per={"flops": 1.17e-09}, spread=2.0),
    ("elastic", "moving"): Rate(per={"fronts": 0.00605}, spread=2.0),
    ("elastic", "stress"): Rate(per={"nodes": 1.13e-05, "contacts": 8.79e-05}, spread=1.25),
}

MEMORY: Mapping[str, Rate] = {
    "rigid": Rate(per={"contacts": 7600.0, "stones": 1100.0, "one": 240000000.0}, spread=1.62),
    "elastic": Rate(per={"nodes": 1690.0, "blocks": 16.9, "factor": 25.5, "one": 261000000.0}, spread=1.45),
}

CALIBRATION: Mapping[str, float] = {
    "loops": 0.0018936120000001555,
    "passes": 0.004461645999999986,
    "products": 0.028445269999999967,
}
