"""COLMAP itself, where it is installed, reads what we write, and projects and adjusts as we do."""

from dataclasses import replace

import numpy as np
import pytest

from survey.orientation.bundle.orient import orient
from survey.orientation.formats.colmap import write_colmap
from survey.orientation.projection import project
from tests.survey.orientation.formats.test_round_trips import written
from tests.survey.orientation.synthetic_block import noisy

pycolmap = pytest.importorskip("pycolmap")


def test_colmap_reads_a_model_and_projects_its_points_alike(tmp_path):
    network = written(forward=True)
    write_colmap(network, tmp_path)
    model = pycolmap.Reconstruction(tmp_path)
    images = {one.name: one for one in model.images.values()}
    for photo in network.photos:
        image = images[photo.name]
        ours = project(network.cameras[0], photo.rotation, photo.station, network.start)
        theirs = [image.project_point(model.points3D[int(name)].xyz) for name in network.names]
        np.testing.assert_allclose(ours, np.array(theirs), atol=1e-6)


def test_colmap_adjusts_to_the_same_sum_of_squares(tmp_path):
    network = replace(noisy(written(forward=True), np.random.default_rng(1)), control=())
    inner = network.cameras[0].inner.copy()
    inner[7] = 0.0  # the model OPENCV has no K3
    network = replace(network, cameras=(replace(network.cameras[0], inner=inner),))
    ours = orient(network)
    write_colmap(network, tmp_path)
    model = pycolmap.Reconstruction(tmp_path)
    options = pycolmap.BundleAdjustmentOptions()
    options.refine_focal_length = options.refine_extra_params = options.refine_principal_point = False
    pycolmap.bundle_adjustment(model, options)
    squares = 0.0
    for image in model.images.values():
        for point in image.points2D:
            if point.has_point3D():
                off = image.project_point(model.points3D[point.point3D_id].xyz) - point.xy
                squares += float(off @ off) / 0.5**2
    assert squares == pytest.approx(ours.solution.square, rel=1e-5)
