"""Linear and nonlinear kinematic check of a mechanism; every line names its article and its formula."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ground.errors import UsageError
from ground.units import GRAVITY
from mechanics.limit.kinematic import Kinematics
from pipelines.scene.site import Site, damping_factor

_FOLDER = Path(__file__).parent

CODES = tuple(sorted(path.stem for path in _FOLDER.glob("*.toml")))
"""Codes whose rules are known: one file of rules each."""


@dataclass(frozen=True)
class Check:
    """Comparison of a capacity with a demand.

    Attributes
    ----------
    name : what is compared
    article, formula : of the code
    capacity, demand : in `unit`
    """

    name: str
    article: str
    formula: str
    capacity: float
    demand: float
    unit: str

    @property
    def ratio(self) -> float:
        """Capacity over demand [-]."""
        return self.capacity / self.demand

    @property
    def passed(self) -> bool:
        """True if the capacity is not below the demand."""
        return self.ratio >= 1.0


@dataclass(frozen=True)
class CodeCheck:
    """Check of a mechanism after a code.

    Attributes
    ----------
    code : its name
    caution : what is not certain about it; empty: nothing
    values : numbers on the way, by symbol, with unit, article and formula
    checks : comparisons; a mechanism passes if the nonlinear ones do, or the linear ones
    """

    code: str
    caution: str
    values: tuple[Mapping[str, Any], ...]
    checks: tuple[Check, ...]

    @property
    def passed(self) -> bool:
        """True if all linear comparisons pass, or all nonlinear ones: the code asks for either."""
        groups = [[check.passed for check in self.checks if check.name.startswith(kind)] for kind in _KINDS]
        return any(group and all(group) for group in groups)


_KINDS = ("linear", "nonlinear")


def check_code(code: str, site: Site, kinematics: Kinematics, gravity: float = GRAVITY) -> CodeCheck:
    """Check the mechanism of a limit load.

    Parameters
    ----------
    code : one of `CODES`
    site : seismic action
    kinematics : kinematic analysis of the mechanism
    gravity : [m/s²]

    Raises
    ------
    UsageError : there is no such code
    """
    if code not in CODES:
        raise UsageError(f"no such code: {code!r}", where="--code", remedy=f"give one of {', '.join(CODES)}")
    rules = tomllib.loads((_FOLDER / f"{code}.toml").read_text(encoding="utf-8"))
    article, q = rules["articles"], rules["behaviour"] if site.behaviour is None else site.behaviour
    capacity = kinematics.acceleration(site.confidence)
    values = [
        _value(
            "α0",
            kinematics.multiplier,
            "-",
            article["oscillator"],
            "multiplier at which the mechanism begins",
        ),
        _value("M*", kinematics.mass, "kg", article["oscillator"], "(Σ P δ)² / (g Σ P δ²)"),
        _value("e*", kinematics.share, "-", article["oscillator"], "g M* / Σ P"),
        _value("a0*", capacity, "m/s²", article["oscillator"], f"α0 g / (e* FC), FC = {site.confidence:g}"),
    ]
    checks = [
        Check(
            "linear, at the ground",
            article["linear"],
            f"a0* ≥ ag S / q, q = {q:g}",
            capacity,
            site.ag * gravity * site.soil / q,
            "m/s²",
        )
    ]
    upper = site.height > 0 and site.period is not None
    floor = rules.get("floor")
    if upper:
        checks.append(_linear_above(site, article, capacity, q, gravity, floor is not None))
    if np.isfinite(kinematics.capacity):
        values += _nonlinear_values(rules, kinematics, capacity)
        checks += _nonlinear(rules, site, kinematics, capacity, gravity)
    unchecked = [rules["unchecked"], floor["unchecked"] if upper and floor is not None else ""]
    caution = "; ".join(caution for caution in unchecked if caution)
    return CodeCheck(rules["name"], caution, tuple(values), tuple(checks))


def _nonlinear_values(
    rules: Mapping[str, Any], kinematics: Kinematics, capacity: float
) -> list[dict[str, Any]]:
    """Return d0*, du* and the secant of the capacity curve, given a0* [m/s²]."""
    zero, where = kinematics.capacity, rules["articles"]["nonlinear"]
    ultimate = rules["ultimate"] * zero
    at, slowed, period = _secant(rules, zero, ultimate, capacity)
    return [
        _value("d0*", zero, "m", where, "displacement at which the multiplier is 0"),
        _value("du*", ultimate, "m", where, f"{rules['ultimate']:g} d0*"),
        _value("ds*", at, "m", where, f"{rules['secant']:g} du*"),
        _value("as*", slowed, "m/s²", where, "a0* (1 - ds*/d0*)"),
        _value("Ts", period, "s", where, f"{rules['period']:g} π √(ds*/as*)"),
    ]


def _nonlinear(
    rules: Mapping[str, Any], site: Site, kinematics: Kinematics, capacity: float, gravity: float
) -> list[Check]:
    """Return the checks of the ultimate displacement, at the ground and, of an upper mechanism, above it."""
    article, damping, floor = rules["articles"], rules["damping"], rules.get("floor")
    ultimate, where = rules["ultimate"] * kinematics.capacity, article["nonlinear"]
    period = _secant(rules, kinematics.capacity, ultimate, capacity)[2]
    formula, demand = f"du* ≥ SDe(Ts), damping {damping:g} %", site.displacement(period, gravity, damping)
    checks = [Check("nonlinear, at the ground", where, formula, ultimate, demand, "m")]
    first = site.period
    if not site.height > 0 or first is None:
        return checks
    if floor is not None:
        where = f"{where}, {article['floor']}"
        formula = f"du* ≥ SeZ(Ts) Ts²/4π², damping {damping:g} %, ξ1 = {site.damping:g} %"
        demand = floor_displacement(site, period, damping, gravity, floor)
    else:
        above = rules["above"]
        share = _secant(above, kinematics.capacity, ultimate, capacity)[2] / first
        formula = (
            f"du* ≥ SDe(T1) ψ(Z) γ (Ts/T1)² / √((1 - Ts/T1)² + {above['coupling']:g} Ts/T1), "
            f"Ts = {above['period']:g} π √(ds*/as*) at {above['secant']:g} du*"
        )
        demand = site.displacement(first, gravity) * site.shape * site.participation * share**2
        demand /= float(np.sqrt((1.0 - share) ** 2 + above["coupling"] * share))
    return [*checks, Check("nonlinear, above the ground", where, formula, ultimate, demand, "m")]


def _linear_above(
    site: Site, article: Mapping[str, str], capacity: float, q: float, gravity: float, floor: bool
) -> Check:
    """Return the linear check of a mechanism above the ground, by the floor spectrum or without one."""
    shares = f"ψ = {site.shape:.3g}, γ = {site.participation:.3g}"
    if floor:
        where = f"{article['linear']}, {article['floor']}"
        formula = f"a0* ≥ aZ / q, aZ = Se(T1, ξ1) ψ(Z) γ √(1 + 0.0004 ξ1²), {shares}, ξ1 = {site.damping:g} %"
        demand = floor_acceleration(site, gravity)
    else:
        where, formula = article["linear"], f"a0* ≥ Se(T1) ψ(Z) γ / q, {shares}"
        demand = site.acceleration(site.period or 0.0, gravity) * site.shape * site.participation
    return Check("linear, above the ground", where, formula, capacity, demand / q, "m/s²")


def _secant(
    rules: Mapping[str, Any], zero: float, ultimate: float, capacity: float
) -> tuple[float, float, float]:
    """Return ds* [m], as* [m/s²] and Ts [s], given d0*, du* and a0*: the capacity falls straight to 0 at d0*."""
    at = rules["secant"] * ultimate
    slowed = capacity * (1.0 - at / zero)
    return at, slowed, float(rules["period"] * np.pi * np.sqrt(at / slowed))


def _value(symbol: str, value: float, unit: str, article: str, formula: str) -> dict[str, Any]:
    return {"symbol": symbol, "value": value, "unit": unit, "article": article, "formula": formula}


def floor_acceleration(site: Site, gravity: float) -> float:
    """Return the largest acceleration a_Z at the height of the mechanism [m/s²]."""
    felt = site.acceleration(site.period or 0.0, gravity, site.damping)
    return felt * site.participation * site.shape * float(np.sqrt(1.0 + 0.0004 * site.damping**2))


def floor_spectrum(
    site: Site, period: float, damping: float, gravity: float, rules: Mapping[str, float]
) -> float:
    """Return S_eZ(T, ξ) at the height z of the mechanism, by the first mode of the building [m/s²].

    Of circular 7/2019, C7.2.3:

        a_Z = S_e(T_1, ξ_1) |γ ψ(z)| √(1 + 0.0004 ξ_1²)                                       [C7.2.7]
        S_eZ(T, ξ) = f a_Z / (1 + (f - 1) x),    f = 1.1 η(ξ)/√ξ_1                            [C7.2.6]

    with x = (1 - T/(a T_1))^1.6 below a T_1, 0 up to b T_1 and (T/(b T_1) - 1)^1.2 beyond; S_eZ ≥ S_e(T, ξ) for
    T > T_1 [C7.2.5]. The circular states ξ_1 in per cent. In f it is taken as a ratio here: f is the resonance of the
    mechanism with the building, 4.9 at 5 %, and as a percentage it would be 0.5, less than a rigid mechanism has.

    Parameters
    ----------
    period, damping : T [s] and ξ [%] of the mechanism
    rules : `first` and `last`, a and b of the range of resonance; `peak`, 1.1; exponents `rise` and `fall`
    """
    building = site.period or 0.0
    first, last = rules["first"] * building, rules["last"] * building
    peak = rules["peak"] * damping_factor(damping) / float(np.sqrt(site.damping / 100.0))
    off = 0.0
    if period < first:
        off = (1.0 - period / first) ** rules["rise"]
    elif period > last:
        off = (period / last - 1.0) ** rules["fall"]
    acceleration = peak * floor_acceleration(site, gravity) / (1.0 + (peak - 1.0) * off)
    return (
        max(acceleration, site.acceleration(period, gravity, damping)) if period > building else acceleration
    )


def floor_displacement(
    site: Site, period: float, damping: float, gravity: float, rules: Mapping[str, float]
) -> float:
    """Return the displacement S_eZ T²/4π² that a mechanism is to bear; beyond b T_1 no less than at resonance [m].

    Parameters as `floor_spectrum`; [C8.7.1.12].
    """
    displacement = floor_spectrum(site, period, damping, gravity, rules) * (period / (2.0 * np.pi)) ** 2
    building = site.period or 0.0
    last = rules["last"] * building
    if period <= last:
        return float(displacement)
    least = floor_spectrum(site, building, damping, gravity, rules) * (last / (2.0 * np.pi)) ** 2
    return float(max(displacement, least))
