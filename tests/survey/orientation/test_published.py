"""Projects that others adjusted (Börlin & Grussenmeyer's toolbox), value by value, to the digits that they printed."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from survey.orientation.bundle.orient import orient
from survey.orientation.bundle.start import without_start
from survey.orientation.formats.control import read_control, with_control
from survey.orientation.formats.photomodeler import read_photomodeler
from survey.orientation.formats.result import orientation_values

DATA = Path(__file__).parents[4] / "shared" / "data" / "photogrammetry"
CAMERA = {
    "Camera Constant": "c",
    "px - principal point x": "xp",
    "py - principal point y": "yp",
    "as - off-unit aspect parameter": "as",
    **{f"K{k} - radial distortion {k}": f"K{k}" for k in (1, 2, 3)},
    **{f"P{k} - decentering distortion {k}": f"P{k}" for k in (1, 2)},
}
ANGLES = {"Omega": "omega", "Phi": "phi", "Kappa": "kappa", "Xc": "x", "Yc": "y", "Zc": "z"}

pytestmark = pytest.mark.skipif(not DATA.exists(), reason="the data of others is not here")


def project(name, calibrate=()):
    export = read_photomodeler(DATA / f"{name}-pmexport.txt")
    network = with_control(export, read_control(DATA / f"{name}-control.txt"))
    return replace(network, cameras=tuple(replace(one, free=calibrate) for one in network.cameras))


def same(printed, value, sigma=0.0, wrap=False):
    """Whether a value rounds to what was printed; their iteration ends at a change of 10⁻⁶ of the deviations."""
    mantissa, _, power = printed.lower().partition("e")
    digits = len(mantissa.partition(".")[2])
    unit = 10.0 ** (int(power or 0) - digits)
    off = value - float(printed)
    if wrap:
        off = (off + 180.0) % 360.0 - 180.0
    return abs(off) <= 0.5001 * unit + 1e-6 * sigma


def published(name):
    """The values and deviations of a result file: (of what, parameter) -> (value, deviation)."""
    of, parameter, out = None, None, {}
    for line in (DATA / f"{name}-expected.txt").read_text(encoding="utf-8").splitlines():
        text = line.strip()
        if found := re.fullmatch(r"Photo \d+: (\S+)", text):
            of = found[1]
        elif text.rstrip(":") in (CAMERA if of is None else ANGLES):
            parameter = (CAMERA if of is None else ANGLES)[text.rstrip(":")]
        elif (found := re.match(r"(Value|Deviation):\s+(\S+)", text)) and parameter:
            out.setdefault((of, parameter), {})[found[1]] = found[2]
        elif text == "Quality":
            break
        elif text.endswith(":"):
            parameter = None
    return out


def check(name, values):
    expected = published(name)
    photos = {one["name"]: one for one in values["photos"]}
    wrong, count = [], 0
    for (of, parameter), one in expected.items():
        if of is None:
            value, sigma = (values["camera"][parameter][what] for what in ("value", "sigma"))
        else:
            value, sigma = photos[of][parameter], photos[of]["sigma"][parameter]
        count += len(one)
        if not same(one["Value"], value, sigma, wrap=parameter in ("omega", "phi", "kappa")):
            wrong.append((of, parameter, one["Value"], value))
        if "Deviation" in one and not same(one["Deviation"], sigma):
            wrong.append((of, parameter, one["Deviation"], sigma))
    assert not wrong
    return count


def test_a_calibration_with_fixed_control_points_agrees_in_every_digit():
    calibrate = ("c", "xp", "yp", "as", "K1", "K2", "K3", "P1", "P2")
    result = orient(project("camcal", calibrate))
    values = orientation_values(result)
    assert f"{values['sigma0']:.4f}" == "1.6148"
    assert (values["redundancy"], values["observations"], values["unknowns"]) == (3725, 4148, 423)
    assert check("camcal", values) == 2 * (9 + 21 * 6)
    # K2 and K3: -97.9 %
    (one,) = values["correlations"]
    assert (one["a"], one["b"], f"{100 * one['value']:.1f}") == ("K2", "K3", "-97.9")
    # "Point precision" and "Point marking residuals"
    sigma = {one["id"]: np.sqrt(np.diag(one["covariance"])) for one in values["points"]}
    sigma = {name: one for name, one in sigma.items() if one.any()}  # control points are fixed
    assert len(sigma) == 96
    total = {name: float(np.linalg.norm(one)) for name, one in sigma.items()}
    assert (min(total, key=total.get), max(total, key=total.get)) == ("49", "90")
    assert [f"{one:.1e}" for one in sigma["90"]] == ["5.0e-05", "5.3e-05", "8.5e-05"]
    residuals = np.linalg.norm(result.residuals, axis=1)
    worst = int(np.argmax(residuals))
    names = (
        result.network.names[result.network.point[worst]],
        result.network.photos[result.network.photo[worst]].name,
    )
    assert (f"{residuals[worst]:.3f}", *names) == ("0.955", "1003", "P8250025.JPG")
    assert f"{np.sqrt((residuals**2).mean()):.3f}" == "0.216"


def test_weighted_control_points_of_aerial_photographs_agree_in_every_digit():
    result = orient(project("sxb"))
    values = orientation_values(result)
    assert f"{values['sigma0']:.6f}" == "0.965375"
    assert (values["redundancy"], values["observations"], values["unknowns"]) == (69, 150, 81)
    assert check("sxb", values) == 5 * 6 * 2 + 9
    points = {one["id"]: one for one in values["points"]}
    text = (
        (DATA / "sxb-expected.txt").read_text(encoding="utf-8").partition("Posterior")[2].partition("Diff")[0]
    )
    rows = [[word.strip() for word in line.split(",")] for line in text.splitlines()[2:] if "," in line]
    assert len(rows) == 16
    for number, x, y, z, sx, sy, sz, *_ in rows:
        deviations = np.sqrt(np.diag(points[number]["covariance"]))
        assert all(same(text, value) for text, value in zip((x, y, z), points[number]["xyz"], strict=True))
        assert all(same(text, value) for text, value in zip((sx, sy, sz), deviations, strict=True))
    pairs = {(one["of"], one["a"], one["b"]): one["value"] for one in values["correlations"]}
    assert (
        f"{100 * pairs['8936.jpg', 'omega', 'y']:.1f} {100 * pairs['8936.jpg', 'phi', 'x']:.1f}"
        == "-100.0 99.9"
    )


def test_the_forward_model_agrees_in_every_digit():
    """Of the same calibration by the forward model 1: the toolbox prints K and P with the opposite sign."""
    one = project("camcal", ("c", "xp", "yp", "K1", "K2", "K3", "P1", "P2"))
    inner = one.cameras[0].inner * np.r_[np.ones(5), -np.ones(5)]
    one = replace(one, cameras=(replace(one.cameras[0], forward=True, inner=inner),))
    values = orientation_values(orient(one))
    assert (f"{values['sigma0']:.5f}", values["redundancy"]) == ("1.62168", 3726)
    camera = values["camera"]
    expected = {
        "c": ("7.45748", "0.00107"),
        "xp": ("3.61634", "0.000866"),
        "yp": ("2.60757", "0.000986"),
        "K1": ("-0.00453336", "1.84e-05"),
        "K2": ("9.80889e-05", "2.03e-06"),
        "K3": ("-1.82929e-07", "7.00e-08"),
        "P1": ("5.69267e-05", "3.13e-06"),
        "P2": ("2.75179e-05", "3.50e-06"),
    }
    for name, (value, sigma) in expected.items():
        assert same(value, camera[name]["value"]), name
        assert same(sigma, camera[name]["sigma"]), name
    first = values["photos"][0]
    assert [f"{first[name]:.6f}" for name in ("omega", "x", "y", "z")] == [
        "-39.431706", "0.454874", "1.793834", "1.469413",
    ]  # fmt: skip


def test_fixed_control_points_of_aerial_photographs_agree():
    """Without the points that are no control points, all of which keep their places."""
    one = project("sxb")
    mine = np.isin(one.point, [control.point for control in one.control])
    one = replace(
        one, photo=one.photo[mine], point=one.point[mine], image=one.image[mine], sigma=one.sigma[mine],
        lines=one.lines[mine], control=tuple(replace(c, covariance=np.zeros((3, 3))) for c in one.control),
    )  # fmt: skip
    values = orientation_values(orient(one))
    assert (f"{values['sigma0']:.4f}", values["redundancy"]) == ("1.0419", 64)
    first = values["photos"][0]
    found = {name: (first[name], first["sigma"][name]) for name in ("omega", "phi", "kappa", "x", "y", "z")}
    expected = {
        "omega": ("0.783992", "0.045"),
        "phi": ("-0.419915", "0.031"),
        "kappa": ("-89.916837", "0.00511"),
        "x": ("-118.672965", "0.991"),
        "y": ("109.358761", "1.41"),
        "z": ("1776.759605", "0.178"),
    }
    for name, (value, sigma) in expected.items():
        assert same(value, *found[name][:1], sigma=50.0 * found[name][1]), (
            name
        )  # their iteration ends earlier
        assert same(sigma, found[name][1]), name


@pytest.mark.parametrize(("name", "sigma0"), [("camcal", 1.6148), ("sxb", 0.965375)])
def test_the_result_does_not_depend_on_start_values(name, sigma0):
    calibrate = ("c", "xp", "yp", "as", "K1", "K2", "K3", "P1", "P2") if name == "camcal" else ()
    result = orient(without_start(project(name, calibrate)))
    assert result.statistics.sigma0 == pytest.approx(sigma0, abs=5e-5)
