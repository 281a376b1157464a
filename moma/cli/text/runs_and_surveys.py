"""Reports of `moma ingest`, `run` and `survey-report` as text."""

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from moma.cli.text.formats import shorten, some

if TYPE_CHECKING:
    from pipelines.ingest.report import IngestReport, SolidsReport
    from pipelines.reports.survey.report import SurveyReport
    from pipelines.run.run import RunReport
    from survey.records.review import Doubtful

_SHOWN = 20  # lines of a list; the report has all


def ingest_lines(report: "IngestReport", verbose: bool) -> list[str]:
    """Describe the contents of each survey file, and what was left out."""
    lines = []
    for file in report.files:
        kinds = ", ".join(f"{count} {kind}" for kind, count in file.stones.items())
        lines.append(f"{file.path}: {sum(file.stones.values())} stones of survey {file.survey!r} ({kinds})")
        lines += [f"  question: {question}" for question in file.questions]
        lines += [f"  {one}" for one in file.reading]
        if file.again:
            lines.append(f"  {file.again} of them were in the database and have a new measurement")
        if file.worst:
            lines.append(
                f"  {sum(file.rejected.values())} points left out as blunders on {len(file.rejected)} stones; "
                f"worst plane: {file.worst}, rms {file.rms * 1e3:.1f} mm"
            )
        if file.frame is not None:
            lines.append(f"  {_frame_line(file.frame)}")
        changed = [f"  {code}: {'; '.join(texts)}" for code, texts in file.remarks.items()]
        lines += changed if verbose else shorten(changed, 5, "  ", ", with -v")
        doubts = [f"  doubtful: {code}: {text}" for code, text in file.doubts.items()]
        lines += doubts if verbose else shorten(doubts, 5, "  ", ", with -v")
        if file.shapes:
            lines.append(f"  {len(file.shapes)} faces are not one plane: {some(list(file.shapes))}")
        if verbose:
            lines += [f"  {code}: {count} left out" for code, count in file.rejected.items()]
            lines += [f"  {code}: {text}" for code, text in file.shapes.items()]
        if file.solids is not None:
            lines += _solid_lines(file.solids, verbose)
        if file.review:
            lines += _review_lines(file.review, verbose)
        if file.refused:
            lines.append(f"  {len(file.refused)} stones rejected, to be corrected in {file.rejects}:")
            reasons = [f"    {one.reason}" for one in file.refused]
            lines += reasons if verbose else shorten(reasons, 5, "    ")
    return lines


def _review_lines(review: "Sequence[Doubtful]", verbose: bool) -> list[str]:
    """Describe the outlines that should be looked at."""
    counts = Counter(doubt.reason for doubt in review)
    lines = [f"  look at {len(review)}: {', '.join(f'{count} {reason}' for reason, count in counts.items())}"]
    texts = [f"    {doubt.code or doubt.where}: {doubt.reason}: {doubt.text}" for doubt in review]
    return lines + (texts if verbose else shorten(texts, 5, "    ", ", with -v or in --review FILE"))


def _solid_lines(solids: "SolidsReport", verbose: bool) -> list[str]:
    """Describe the solids of a file: convexity, remarks, and changes by snapping."""
    lines = [f"  {solids.convex} convex, {len(solids.not_convex)} not"]
    if verbose and solids.not_convex:
        lines.append(f"  not convex: {', '.join(solids.not_convex)}")
    if (snapping := solids.snapping) is not None:
        lines.append(
            f"  {snapping.contacts} contacts brought into {snapping.planes} planes within "
            f"{snapping.tolerance:g} m; corners moved by up to {snapping.largest_movement:.2g} m"
        )
        if snapping.left_open:
            lines.append(f"  {len(snapping.left_open)} contacts left as they are:")
        left = [f"    {' and '.join(one.stones)}: {one.reason}" for one in snapping.left_open]
        lines += left if verbose else shorten(left, 5, "    ", ", with -v")
    elif solids.decimals is not None:
        lines.append(
            f"  coordinates have {solids.decimals} decimals: if they are rounded, --snap "
            f"{2.0 * 10.0**-solids.decimals:g} brings faces that match into one plane"
        )
    remarks = [f"  {code}: {'; '.join(texts)}" for code, texts in solids.remarks.items()]
    return lines + (remarks if verbose else shorten(remarks, 5, "  ", ", with -v"))


def _frame_line(frame: dict[str, Any]) -> str:
    """Describe how well the control points tie the survey to the site."""
    left_out = [point["name"] for point in frame["control"] if point["rejected"]]
    residuals = [
        sum(value**2 for value in point["residual"]) ** 0.5
        for point in frame["control"]
        if not point["rejected"]
    ]
    sigma0 = "" if frame["sigma0"] is None else f", σ₀ {frame['sigma0']:.2f}"
    return (
        f"in the frame of the site by {len(residuals)} control points: scale {frame['scale']:.6f}, largest "
        f"residual {max(residuals) * 1e3:.1f} mm{sigma0}"
        + (f"; left out as blunders: {', '.join(left_out)}" if left_out else "")
    )


def run_lines(report: "RunReport", verbose: bool) -> list[str]:
    """Describe the outcome of a run, and list its files."""
    summary = report.summary
    bodies, reaction, stress = summary["bodies"], summary["reaction"], summary["von_mises"]
    lines = [
        f"{summary['scene']}: {summary['headline']} "
        f"({summary['steps']} steps, {summary['time']['wall']:.1f} s of work)",
        *(f"  caution: {caution}" for caution in summary["cautions"]),
        f"  {', '.join(f'{count} {name}' for name, count in bodies.items())} stones, "
        f"{summary['contacts']} contact points",
        f"  weight {reaction['weight'] / 1e3:z.2f} kN, reaction {reaction['total_vertical'] / 1e3:z.2f} kN, "
        f"{_displacement(summary)}",
        *_peak_lines(summary),
    ]
    if stress is not None:
        mean, p99, largest = (stress[name] / 1e6 for name in ("mean", "p99", "max"))
        lines.append(
            f"  Von Mises stress: 1 % of the volume above {p99:.4f} MPa, mean {mean:.4f} MPa, "
            f"largest {largest:.4f} MPa, at a corner or an edge, where it grows with a finer mesh"
        )
    if (static := summary["static"]) is not None and static["found"]:
        lines.append(
            f"  began in static equilibrium: {static['steps']} steps of the search, balance {static['balance']:.1e}, "
            f"natural_map {static['natural_map']:.1e}"
        )
    lines += [_stage_line(number, stage) for number, stage in enumerate(summary["stages"], 1)]
    lines += _joint_lines(summary)
    lines += _profile_lines(summary["profile"])
    errors = {name: value for name, value in summary["errors"].items() if value is not None}
    lines.append("  errors: " + ", ".join(f"{name} {_short(value)}" for name, value in errors.items()))
    if verbose:
        stages = summary["time"]["by_stage"].items()
        lines.append("  time: " + ", ".join(f"{stage} {seconds:.2f} s" for stage, seconds in stages))
    pictures = [name for name in summary["files"] if name.endswith(".png")]
    shown = (*pictures, "report.html", "results.vtkhdf", "results.pvd", "summary.json")
    return [*lines, *(f"  {report.folder / name}" for name in shown if name in summary["files"])]


def _stage_line(number: int, stage: dict[str, Any]) -> str:
    """Describe one stage of building."""
    counts = [f"{stage[name]} {name}" for name in ("laid", "removed", "held") if stage[name]]
    counted = f" ({', '.join(counts)})" if counts else ""
    bed = f", beds up to {1e3 * stage['bed']:+.1f} mm" if stage["bed"] else ""
    return (
        f"  stage {number}, {stage['name']}: {stage['outcome']} after {stage['time']:.4g} s, {stage['stones']} stones"
        f"{counted}, weight {stage['weight'] / 1e3:z.2f} kN, reaction "
        f"{stage['reaction'] / 1e3:z.2f} kN, displacement {1e3 * stage['displacement']['max']:.2f} mm{bed}, "
        f"balance {stage['errors']['balance']:.1e}"
    )


def _displacement(summary: dict[str, Any]) -> str:
    """Describe the largest displacement of a run, and the one that is left."""
    from pipelines.reports.html import millimetres

    displacement, least = summary["displacement"], summary["tolerance"]["length"]
    largest, end = (f"{millimetres(displacement[name], least)}" for name in ("max", "end"))
    if displacement["time"] is None or largest == end:
        return f"largest displacement {largest}"
    return f"largest displacement {largest} after {displacement['time']:.4g} s, {end} at the end"


def _peak_lines(summary: dict[str, Any]) -> list[str]:
    """Describe the peaks of a run that its end does not show."""
    from archmodel.quantities import quantities_of
    from pipelines.reports.peaks import passed_peaks, peak_text

    passed, least, peaks = passed_peaks(summary), summary["tolerance"]["length"], quantities_of("peak")
    passed.pop("displacement", None)  # stated before
    lines = [f"    {_uncapital(peaks[name].label)}: {peak_text(one, least)}" for name, one in passed.items()]
    return [*(["  larger during the run than at its end:"] if lines else []), *lines]


def _uncapital(text: str) -> str:
    return text if text.startswith("Von") else text[:1].lower() + text[1:]


def _joint_lines(summary: dict[str, Any]) -> list[str]:
    """Describe the joints; slivers, and forces that are not the only ones possible, in lines of their own."""
    from pipelines.reports.html import millimetres

    joints, least = summary["joints"], summary["tolerance"]["length"]
    if not joints["count"]:
        return []
    lines = [
        f"  {joints['count']} joints: {joints['out_of_kern']} of {joints['pressed']} compressed ones have their "
        f"resultant outside the kern, largest opening {millimetres(joints['largest_opening'], least)}, "
        f"largest sliding {millimetres(joints['largest_sliding'], least)}"
    ]
    if (slivers := joints["slivers"])["count"]:
        lines.append(
            f"    slivers among them, of no more than {100 * slivers['limit']:g} % of the faces of their stones: "
            f"{slivers['count']}, with {slivers['force'] / 1e3:z.3g} kN; kern and pressures leave them out"
        )
    if (text := summary["admissible"]["text"]) is not None:
        lines.append(f"    {text}")
    return lines


def profile_lines(name: str) -> list[str]:
    """Describe a profile, with its errors on the reference scenes."""
    from pipelines.tuning.measured_errors import ERRORS
    from pipelines.tuning.profiles import PROFILES

    ranges = (
        f"{quantity} {_part(low)} to {_part(high)}" for quantity, (_, low, high) in ERRORS[name].items()
    )
    return [
        f"  profile {name}: {PROFILES[name].about}",
        f"  its errors on the scenes on which it was measured: {', '.join(ranges)}",
    ]


def _profile_lines(profile: dict[str, Any] | None) -> list[str]:
    """Describe the profile of a run, with the errors to expect; nothing without one."""
    if profile is None:
        return []
    lines = [f"  profile {profile['name']}: {profile['about']}"]
    if profile["expected"]:
        expected = (
            f"{name} {'up to ' if one['bound'] else ''}{_part(one['value'])}"
            for name, one in profile["expected"].items()
        )
        return [*lines, "  expected errors, as measured on other scenes: " + ", ".join(expected)]
    return [*lines, "  errors to expect are known for scenes at rest only"]


def _part(value: float) -> str:
    return f"{100.0 * value:.{1 if value < 0.0995 else 0}f} %"


def survey_report_lines(report: "SurveyReport", verbose: bool) -> list[str]:
    """Describe the precision of a survey and what to measure again, and list the files of the report."""
    study, quality = report.study, report.study.quality
    files = ", ".join(file.head.path for file in study.files)
    lines = [
        f"{files}: {len(study.stones)} stones of survey {study.name!r}"
        + (f", {len(study.rejects)} could not be made" if study.rejects else ""),
        f"  {quality.points} points and corners, {quality.blunders} left out as blunders, {quality.worn} worn corners",
    ]
    if study.stones:
        known = "" if quality.sigma0 is None else f"rms {quality.rms * 1e3:.2f} mm; "
        lines.append(f"  {known}{quality.verdict}")
    if without := quality.depths.get("none"):
        lines.append(
            f"  {without} stones without a depth, which ingest requires: measure it, or give a rule in the header "
            "of the survey"
        )
    for file in study.files:
        if (fit := file.transform) is not None:
            left_out = f", left out: {', '.join(fit.rejected)}" if fit.rejected else ""
            lines.append(
                f"  {len(fit.names)} control points, σ₀ {fit.sigma0:.2f}, scale {fit.scale:.6f}{left_out}"
            )
    lines += [
        f"  {facade.name}: {len(facade.members)} stones, {facade.area:.1f} m²"
        + ("" if facade.azimuth is None else f", looks to {facade.azimuth:.0f}°")
        for facade in study.facades
    ]
    if study.since is not None:
        from pipelines.reports.survey.campaigns import comparison_lines

        lines += [f"  {line}" for line in comparison_lines(study.since)]
    lines += _movement_lines(report, verbose)
    masonry = _masonry_lines(report)
    lines += masonry if verbose else shorten(masonry, _SHOWN, "  ", ", with -v")
    lines += [
        f"  {contradiction.code} is called a {contradiction.kind}, but {contradiction.text}"
        for contradiction in study.contradictions[:_SHOWN]
    ]
    changed = [
        f"  {stone.code}: {'; '.join(stone.remarks)}"
        for stone in study.stones
        if stone.remarks and stone.measured
    ]
    lines += changed if verbose else shorten(changed, _SHOWN, "  ", ", with -v")
    again = [
        f"  {row.code or '(no code)'}: {row.reason}; {row.action}"
        + (f" (decides {row.changes})" if row.changes else "")
        for row in study.again.rows
    ]
    lines.append(
        "measure again, what changes a verdict first:" if again else "nothing needs to be measured again"
    )
    lines += again
    if study.again.more:
        lines.append(f"  and {study.again.more} more, in survey.json")
    lines += [f"  not to be measured again: {one}" for one in study.again.left]
    return [*lines, *(f"  {report.folder / name}" for name in report.content["files"])]


def _movement_lines(report: "SurveyReport", verbose: bool) -> list[str]:
    """Tell what has moved, what is excluded, and which stones are out of place."""
    study = report.study
    found, still = [], []
    for beds in study.beds:
        place = _wall(beds.facade, beds.zone)
        found += [
            f"  {place}: {movement.text}{'' if movement.older_than is None else f'; {movement.dating}'}"
            for movement in beds.movements
        ]
        if not beds.movements and beds.excluded is not None:
            still.append(
                f"  {place}, beds: no movement found; more than {beds.excluded * 1e3:.1f} mm is excluded"
            )
    for face in study.faces:
        place = _wall(face.facade, face.zone)
        found += [f"  {place}: {movement.text}" for movement in face.movements]
        if not face.movements and face.excluded is not None:
            still.append(
                f"  {place}, face: no movement found; more than {face.excluded * 1e3:.1f} mm is excluded"
            )
    odd = [f"  {stone.code}: {stone.text}" for face in study.faces for stone in face.odd]
    odd += [f"  {stone.code}: {stone.text}" for beds in study.beds for stone in beds.odd]
    if verbose:
        return [*found, *still, *odd]
    return [*found, *still[:_SHOWN], *shorten(odd, _SHOWN, "  ", ", with -v")]


def _wall(facade: str, zone: str | None) -> str:
    return facade + (f" of {zone}" if zone else "")


def _masonry_lines(report: "SurveyReport") -> list[str]:
    lines = []
    for wall in report.study.masonry:
        place = _wall(wall.facade, wall.zone)
        indices = ", ".join(
            f"{direction.replace('_', ' ')} {low:.1f} to {high:.1f} ({wall.categories[direction]})"
            for direction, (low, high) in wall.indices.items()
        )
        trace = "" if wall.trace is None else f"; minimum trace {wall.trace:.2f} ± {wall.trace_sigma:.2f}"
        lines.append(f"  {place}: masonry quality index {indices}{trace}")
    return lines


def _short(value: float | int) -> str:
    return str(value) if isinstance(value, int) else f"{value:.1e}"
