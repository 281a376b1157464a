"""Numba kernels of the collinearity equations: one ray, its residual and its derivatives.

The image system has x to the right and y upwards, its origin at the upper left corner of the photograph; the
camera looks
along -z. With the camera's axes as columns of R and its station X₀, a point X has the camera coordinates q = Rᵀ(X - X₀)
and its image is p = -c (q₁, q₂) / q₃ from the principal point (x_p, -y_p). Brown's distortion of a place (x, y) with
r² = x² + y² is

    B(x, y) = (x (1 + K₁r² + K₂r⁴ + K₃r⁶) + P₁(r² + 2x²) + 2P₂xy,  y (1 + …) + P₂(r² + 2y²) + 2P₁xy).

The backward model corrects what was measured, the forward model distorts what is projected:

    backward   S B((1 + a)(x - x_p), y + y_p) = p       S = [1 s; 0 1]
    forward    (x, y) = (x_p, -y_p) + [1 + a, s; 0, 1] B(p)

Interior orientation is the row c, x_p, y_p, a, s, K₁, K₂, K₃, P₁, P₂.
"""

from numba import njit

PARAMETERS = 16
"""Parameters that a ray has on the camera's side: rotation, station, interior orientation."""


@njit(cache=True)
def brown(x, y, inner):
    """Distort a place by Brown's polynomials.

    Inputs
    ------
    x, y : place from the principal point [camera unit]
    inner : (10,) float64, interior orientation

    Outputs
    -------
    B(x, y), its derivative by x and y: (1, 1), (1, 2) = (2, 1), (2, 2)
    """
    k1, k2, k3, p1, p2 = inner[5], inner[6], inner[7], inner[8], inner[9]
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    steep = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3))
    return (
        x * radial + p1 * (r2 + 2.0 * x * x) + 2.0 * p2 * x * y,
        y * radial + p2 * (r2 + 2.0 * y * y) + 2.0 * p1 * x * y,
        radial + steep * x * x + 6.0 * p1 * x + 2.0 * p2 * y,
        steep * x * y + 2.0 * p1 * y + 2.0 * p2 * x,
        radial + steep * y * y + 6.0 * p2 * y + 2.0 * p1 * x,
    )


@njit(cache=True)
def ray(measured, weight, forward, inner, rotation, station, point, work):
    """Return the weighted residual of one ray and its derivatives.

    Inputs
    ------
    measured : (2,) float64, place on the photograph [camera unit]
    weight : (2,) float64, 1/σ of either coordinate
    forward : bool, the model of the distortion
    inner, rotation, station, point : (10,), (3, 3), (3,), (3,) float64

    Outputs
    -------
    work : (5, 16) float64; rows 0, 1: derivative of what is computed by a rotation about the camera's axes [rad], the
        station and the interior orientation; rows 2, 3: by the point, in the first three columns; row 4: the residual,
        measured minus computed. All divided by σ
    depth of the point in front of the camera
    """
    dx, dy, dz = point[0] - station[0], point[1] - station[1], point[2] - station[2]
    q0 = rotation[0, 0] * dx + rotation[1, 0] * dy + rotation[2, 0] * dz
    q1 = rotation[0, 1] * dx + rotation[1, 1] * dy + rotation[2, 1] * dz
    q2 = rotation[0, 2] * dx + rotation[1, 2] * dy + rotation[2, 2] * dz
    c, scale, skew = inner[0], 1.0 + inner[3], inner[4]
    p0, p1 = -c * q0 / q2, -c * q1 / q2
    # the place that is distorted, and S or A of the module's equations: [stretch, skew; 0, 1]
    x, y = (p0, p1) if forward else (scale * (measured[0] - inner[1]), measured[1] + inner[2])
    bx, by, b00, b01, b11 = brown(x, y, inner)
    stretch = scale if forward else 1.0
    s00, s01 = stretch * b00 + skew * b01, stretch * b01 + skew * b11
    if forward:
        t00, t01, t10, t11 = s00, s01, b01, b11
        work[4, 0] = measured[0] - inner[1] - scale * bx - skew * by
        work[4, 1] = measured[1] + inner[2] - by
        work[0, 7], work[1, 7], work[0, 8], work[1, 8] = 1.0, 0.0, 0.0, -1.0
        work[0, 9], work[0, 10], sign = bx, by, 1.0
        work[1, 9] = 0.0
    else:
        t00, t01, t10, t11 = 1.0, 0.0, 0.0, 1.0
        work[4, 0] = bx + skew * by - p0
        work[4, 1] = by - p1
        work[0, 7], work[1, 7], work[0, 8], work[1, 8] = scale * s00, scale * b01, -s01, -b11
        work[0, 9], work[0, 10], sign = -s00 * (measured[0] - inner[1]), -by, -1.0
        work[1, 9] = -b01 * (measured[0] - inner[1])
    work[1, 10] = 0.0
    r2 = x * x + y * y
    power = sign * r2
    for k in range(3):
        work[0, 11 + k], work[1, 11 + k] = (stretch * x + skew * y) * power, y * power
        power *= r2
    u, v = 2.0 * sign * x * y, sign * (r2 + 2.0 * x * x)
    work[0, 14], work[1, 14] = stretch * v + skew * u, u
    v = sign * (r2 + 2.0 * y * y)
    work[0, 15], work[1, 15] = stretch * u + skew * v, v
    work[0, 6], work[1, 6] = (t00 * p0 + t01 * p1) / c, (t10 * p0 + t11 * p1) / c
    # derivative by q: p = -c q₁₂ / q₃
    a = -c / q2
    for row in range(2):
        u, v = (t00, t01) if row == 0 else (t10, t11)
        d0, d1, d2 = a * u, a * v, -(u * p0 + v * p1) / q2
        # a rotation by δ about the camera's axes turns q by q × δ
        work[row, 0] = d1 * q2 - d2 * q1
        work[row, 1] = d2 * q0 - d0 * q2
        work[row, 2] = d0 * q1 - d1 * q0
        for k in range(3):
            by_point = d0 * rotation[k, 0] + d1 * rotation[k, 1] + d2 * rotation[k, 2]
            work[2 + row, k] = by_point
            work[row, 3 + k] = -by_point
        for k in range(16):
            work[row, k] *= weight[row]
        for k in range(3):
            work[2 + row, k] *= weight[row]
        work[4, row] *= weight[row]
    return -q2
