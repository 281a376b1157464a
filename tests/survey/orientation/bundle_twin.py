"""A slow bundle adjustment: one dense Jacobian by differences, one dense inverse."""

import numpy as np

from survey.orientation._kernels.camera import PARAMETERS, ray
from survey.orientation.rotations import turned


def residuals(prepared, unknowns):
    out = []
    for i in range(len(prepared.rays.start) - 1):
        for k in range(prepared.rays.start[i], prepared.rays.start[i + 1]):
            f = prepared.rays.photo[k]
            m = unknowns.camera[f]
            work = np.zeros((5, PARAMETERS))
            ray(
                prepared.rays.measured[k], prepared.rays.weight[k], bool(unknowns.forward[m]), unknowns.inner[m],
                unknowns.rotation[f], unknowns.station[f], unknowns.point[i], work,
            )  # fmt: skip
            out.append(-work[4, :2])
    for i in np.flatnonzero(prepared.information.any(axis=(1, 2))):
        root = np.linalg.cholesky(prepared.information[i]).T
        out.append(root @ (unknowns.point[i] - prepared.place[i]))
    return np.concatenate(out)


def moved(unknowns, step):
    cameras = unknowns.column.max() + 1
    padded = np.append(step[:cameras], 0.0)
    exterior = padded[unknowns.column[:, :6]]
    inner = unknowns.inner.copy()
    for f, m in enumerate(unknowns.camera):
        inner[m] = unknowns.inner[m] + padded[unknowns.column[f, 6:]]
    point = unknowns.point.copy()
    point[unknowns.free] += step[cameras:].reshape(-1, 3)
    return unknowns._replace(
        inner=inner,
        rotation=turned(unknowns.rotation, exterior[:, :3]),
        station=unknowns.station + exterior[:, 3:],
        point=point,
    )


def jacobian(prepared, unknowns, sizes):
    columns = []
    for k, size in enumerate(sizes):
        step = np.zeros(len(sizes))
        step[k] = size
        columns.append(
            (residuals(prepared, moved(unknowns, step)) - residuals(prepared, moved(unknowns, -step)))
            / (2 * size)
        )
    return np.column_stack(columns)
