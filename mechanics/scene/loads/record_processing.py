"""Processing of recorded ground motions: baseline correction and filtering.

Both follow the documented processing of the PEER database (Ancheta et al. 2013; Boore & Bommer 2005).
"""

from dataclasses import replace
from typing import Literal

import numpy as np

from ground.errors import SceneError
from mechanics.scene.loads.accelerogram import Accelerogram


def without_drift(record: Accelerogram, degree: int = 6) -> Accelerogram:
    """Remove the drift that results from integrating a wrong baseline.

    A polynomial of `degree`, without constant and linear term, is fitted to the displacement by least squares, and its
    second derivative is subtracted from the acceleration.
    """
    if degree < 2:
        raise SceneError(f"degree = {degree}", where=record.source, remedy="give 2 or more")
    powers = np.arange(2, degree + 1)
    # in units of the duration, so that high powers are well scaled
    place = np.linspace(0.0, 1.0, len(record))[:, None]
    coefficients = np.linalg.lstsq(place**powers, record.displacement, rcond=None)[0]
    drift = (place ** (powers - 2)) @ (coefficients * powers * (powers - 1)) / record.duration**2
    return replace(
        record,
        acceleration=record.acceleration - drift,
        source=f"{record.source}, baseline corrected (degree {degree})",
    )


def band_pass(
    record: Accelerogram, low: float | None = None, high: float | None = None, order: int = 4
) -> Accelerogram:
    """Keep the frequencies between `low` and `high` [Hz]; without one of them, all on that side.

    A Butterworth filter of `order` is applied forwards and backwards: it shifts no phase, and halves the amplitude at
    a corner. The record is first padded with zeros, 1.5 order/low in all, half in front and half behind (Converse &
    Brady 1992). The zeros are kept: without them velocity and displacement would not begin and end at rest (Boore
    2005). The motion therefore begins 0.75 order/low later than in the record.
    """
    nyquist = 0.5 / record.dt
    corners = [corner for corner in (low, high) if corner is not None]
    if not corners or not all(0 < corner < nyquist for corner in corners) or corners != sorted(set(corners)):
        raise SceneError(
            f"band from {low} to {high} Hz",
            where=record.source,
            remedy=f"give corners that increase, above 0 and below {nyquist:g} Hz, half the sampling rate",
        )
    if order < 1:
        raise SceneError(f"order = {order}", where=record.source, remedy="give 1 or more")
    from scipy.signal import butter, sosfiltfilt  # half a second, which few scenes need

    kind: Literal["bandpass", "highpass", "lowpass"]
    kind = "bandpass" if len(corners) == 2 else "highpass" if high is None else "lowpass"
    sections = butter(order, np.squeeze(corners), kind, fs=1 / record.dt, output="sos")
    zeros = np.zeros(int(np.ceil(0.75 * order / min(corners) / record.dt)))
    padded = np.concatenate([zeros, record.acceleration, zeros])
    band = f"{low or 0:g} to {high or nyquist:g} Hz"
    return replace(
        record,
        acceleration=sosfiltfilt(sections, padded, padtype=None),
        source=f"{record.source}, Butterworth {band} (order {order}, both ways)",
    )
