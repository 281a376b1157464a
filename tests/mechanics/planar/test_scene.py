"""What a scene of the plane refuses, and the arrays made from it."""

import numpy as np
import pytest

from ground.errors import SceneError
from mechanics.planar.model import build_planar_model
from mechanics.planar.scene import Disk, PlanarScene, PlanarTime, Wall
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import ImposedMotion
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import LawRule

DISK = Disk("d", (0.0, 1.0), 0.5)
WALL = Wall("w", (-1.0, 0.0), (1.0, 0.0))


def moves(*codes):
    return Loads(
        motions=tuple(ImposedMotion(frozenset({c}), History.constant([1.0, 0.0, 0.0])) for c in codes)
    )


@pytest.mark.parametrize(
    ("build", "said"),
    [
        (lambda: Disk("a", (0, 0), 0.0), "disk 'a': radius = 0.0; give metres greater than 0"),
        (lambda: Disk("a", (0, 0), 1.0, density=-1.0), "density = -1.0"),
        (lambda: Disk("a", (0, 0, 0), 1.0), "centre"),
        (lambda: Disk("a", (0, np.nan), 1.0), "not finite"),
        (lambda: Disk("a", (0, 0), 1.0, velocity=(1, 0, 0), fixed=True), "fixed, and has a velocity"),
        (lambda: Wall("b", (1, 2), (1, 2)), "wall 'b': has no length"),
        (lambda: Wall("b", (1, 2), (1, np.inf)), "not finite"),
        (lambda: Wall("b", (1, 2), (1,)), "ends"),
        (lambda: PlanarTime(step=0.0), "step = 0.0"),
        (lambda: PlanarTime(theta=0.4), "theta = 0.4; give from 0.5 to 1"),
        (lambda: PlanarTime(duration=np.inf), "duration"),
        (lambda: PlanarTime(balance_tolerance=0.0), "balance_tolerance"),
        (lambda: PlanarScene("s", ()), "s: the scene has no disks"),
        (lambda: PlanarScene("s", (DISK, DISK)), "codes used twice: d"),
        (lambda: PlanarScene("s", (DISK,), (Wall("d", (0, 0), (1, 0)),)), "codes used twice: d"),
        (lambda: PlanarScene("s", (DISK,), alert_distance=-0.1), "alert_distance"),
        (
            lambda: PlanarScene("s", (DISK,), largest_overlap=0.0),
            "s: largest_overlap = 0.0; give a number greater than 0",
        ),
        (lambda: PlanarScene("s", (DISK,), thickness=0.0), "thickness"),
        (lambda: PlanarScene("s", (DISK,), gravity=(0.0, np.nan)), "gravity"),
        (lambda: PlanarScene("s", (DISK,), frame_every=-1), "frame_every"),
        (
            lambda: PlanarScene(
                "s", (DISK,), rules=(LawRule(frozenset({"x"}), frozenset({"d"}), DryJoint()),)
            ),
            "a contact rule names 'x', which is not there",
        ),
        (lambda: PlanarScene("s", (DISK,), loads=moves("x")), "a motion names 'x'"),
        (
            lambda: PlanarScene("s", (DISK,), loads=moves("d")),
            "disk 'd': has an imposed motion, but is not fixed",
        ),
        (lambda: PlanarScene("s", (DISK,), (WALL,), loads=moves("w", "w")), "'w' has two imposed motions"),
    ],
)
def test_what_is_wrong_is_refused_with_its_place(build, said):
    with pytest.raises(SceneError, match=said):
        build()


def test_masses_are_those_of_the_slice():
    # m = ρ t π R², J = m R²/2; what is fixed cannot be moved
    scene = PlanarScene(
        "s", (DISK, Disk("e", (3.0, 0.0), 2.0, 1000.0, 0.3, (1.0, 2.0, 3.0)), Disk("f", (9, 9), 1.0, fixed=True)),
        (WALL,), thickness=0.2,
    )  # fmt: skip
    model, start = build_planar_model(scene)
    mass = 1000.0 * 0.2 * np.pi * 4.0
    assert model.mass[1] == pytest.approx(mass, rel=1e-15)
    np.testing.assert_allclose(model.inertia[1], [1 / mass, 1 / (mass * 2.0)], rtol=1e-15)
    np.testing.assert_array_equal(model.fixed, [False, False, True, True])
    np.testing.assert_array_equal(model.inertia[2:], 0.0)
    np.testing.assert_allclose(start.centre[1], [3.0, 0.0])
    np.testing.assert_allclose(start.velocity[1], [1.0, 2.0, 3.0])
    np.testing.assert_allclose(start.angle, [0.0, 0.3, 0.0, 0.0])
    np.testing.assert_allclose(model.ends(start), [[[-1.0, 0.0], [1.0, 0.0]]])


def test_of_two_rules_for_a_pair_the_later_holds():
    both = frozenset({"d", "w"})
    rules = tuple(LawRule(both, both, DryJoint(mu)) for mu in (0.1, 0.2))
    model, _ = build_planar_model(PlanarScene("s", (DISK, Disk("e", (5, 5), 1.0)), (WALL,), rules=rules))
    law = model.laws.of(np.array([[0, 2], [1, 2], [0, 1]]))
    assert [model.laws.laws[k].friction for k in law] == [0.2, 0.6, 0.6]
