"""Samples of geological scenes: deposited once for each set of settings, and kept."""

import hashlib
import json
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from ground.errors import UsageError
from mechanics.arrays import Array, Ints
from mechanics.dynamics.progress import Listener, silent
from mechanics.planar.deposit import Deposit, deposit
from pipelines.geology.file import GeologyScene
from pipelines.scene.fingerprint import DIGITS

_VERSION = 4  # of the preparation: a change of its outcome raises it


@dataclass(frozen=True)
class PreparedSample:
    """Disks at rest.

    Attributes
    ----------
    centre : (nd, 2) [m]
    radius : (nd,) [m]
    layer : (nd,) marker layer, 0 at the base
    digest : of the settings that made it
    """

    centre: Array
    radius: Array
    layer: Ints
    digest: str


def prepare(scene: GeologyScene, cache: Path, progress: Listener = silent) -> PreparedSample:
    """Take the sample of a scene out of the cache, or deposit it and keep it there.

    Raises
    ------
    UsageError : the cache cannot be written; said before anything is deposited
    SceneError : the sample cannot be deposited
    """
    asked, experiment = scene.sample, scene.experiment
    x = np.linspace(0.0, experiment.length, 1001)
    settings = {
        "version": _VERSION,
        "sample": {
            name: value
            for name, value in asdict(asked).items()
            if name not in ("layers", "layer_tops") and value is not None
        },
        "friction": scene.contact.friction,
        "rolling": scene.contact.rolling,
        "gravity": scene.time.gravity,
        "profile": hashlib.sha256(np.append(x, experiment.top(x)).tobytes()).hexdigest(),
    }
    digest = hashlib.sha256(json.dumps(settings, sort_keys=True).encode()).hexdigest()[:DIGITS]
    path = cache / f"{digest}.npz"
    stored = _stored(path)
    if stored is None:
        _make(cache)
        with scene.document.at("sample"):
            stored = deposit(
                Deposit(
                    experiment.length,
                    experiment.top,
                    experiment.highest,
                    asked.smallest,
                    asked.largest,
                    asked.density,
                    scene.contact.friction,
                    asked.falling_friction,
                    asked.seed,
                    scene.time.gravity,
                    asked.large_share,
                    scene.contact.rolling,
                ),
                progress,
            )
        fresh = path.with_suffix(".new.npz")
        np.savez(fresh, centre=stored[0], radius=stored[1])
        fresh.replace(path)
    centre, radius = stored
    tops = asked.layer_tops or experiment.highest * np.arange(1, asked.layers) / asked.layers
    layer = np.searchsorted(tops, centre[:, 1], side="right").astype(np.int64)
    return PreparedSample(centre, radius, layer, digest)


def _make(cache: Path) -> None:
    try:
        cache.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(
            f"the samples cannot be kept here: {error.strerror}",
            where=str(cache),
            remedy="name another folder: --samples DIR",
        ) from error


def _stored(path: Path) -> tuple[Array, Array] | None:
    try:
        with np.load(path) as data:
            return data["centre"], data["radius"]
    except (OSError, ValueError, KeyError):
        # not there, or cut short: it is made again
        return None
