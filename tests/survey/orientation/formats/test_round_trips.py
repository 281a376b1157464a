"""Each format gives back what was written, to the last digits."""

import re
from dataclasses import replace

import numpy as np
import pytest

from ground.errors import SurveyError
from survey.orientation.bundle.orient import orient
from survey.orientation.formats.colmap import read_colmap, write_colmap
from survey.orientation.formats.control import read_control, with_control, write_control
from survey.orientation.formats.dbat import read_dbat, write_dbat
from survey.orientation.formats.marks import network_of, read_marks
from survey.orientation.formats.metashape import read_metashape, write_metashape
from survey.orientation.formats.photomodeler import read_photomodeler, write_photomodeler
from survey.orientation.formats.result import orientation_values, read_orientation, write_orientation
from survey.orientation.network import INTERIOR
from survey.orientation.projection import project
from survey.orientation.rotations import angles
from tests.survey.orientation.synthetic_block import (
    noisy,
    spread_points,
    wall_block,
    with_points,
    write_marks,
)

NEAR = 1e-9  # [m], [px]


def written(forward=False, plain=False):
    truth = wall_block(columns=3, points=40, forward=forward)
    network = with_points(truth, spread_points(truth, 5))
    (camera,) = network.cameras
    inner = camera.inner.copy()
    if plain:
        inner[3:5] = 0.0
    if forward:
        inner[4] = 0.0
    return replace(network, cameras=(replace(camera, inner=inner),))


def same_pictures(one, other):
    """Both networks show the same points at the same places, with the same marks, whatever their units."""
    assert [photo.name for photo in one.photos] == [photo.name for photo in other.photos]
    assert set(one.names) == set(other.names)
    order = [one.names.index(name) for name in other.names]
    np.testing.assert_allclose(other.start, one.start[order], atol=NEAR)
    for f, (a, b) in enumerate(zip(one.photos, other.photos, strict=True)):
        np.testing.assert_allclose(b.station, a.station, atol=NEAR)
        np.testing.assert_allclose(b.rotation, a.rotation, atol=NEAR)
        first, second = (
            project(net.cameras[p.camera], p.rotation, p.station, one.start)
            for net, p in ((one, a), (other, b))
        )
        np.testing.assert_allclose(second, first, atol=1e-6)
        marks = [
            {
                net.names[i]: tuple(xy)
                for i, xy in zip(net.point[net.photo == f], net.image[net.photo == f], strict=True)
            }
            for net in (one, other)
        ]
        assert marks[0].keys() == marks[1].keys()
        np.testing.assert_allclose([marks[1][k] for k in marks[0]], list(marks[0].values()), atol=NEAR)


def test_photomodeler(tmp_path):
    network = written(plain=True)
    write_photomodeler(network, tmp_path / "export.txt")
    back = read_photomodeler(tmp_path / "export.txt")
    same_pictures(network, back)
    np.testing.assert_allclose(back.cameras[0].inner, network.cameras[0].inner, rtol=1e-15)
    assert {back.names[one.point] for one in back.control} == {
        network.names[one.point] for one in network.control
    }


def test_colmap(tmp_path):
    network = written(forward=True)
    write_colmap(network, tmp_path / "model")
    same_pictures(network, read_colmap(tmp_path / "model"))


def test_metashape(tmp_path):
    network = written(forward=True)
    write_metashape(network, tmp_path / "doc.xml")
    back = read_metashape(tmp_path / "doc.xml")
    same_pictures(replace(network, start=np.where(np.isfinite(back.start), network.start, np.nan)), back)
    assert [one.place.tolist() for one in back.control] == [
        one.place.tolist() for one in sorted(network.control, key=lambda one: one.point)
    ]
    np.testing.assert_allclose(back.control[0].covariance, network.control[0].covariance, rtol=1e-12)
    np.testing.assert_allclose(back.sigma, 0.5)


@pytest.mark.parametrize("forward", [False, True])
def test_dbat(tmp_path, forward):
    network = written(forward=forward)
    network = replace(network, cameras=(replace(network.cameras[0], free=("c", "K1", "K2", "K3")),))
    back = read_dbat(write_dbat(network, tmp_path / "script"))
    (one,), (other,) = network.cameras, back.cameras
    np.testing.assert_allclose(other.inner, one.inner, rtol=1e-12)
    assert (other.size, other.pixel, other.forward, other.free) == (
        one.size,
        one.pixel,
        one.forward,
        one.free,
    )
    found = {back.names[k.point]: k for k in back.control}
    for control in network.control:
        np.testing.assert_allclose(found[network.names[control.point]].place, control.place, atol=NEAR)
    assert sorted(map(tuple, back.image.tolist())) == sorted(map(tuple, network.image.tolist()))


def test_control_points_with_full_covariance(tmp_path):
    network = written()
    covariance = np.array([[4.0, 1.0, 0.5], [1.0, 3.0, 0.2], [0.5, 0.2, 2.0]]) * 1e-6
    control = tuple(replace(one, covariance=covariance) for one in network.control)
    path = tmp_path / "control.txt"
    from survey.orientation.formats.control import ControlRow

    write_control(
        [ControlRow(network.names[one.point], "", one.place, one.covariance) for one in control], path
    )
    back = with_control(replace(network, control=()), read_control(path))
    for one, other in zip(control, back.control, strict=True):
        assert (one.place.tolist(), one.covariance.tolist()) == (
            other.place.tolist(),
            other.covariance.tolist(),
        )


def test_marks(tmp_path):
    network = written()
    write_marks(network, tmp_path / "marks.txt")
    rows = read_marks(tmp_path / "marks.txt")
    start = dict(zip(network.names, network.start, strict=True))
    back = network_of("marks.txt", rows, network.cameras, network.photos, 1.0, start)
    same_pictures(network, back)
    np.testing.assert_array_equal(back.sigma, network.sigma)


def test_the_result_of_an_orientation(tmp_path):
    truth = wall_block(columns=3, points=40, free=("c", "K1"))
    result = orient(noisy(with_points(truth, spread_points(truth, 5)), np.random.default_rng(1)))
    write_orientation(tmp_path / "orientation.json", orientation_values(result))
    back = read_orientation(tmp_path / "orientation.json")
    values = result.solution.unknowns
    np.testing.assert_allclose(back.cameras[0].inner, values.inner[0], rtol=1e-15)
    for f, photo in enumerate(back.photos):
        np.testing.assert_allclose(photo.rotation, values.rotation[f], atol=1e-14)
        np.testing.assert_array_equal(photo.station, values.station[f])
    np.testing.assert_array_equal(back.table, result.prepared.unknowns.column)
    np.testing.assert_allclose(
        back.covariance, result.statistics.sigma0**2 * result.statistics.cameras, rtol=1e-14
    )


def test_what_a_format_has_no_place_for_is_refused(tmp_path):
    with pytest.raises(SurveyError, match="backward distortion"):
        write_colmap(written(), tmp_path / "a")
    with pytest.raises(SurveyError, match="backward distortion"):
        write_metashape(written(), tmp_path / "a.xml")
    with pytest.raises(SurveyError, match=r"as 0\.0002"):
        write_photomodeler(written(), tmp_path / "a.txt")
    assert not list(tmp_path.iterdir())


def test_points_with_names_are_numbered_and_the_table_says_how(tmp_path):
    names = tuple(f"p{k}" for k in range(len(written().names)))
    plain, forward = (replace(one, names=names) for one in (written(plain=True), written(forward=True)))
    write_photomodeler(plain, tmp_path / "export.txt")
    write_colmap(forward, tmp_path / "model")
    for back, network, table in (
        (read_photomodeler(tmp_path / "export.txt"), plain, tmp_path / "export-points.txt"),
        (read_colmap(tmp_path / "model"), forward, tmp_path / "model/points-names.txt"),
    ):
        rows = table.read_text(encoding="utf-8").splitlines()[1:]
        name = dict(row.split(", ") for row in rows)
        same_pictures(network, replace(back, names=tuple(name[one] for one in back.names)))


def test_dbat_reads_distortion_as_the_toolbox_writes_it(tmp_path):
    """Its calibration has K1 0.00458861 and as 0.000389598 in the report; c4040z.xml of version 0.9.2.0 has this."""
    script = write_dbat(written(), tmp_path)
    text = script.read_text(encoding="utf-8")
    text = re.sub(r"<aspect>.*</aspect>", "<aspect>0.999610402</aspect>", text)
    text = re.sub(r"<K>.*</K>", "<K>0.00458860,-4.51351e-05,-2.05253e-06</K>", text)
    text = re.sub(r"<P>.*</P>", "<P>-6.12803e-05,-4.41171e-05</P>", text)
    text = re.sub(r"<cc>.*</cc>", "<cc>7.45699</cc>", text)
    script.write_text(text, encoding="utf-8")
    inner = dict(zip(INTERIOR, read_dbat(script).cameras[0].inner, strict=True))
    expected = {"as": 3.89598e-4, "K1": 4.5886e-3, "K2": -4.51351e-5, "K3": -2.05253e-6, "P1": -6.12803e-5}
    assert {name: inner[name] for name in expected} == pytest.approx(expected, rel=1e-6)


def test_dbat_stations_known_beforehand(tmp_path):
    made = written()
    script = write_dbat(made, tmp_path)
    back = read_dbat(script)
    for one, other in zip(made.photos, back.photos, strict=True):
        assert np.abs(one.station - other.station).max() < 1e-9
        assert np.abs(one.rotation - other.rotation).max() < 1e-9
        assert other.observed_station is None
    rows = [f"{k}, 1.0, 2.0, 3.0, 0.05, 0.1, 0.2, 0.3" for k in range(1, len(made.photos) + 1)]
    (tmp_path / "stations.txt").write_text("\n".join(rows), encoding="utf-8")
    text = script.read_text(encoding="utf-8")
    text = text.replace("id,x,y,z,omega,phi,kappa", "id,x,y,z,sxyz,omega,phi,kappa")
    script.write_text(text.replace('units="degrees"', 'units="radians"'), encoding="utf-8")
    photo = read_dbat(script).photos[1]
    np.testing.assert_array_equal(photo.observed_station, [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(photo.station_sigma, [0.05] * 3)
    np.testing.assert_allclose(angles(photo.rotation), [0.1, 0.2, 0.3])
    assert photo.observed_rotation is None
    (tmp_path / "stations.txt").write_text("\n".join(rows).replace("0.05", "0.0"), encoding="utf-8")
    with pytest.raises(SurveyError, match="a deviation of 0"):
        read_dbat(script)


def test_dbat_keeps_stations_and_angles_that_are_observed(tmp_path):
    made = written()
    station = {"observed_station": np.array([1.0, 2.0, 3.0]), "station_sigma": np.array([0.1, 0.2, 0.3])}
    turn = {"observed_rotation": made.photos[1].rotation, "angle_sigma": np.array([0.01, 0.02, 0.03])}
    given = (replace(made.photos[0], **station), replace(made.photos[1], **station, **turn), *made.photos[2:])
    back = read_dbat(write_dbat(replace(made, photos=given), tmp_path)).photos
    np.testing.assert_array_equal(back[0].observed_station, station["observed_station"])
    assert back[0].observed_rotation is None
    np.testing.assert_allclose(back[0].rotation, made.photos[0].rotation, atol=1e-9)
    np.testing.assert_array_equal(back[1].station_sigma, station["station_sigma"])
    np.testing.assert_allclose(back[1].observed_rotation, turn["observed_rotation"], atol=1e-9)
    np.testing.assert_allclose(back[1].angle_sigma, turn["angle_sigma"])
    assert back[2].observed_station is None
    np.testing.assert_allclose(back[2].station, made.photos[2].station)


def test_photomodeler_holds_one_size_of_photographs(tmp_path):
    made = written(plain=True)
    cameras = (made.cameras[0], replace(made.cameras[0], name="other", size=(4000, 3000)))
    with pytest.raises(SurveyError, match="different sizes"):
        write_photomodeler(replace(made, cameras=cameras), tmp_path / "a.txt")


def test_check_points_of_metashape_remain_check_points(tmp_path):
    network = written(forward=True)
    checks = tuple(replace(one, check=k == 1) for k, one in enumerate(network.control))
    write_metashape(replace(network, control=checks), tmp_path / "doc.xml")
    back = read_metashape(tmp_path / "doc.xml")
    assert {back.names[one.point] for one in back.control if one.check} == {network.names[checks[1].point]}
