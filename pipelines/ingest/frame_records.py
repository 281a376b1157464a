"""How a survey was carried into the frame of the site, in values that JSON can say."""

import math
from typing import Any

from survey.registration.site_frame import SiteTransform

__all__ = ["frame_record"]


def frame_record(transform: SiteTransform | None) -> dict[str, Any] | None:
    """The transform with its precision and what each control point says of it; None if there is none."""
    if transform is None:
        return None
    points = zip(transform.names, transform.residuals.tolist(), transform.standardised.tolist(), strict=True)
    return {
        "rotation": transform.rotation.tolist(),
        "scale": transform.scale,
        "survey_centre": transform.survey_centre.tolist(),
        "site_centre": transform.site_centre.tolist(),
        "covariance": transform.covariance.tolist(),
        "sigma0": _finite(transform.sigma0),
        "redundancy": transform.redundancy,
        "scale_test": _finite(transform.scale_test),
        "control": [
            {
                "name": name,
                "residual": residual,
                "standardised": _finite(standardised),
                "rejected": name in transform.rejected,
            }
            for name, residual, standardised in points
        ],
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
