"""Accelerograms in the formats of seismologists, MiniSEED and SAC, through obspy, which is an extra."""

from pathlib import Path

import numpy as np

from ground.errors import SceneError
from mechanics.scene.loads.accelerogram import Accelerogram
from mechanics.scene.loads.record_formats import direction_of

_ENDINGS = (".mseed", ".miniseed", ".ms", ".msd", ".sac", ".seed")
_TABLES = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0", b"\xff\xfe", b"\xfe\xff")  # workbooks, UTF-16


def is_waveform(path: str | Path) -> bool:
    """Return whether a file is binary, and no workbook; SceneError if it cannot be read."""
    try:
        with Path(path).open("rb") as file:
            start = file.read(512)
    except FileNotFoundError:
        raise SceneError("no such file", where=str(path), remedy="check the path") from None
    except (OSError, ValueError) as error:
        raise SceneError(f"cannot be read: {error}", where=repr(str(path)), remedy="check the path") from None
    if start.startswith(_TABLES):
        return False
    return Path(path).suffix.lower() in _ENDINGS or b"\0" in start


def read_waveforms(path: str | Path, unit: float) -> tuple[Accelerogram, ...]:
    """Read all channels of a file, whose values are in `unit` [m/s²]: such files state none.

    Raises
    ------
    SceneError : obspy is missing, or cannot read the file, or a channel has gaps
    """
    try:
        from obspy import read
    except ImportError:
        raise SceneError(
            "MiniSEED and SAC need the package obspy, which is not installed",
            where=str(path),
            remedy="install it: pip install 'moma-masonry[records]'",
        ) from None
    try:
        stream = read(str(path))
    except Exception as error:  # obspy raises whatever its readers raise
        raise SceneError(
            f"obspy cannot read it: {str(error)[:100]}",
            where=str(path),
            remedy="give MiniSEED, SAC or a table",
        ) from None
    channels = [trace.id for trace in stream]
    if len(set(channels)) < len(channels):
        raise SceneError("a channel has gaps", where=str(path), remedy="give a continuous record")
    return tuple(
        Accelerogram(
            float(trace.stats.delta),
            unit * np.asarray(trace.data, dtype=np.float64),
            trace.id,
            str(path),
            direction_of(trace.stats.channel[-1:]),
        )
        for trace in stream
    )
