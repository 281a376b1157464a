"""Materials: what is refused, and the stiffness that relates stress to strain."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ground.errors import SceneError
from mechanics.stones.elasticity.tensors import from_voigt, to_voigt
from mechanics.stones.materials import Material, Orthotropy

# along the bed of a sandstone, across it
BEDDED = Orthotropy(young=(12e9, 10e9, 6e9), shear=(4e9, 2.5e9, 3e9), poisson=(0.2, 0.25, 0.1))


def material(**changes):
    return Material("stone", **({"density": 2000.0, "young": 1e9, "poisson": 0.2} | changes))


@pytest.mark.parametrize(
    ("quantity", "value"),
    [
        ("density", 0.0),
        ("young", -1.0),
        ("poisson", 0.5),
        ("poisson", -0.1),
        ("poisson", float("nan")),
        ("mass_damping", -1e-9),
        ("stiffness_damping", -1.0),
        ("stiffness_damping", float("nan")),
        ("tensile_strength", 0.0),
        ("compressive_strength", -5e6),
    ],
)
def test_values_without_meaning_are_refused_with_the_material_named(quantity, value):
    with pytest.raises(SceneError, match=f"material 'stone': {quantity} = .*; give"):
        material(**{quantity: value})


def test_limits_are_accepted():
    material(
        poisson=0.0, mass_damping=0.0, stiffness_damping=0.0, tensile_strength=1.0, compressive_strength=None
    )
    material(poisson=0.49)


def test_isotropic_stiffness_is_hookes():
    one = material(young=3e9, poisson=0.25)
    strain = np.array([1e-4, -2e-4, 0.5e-4, 3e-4, -1e-4, 2e-4])
    tensor = from_voigt(strain * [1, 1, 1, 0.5, 0.5, 0.5])
    # ε = ((1 + ν) σ - ν tr σ)/E
    stress = from_voigt(one.stiffness @ strain)
    np.testing.assert_allclose(
        (1.25 * stress - 0.25 * np.trace(stress) * np.eye(3)) / 3e9, tensor, atol=1e-18
    )
    assert not one.stiffness.flags.writeable


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_pull_along_an_axis_stretches_by_its_modulus_and_narrows_by_its_ratios(axis):
    stiffness = material(orthotropy=BEDDED).stiffness
    stress = np.zeros(6)
    stress[axis] = 1e6
    strain = np.linalg.solve(stiffness, stress)
    young, poisson, following = BEDDED.young[axis], BEDDED.poisson[axis], (axis + 1) % 3
    assert strain[axis] == pytest.approx(1e6 / young, rel=1e-12)
    assert strain[following] == pytest.approx(-poisson * 1e6 / young, rel=1e-12)
    # ν_ji / E_j = ν_ij / E_i
    before = (axis + 2) % 3
    assert strain[before] == pytest.approx(-BEDDED.poisson[before] / BEDDED.young[before] * 1e6, rel=1e-12)
    np.testing.assert_allclose(strain[3:], 0.0, atol=1e-20)


def test_shear_moduli_belong_to_their_planes():
    stiffness = material(orthotropy=BEDDED).stiffness
    np.testing.assert_allclose(stiffness[3:, 3:], np.diag(BEDDED.shear), rtol=1e-12)
    np.testing.assert_allclose(stiffness[:3, 3:], 0.0, atol=1e-3)


def test_equal_moduli_are_isotropic_in_any_axes():
    axes = tuple(map(tuple, Rotation.from_rotvec([0.3, -1.0, 0.6]).as_matrix().tolist()))
    shear = 1e9 / 2.4
    same = material(orthotropy=Orthotropy((1e9,) * 3, (shear,) * 3, (0.2,) * 3, axes))
    np.testing.assert_allclose(same.stiffness, material().stiffness, atol=1e-6 * 1e9 * 1e-6)


def test_stress_turns_with_the_axes_of_the_material():
    turn = Rotation.from_rotvec([0.3, -1.0, 0.6]).as_matrix()
    turned = Orthotropy(BEDDED.young, BEDDED.shear, BEDDED.poisson, tuple(map(tuple, turn.T.tolist())))
    strain = np.array([1e-4, -2e-4, 0.5e-4, 3e-4, -1e-4, 2e-4])
    tensor = turn @ from_voigt(strain * [1, 1, 1, 0.5, 0.5, 0.5]) @ turn.T
    moved = to_voigt(tensor) * [1, 1, 1, 2, 2, 2]
    expected = turn @ from_voigt(material(orthotropy=BEDDED).stiffness @ strain) @ turn.T
    found = from_voigt(material(orthotropy=turned).stiffness @ moved)
    np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"young": (1e9, 0.0, 1e9)}, "orthotropy young"),
        ({"shear": (1e9, 1e9, -1.0)}, "orthotropy shear"),
        ({"young": (1e9, 1e9)}, "orthotropy young"),
        ({"poisson": (0.2, 0.2, float("nan"))}, "orthotropy poisson"),
        ({"axes": ((1, 0, 0), (0, 1, 0), (0, 0.1, 1))}, "orthotropy axes"),
        ({"poisson": (0.9, 0.9, 0.9)}, "orthotropy poisson"),
        # ν₁₂ < √(E₁/E₂) bounds each ratio
        ({"poisson": (0.2, 0.2, 0.75), "young": (10e9, 10e9, 5e9)}, "orthotropy poisson"),
    ],
)
def test_moduli_that_would_release_energy_are_refused(changes, words):
    fields = {"young": (1e9,) * 3, "shear": (4e8,) * 3, "poisson": (0.2,) * 3} | changes
    with pytest.raises(SceneError, match=f"material 'stone': {words}"):
        material(orthotropy=Orthotropy(**fields))


def test_materials_can_be_looked_up_by_their_values():
    assert hash(material(orthotropy=BEDDED)) == hash(material(orthotropy=BEDDED))
    assert material(orthotropy=BEDDED) == material(orthotropy=BEDDED)
