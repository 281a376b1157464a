"""Claims of Renouf, Dubois & Alart (2006) beside runs: `python -m benchmarks.geology_claims [--write]`.

Reads the runs that `python -m benchmarks.geology` made (folders KIND-γ-SEED-100), and judges each claim by a stated
criterion: it agrees where the interval of 95 % about the mean margin of the seeds lies above 0, contradicts where it
lies below, and else cannot be told. Runs of one seed take the deviation of those with a tenth of the disks. What is
missing is left out. `--write` puts the tables into docs/geology.md.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from benchmarks.claims import Claim, Finding, Run, verdict_of
from benchmarks.claims_fault import FAULT
from benchmarks.claims_fold import FOLD
from benchmarks.geology import pushing, read_run
from benchmarks.report import (
    ROOT,
    Row,
    columns,
    commit,
    guarded,
    machine,
    options_of,
    print_json,
    print_table,
    table_lines,
    write_between,
)
from mechanics.arrays import Array, Bools, Ints
from mechanics.planar.measures.blocks import blocks_of
from mechanics.planar.measures.surface import profile
from pipelines.geology.experiments.fault import Fault
from pipelines.geology.file import read_geology
from pipelines.geology.observe import Fields, Instants, read_rows
from pipelines.geology.sample import PreparedSample, prepare

_PAGE = ROOT / "docs" / "geology.md"
_SHEARED = (0.05, 0.95)  # motion over the slip of disks that shear [-]
_PART = 20.0  # lengths over which the fold's surface is averaged, over the mean radius, as its front [-]
_SIMILAR, _BANDED = 0.4, 0.7  # instants of the paper's figures 6b and 6c, 200 and 350 s of 500 [-]
_TABLE = columns(
    "words Renouf, Dubois & Alart (2006) | criterion criterion | seeds seeds :d | numbers measured | "
    "margin margin ± interval of 95 % | verdict verdict"
)


def main() -> None:
    """Judge the claims, and print a table for each group of runs."""
    parser = options_of("geology_claims", __doc__)
    for name, folder, words in (
        ("tenth", "geology-seeds", "with a tenth of the disks"),
        ("full", "geology-full", "with all disks, of the fault 150 × 15 m"),
        ("doubled", "geology-doubled", "of the fault with 300 × 30 m and twice the radii"),
    ):
        parser.add_argument(
            f"--{name}", type=Path, default=Path("out") / folder, metavar="DIR", help=f"runs {words}"
        )
    parser.add_argument("--write", action="store_true", help="put the tables into docs/geology.md")
    options = parser.parse_args()
    smaller = runs_in(options.tenth)
    every: list[Row] = []
    for name, folder in (("tenth", options.tenth), ("full", options.full), ("doubled", options.doubled)):
        runs = smaller if name == "tenth" else runs_in(folder)
        for kind, claims in (("fold", FOLD), ("fault", FAULT)):
            rows = rows_of(claims, runs.get(kind, []), smaller.get(kind, []))
            every += [row | {"runs": name, "kind": kind} for row in rows]
            if not rows or options.json:
                continue
            print(f"{kind}, {name}\n")
            print_table(rows, _TABLE)
            print()
            if options.write:
                about = [f"Judged at {commit()} on {machine()}.", ""]
                write_between(f"claims-{kind}-{name}", about + table_lines(rows, _TABLE), _PAGE)
    if options.json:
        print_json(every)


def rows_of(claims: Sequence[Claim], runs: Sequence[Run], smaller: Sequence[Run] = ()) -> list[Row]:
    """Return a row for each claim of which there are runs.

    Parameters
    ----------
    runs : that are judged
    smaller : whose deviations stand for those of a single run
    """
    rows: list[Row] = []
    for claim in claims:
        found = findings(claim, runs)
        if not found:
            continue
        margins = [one.margin for one in found]
        verdict = verdict_of(margins, [one.margin for one in findings(claim, smaller)])
        rows.append(
            {
                "words": claim.words,
                "criterion": claim.criterion,
                "seeds": len(found),
                "numbers": _numbers(found, claim.digits),
                "margin": f"{verdict.margin:.2f} ± {verdict.within:.2f}"
                if np.isfinite(verdict.within)
                else f"{verdict.margin:.2f}",
                "verdict": verdict.words,
            }
        )
    return rows


def findings(claim: Claim, runs: Sequence[Run]) -> list[Finding]:
    """Return what each seed with all runs that a claim needs says of it."""
    by_seed: dict[int, dict[float, Run]] = {}
    for run in runs:
        if run.gamma in claim.gammas:
            by_seed.setdefault(run.seed, {})[run.gamma] = run
    return [claim.measure(group) for _, group in sorted(by_seed.items()) if len(group) == len(claim.gammas)]


def _numbers(found: Sequence[Finding], digits: int) -> str:
    """Return each number with mean ± standard deviation over the seeds; those that follow in time with arrows."""
    texts = []
    for label in found[0].numbers:
        values = np.array([one.numbers[label] for one in found], dtype=float)
        told = np.isfinite(values).all(axis=1)
        if not told.any():
            texts.append(f"{label}: not determined")
            continue
        means = " → ".join(f"{mean:.{digits}f}" for mean in values[told].mean(axis=0))
        scatter = values[told].std(axis=0, ddof=1) if told.sum() > 1 else ()
        deviation = " → ".join(f"{one:.{digits}f}" for one in scatter)
        some = f" in {told.sum()} of {len(told)} seeds" if not told.all() else ""
        texts.append(f"{label}: {means}" + (f" (± {deviation})" if deviation else "") + some)
    return "; ".join(texts)


# --- runs ---


def runs_in(folder: Path) -> dict[str, list[Run]]:
    """Return the runs with 100 sweeps that stand in a folder, by kind."""
    found: dict[str, list[Run]] = {}
    for path in sorted(folder.glob("f*-*-*-100/summary.json")):
        stored = read_run(path.parent)
        scene = read_geology(path.parent / "scene.toml", stored["kind"])
        sample = prepare(scene, folder / ".samples")
        instants = Instants(tuple(sorted((path.parent / "arrays").glob("fields-*.npz"))))
        course = read_rows(path.parent / "experiment.csv")
        own = scene.experiment
        if isinstance(own, Fault):
            last = _fault_numbers(own, sample, instants[-1], stored["summary"]["cohesion"]["range"])
            residual = stored["summary"]["measures"].get("trishear: residual over slip [-]")
            last["residual"] = float("nan") if residual is None else residual
            last["pushed"] = 1e-3 * pushing(stored)
        else:
            last = _fold_numbers(sample, instants, course)
        run = Run(stored["gamma"], stored["seed"], stored["cells"], course, last)
        found.setdefault(stored["kind"], []).append(run)
    return found


def _fault_numbers(own: Fault, sample: PreparedSample, fields: Fields, reach: float) -> dict[str, float]:
    """Return dip [°], thickness [m], and the shares of the disks that shear and that came off in blocks."""
    now = fields.position[: len(sample.radius), :2]
    along = np.array([np.cos(np.radians(own.dip)), np.sin(np.radians(own.dip))])
    share = (now - sample.centre) @ along / (own.speed * fields.time)
    blocks = blocks_of(sample.centre, now, sample.radius, reach)
    return {
        "dip": own.dip,
        "thickness": own.thickness,
        "sheared": float(((share > _SHEARED[0]) & (share < _SHEARED[1])).mean()),
        "detached": blocks.detached_disks / len(now),
    }


def _fold_numbers(
    sample: PreparedSample, instants: Instants, course: Mapping[str, Array]
) -> dict[str, float]:
    """Return what the layers of a fold tell at 200, 350 and 500 s, between wall and front."""
    radius, width = sample.radius, _PART * float(sample.radius.mean())
    last = instants[-1].time

    def seen(share: float) -> tuple[Array, Fields, Bools]:
        fields = min(instants, key=lambda one: abs(one.time - share * last))
        place = fields.position[: len(radius), :2]
        rear, front = (
            np.interp(fields.time, course["time"], course[name]) for name in ("rear [m]", "front [m]")
        )
        return place, fields, (place[:, 0] > rear) & (place[:, 0] < front)

    place, _, within = seen(_SIMILAR)
    number = (place[:, 0] / width).astype(np.int64)
    risen = place[:, 1] - sample.centre[:, 1]
    rises = [_by_part(number, risen, within & (sample.layer == layer)) for layer in (4, 6)]
    common = np.isfinite(rises).all(axis=0)
    place, fields, within = seen(_BANDED)
    number = (place[:, 0] / width).astype(np.int64)
    shear = _by_part(number, fields.shear, within & (sample.layer == 2) & np.isfinite(fields.shear))
    shear = shear[np.isfinite(shear)]
    place, _, within = seen(1.0)
    return {
        "resolution": width,
        "similar": float(np.corrcoef(rises[0][common], rises[1][common])[0, 1])
        if common.sum() > 2
        else float("nan"),
        "band": float(shear.max() / np.median(shear)) if len(shear) > 2 else float("nan"),
        "emerged before": _emerged(sample, sample.centre, within),
        "emerged": _emerged(sample, place, within),
    }


def _by_part(number: Ints, values: Array, chosen: Bools) -> Array:
    """Return the mean of the chosen values in each part; nan where fewer than three disks have one."""
    size = int(number.max()) + 1
    count = np.bincount(number[chosen], minlength=size)
    total = np.bincount(number[chosen], values[chosen], minlength=size)
    return np.where(count > 2, total / np.maximum(count, 1), np.nan)


def _emerged(sample: PreparedSample, place: Array, within: Bools) -> float:
    """Return the share of the surface's disks, of those within a zone, that are of the eight lower layers."""
    tops = place[:, 1] + sample.radius
    free = within & (profile(place, sample.radius, place[:, 0]) <= tops + 1e-9 * sample.radius)
    return float((sample.layer[free] < 8).mean()) if free.any() else float("nan")


if __name__ == "__main__":
    guarded(main)
