"""Summaries of an assessment and of a loading test, as their files hold them, with numbers that are known."""

INPUTS = {
    "Survey": [
        "wall: 3 stones; /home/surveyor/projects/2026/north/wall-of-the-north-aisle-second-campaign.moma"
    ],
    "Depths of the stones": ["seen at the edge of the opening, 3 stones: 0.4 m, σ up to 20 mm"],
    "Contact": ["DryJoint: friction 0.6, restitution 0"],
    "Supports": ["W01-01", "W01-02"],
}
VERSIONS = {"moma": "1.2", "python": "3.13"}
WALL = {"along": [1.0, 0.0, 0.0], "outwards": [0.0, -1.0, 0.0], "left_end": 10.0, "foot": 5.0}


def assessed(**changed):
    """An assessment: a push inwards that is lost at an eighth of the weight, against a demand of a code."""
    check = {
        "name": "linear",
        "capacity": 1.0,
        "demand": 0.5,
        "unit": "m/s²",
        "ratio": 2.0,
        "passed": True,
        "formula": "a0* ≥ ag S / q",
        "article": "C8.7.1.2.1.7",
    }
    load = {
        "name": "horizontal y",
        "kind": "load",
        "headline": "horizontal y: λ = 0.125 (held; 0.1252 is lost), bound 0.13",
        "direction": [0.0, 1.0, 0.0],
        "bound": 0.13,
        "limit": 0.125,
        "limit_lost": 0.1252,
        "limit_sure": 0.125,
        "candidate": 0.125,
        "candidate_lowest": 0.125,
        "candidate_converged": True,
        "outcome": "limited",
        "tilt": 7.1,
        "sensitivity": {"friction": 0.2, "depth": 1.0},
        "code": {"code": "NTC 2018", "caution": "", "values": [], "checks": [check]},
        "mechanism": {
            "stones": [
                {"code": "W03-01", "velocity": [0.0, 1.0, 0.0], "centre": [10.5, 0.0, 7.25]},
                {"code": "W02-01", "velocity": [0.0, 0.5, 0.0], "centre": [12.0, 0.0, 6.5]},
            ]
        },
    }
    return {
        "scene": "wall",
        "headline": load["headline"],
        "free": 3,
        "contacts": 24,
        "weight": 40e3,
        "cautions": ["stones are rigid and do not crush"],
        "loads": [load],
        "governs": 0,
        "wall": WALL,
        "inputs": INPUTS,
        "versions": VERSIONS,
    } | changed


def pushed(**changed):
    """A loading test along the wall, with a band and a measured force."""
    return {
        "scene": "wall",
        "headline": "bears 72 kN ± 5 kN (90 % band); it rocks",
        "stones": 44,
        "weight": 6e3,
        "load": 100e3,
        "height": 1.3,
        "direction": [1.0, 0.0, 0.0],
        "wall": WALL,
        "cautions": [],
        "strength": {"forwards": 72e3, "backwards": 0.0},
        "stiffness": 13e6,
        "early_stiffness": 16e6,
        "turning": 0.9,
        "settling": 6e-4,
        "steps": 200,
        "errors": {"unsolved": 0, "rate": 150.0, "disturbed": 0, "energy": 1e-6},
        "band": {
            "level": 0.9,
            "strength": 5e3,
            "by_one_sigma": {"friction": 3e3},
            "scatter": {"friction": 0.1},
        },
        "measured": {
            "strength": {"forwards": 74e3, "backwards": 0.0},
            "ratio": {"forwards": 72 / 74, "backwards": None},
        },
        "inputs": INPUTS,
        "versions": VERSIONS,
    } | changed
