"""Study files of samples: what is not known of them, and what is asked."""

from collections.abc import Mapping
from types import MappingProxyType

_FILE = """\
# How probable is it that it falls, and what should be measured next? Explained in docs/howto/study.md.
#   moma study {folder}/study.toml --db sqlite:///{folder}/{kind}.db --out {folder}/study

[study]
scene = "{kind}.toml"
method = "form"
samples = {samples}

[[inputs]]
type = "friction"
sigma = {friction}

[[inputs]]
type = "density"
acts = "factor"
cov = 0.03        # of all stones together
scatter = 0.05    # of each about that

[[inputs]]
type = "depth"    # of each rule together, with the sigma of the survey
scatter = 0.01    # of each stone about its rule [m]

[[quantities]]
type = "bound"
load = "{load}"
fails_below = {level}
"""

STUDIES: Mapping[str, Mapping[str, object]] = MappingProxyType(
    {
        "arch": {"load": "horizontal 23", "level": 0.45, "friction": 0.05, "samples": 100},
        "block": {"load": "horizontal y", "level": 0.3, "friction": 0.1, "samples": 200},
        "window": {"load": "horizontal 97", "level": 0.11, "friction": 0.05, "samples": 100},
    }
)
"""Load, level of failure, standard deviation of the friction and samples of each."""


def study_text(kind: str, folder: str) -> str:
    """Return the study file of a sample in a folder."""
    return _FILE.format(kind=kind, folder=folder, **STUDIES[kind])
