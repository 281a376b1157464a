"""Numba kernels of the plane through a face: weighted least squares, and its precision.

Points are held as columns `local` (3, n), measured from the first point of the face, so that site coordinates of
10⁶ m lose nothing; `root` (n,) is 1/σ. A plane is held in `frame` (5, 3): its centroid, the directions of largest and
of smaller spread, the normal, and the singular values of the weighted centred points, largest first.
"""

import math

from numba import njit

__all__ = ["leverages", "orient", "precision", "weighted_plane"]

_COLLINEAR = 1e-9  # second singular value over the first below which there is no plane
_UNCHECKED = 1e-9  # share of the others in a point's residual below which they say nothing of it


@njit(cache=True)
def weighted_plane(local, root, accepted, frame, work):
    """Plane of the accepted points into `frame`; returns their total weight, 0 if they lie on one line.

    One-sided Jacobi (Demmel & Veselić 1992) on the weighted centred points, without squaring them.
    """
    n, m, total = root.shape[0], 0, 0.0
    for i in range(n):
        if accepted[i]:
            total += root[i] ** 2
    for k in range(3):
        mean = 0.0
        for i in range(n):
            if accepted[i]:
                mean += root[i] ** 2 * local[k, i]
        frame[0, k] = mean / total
    for i in range(n):
        if accepted[i]:
            for k in range(3):
                work[k, m] = root[i] * (local[k, i] - frame[0, k])
            m += 1
    for p in range(3):
        for k in range(3):
            frame[1 + p, k] = 1.0 if p == k else 0.0
    _jacobi(work, m, frame)
    return total if frame[4, 1] > _COLLINEAR * frame[4, 0] else 0.0


@njit(cache=True)
def _jacobi(work, m, frame):
    """Rotate pairs of columns until all are orthogonal; sort them by length."""
    for _ in range(30):
        turned = False
        for p in range(2):
            for q in range(p + 1, 3):
                alpha, beta, gamma = 0.0, 0.0, 0.0
                for i in range(m):
                    alpha += work[p, i] ** 2
                    beta += work[q, i] ** 2
                    gamma += work[p, i] * work[q, i]
                if abs(gamma) <= 1e-15 * math.sqrt(alpha) * math.sqrt(beta):
                    continue
                turned = True
                zeta = (beta - alpha) / (2.0 * gamma)
                t = math.copysign(1.0, zeta) / (abs(zeta) + math.hypot(1.0, zeta))
                c = 1.0 / math.sqrt(1.0 + t * t)
                s = c * t
                for i in range(m):
                    x, y = work[p, i], work[q, i]
                    work[p, i], work[q, i] = c * x - s * y, s * x + c * y
                for k in range(3):
                    x, y = frame[1 + p, k], frame[1 + q, k]
                    frame[1 + p, k], frame[1 + q, k] = c * x - s * y, s * x + c * y
        if not turned:
            break
    for k in range(3):
        squares = 0.0
        for i in range(m):
            squares += work[k, i] ** 2
        frame[4, k] = math.sqrt(squares)
    for p, q in ((0, 1), (1, 2), (0, 1)):
        if frame[4, p] < frame[4, q]:
            frame[4, p], frame[4, q] = frame[4, q], frame[4, p]
            for k in range(3):
                frame[1 + p, k], frame[1 + q, k] = frame[1 + q, k], frame[1 + p, k]


@njit(cache=True)
def leverages(local, root, frame, total, residuals, lever):
    """Signed distances from the plane, and the share of each observation in its own fit."""
    for i in range(root.shape[0]):
        u, v, r = 0.0, 0.0, 0.0
        for k in range(3):
            d = local[k, i] - frame[0, k]
            u += d * frame[1, k]
            v += d * frame[2, k]
            r += d * frame[3, k]
        residuals[i] = r
        lever[i] = root[i] ** 2 * (1.0 / total + (u / frame[4, 0]) ** 2 + (v / frame[4, 1]) ** 2)


@njit(cache=True)
def orient(frame, origin, observer):
    """Turn the normal to the observer, or up its largest component; make the three axes right-handed."""
    along = 0.0
    for k in range(3):
        along += frame[3, k] * (observer[k] - origin[k] - frame[0, k])
    if math.isnan(along):
        along = _largest_of(frame[3])
    first = _largest_of(frame[1])
    for k in range(3):
        frame[3, k] = math.copysign(1.0, along) * frame[3, k]
        frame[1, k] = math.copysign(1.0, first) * frame[1, k]
    for k in range(3):
        p, q = (k + 1) % 3, (k + 2) % 3
        frame[2, k] = frame[3, p] * frame[1, q] - frame[3, q] * frame[1, p]


@njit(cache=True)
def _largest_of(vector):
    """Its component of largest size."""
    out = vector[0]
    for k in range(1, 3):
        if abs(vector[k]) > abs(out):
            out = vector[k]
    return out


@njit(cache=True)
def precision(origin, root, known, accepted, total, frame, residuals, lever, covariance):
    """Precision of the plane; `lever` becomes the standardised residuals, the centroid moves to the site."""
    n, count, squares, plain = root.shape[0], 0, 0.0, 0.0
    for i in range(n):
        if accepted[i]:
            count += 1
            squares += (root[i] * residuals[i]) ** 2
            plain += residuals[i] ** 2
    sigma0 = math.sqrt(squares / (count - 3)) if count > 3 else math.nan
    unit = 1.0 if known else sigma0
    for i in range(n):
        share = 1.0 - lever[i] if accepted[i] else 1.0 + lever[i]
        checked = count > 3 and share > _UNCHECKED and unit > 0.0
        lever[i] = root[i] * residuals[i] / (unit * math.sqrt(share)) if checked else math.nan
    covariance[0, 0] = (unit / frame[4, 0]) ** 2
    covariance[1, 1] = (unit / frame[4, 1]) ** 2
    covariance[2, 2] = unit**2 / total
    offset = 0.0
    for k in range(3):
        offset += frame[3, k] * origin[k]
    for k in range(3):
        offset += frame[3, k] * frame[0, k]
        frame[0, k] += origin[k]
        frame[4, k] /= math.sqrt(total / count)
    return offset, math.sqrt(plain / count), sigma0
