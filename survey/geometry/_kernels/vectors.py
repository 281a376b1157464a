"""Products of vectors in space, inlined into the kernels that call them."""

from numba import njit


@njit(cache=True, inline="always")
def dot(u, v):
    """Return the scalar product of two vectors (3,)."""
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


@njit(cache=True, inline="always")
def cross(u, v):
    """Return the vector product of two vectors (3,), as a tuple."""
    return u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]


@njit(cache=True, inline="always")
def minus(u, v):
    """Return u - v of two vectors (3,) as a tuple: array expressions take numba much longer to compile."""
    return u[0] - v[0], u[1] - v[1], u[2] - v[2]


@njit(cache=True, inline="always")
def height_over(normal, offset, point):
    """Return the height n·x - d of a point (3,) over a plane of unit normal n (3,) and offset d [m]."""
    return -offset + normal[0] * point[0] + normal[1] * point[1] + normal[2] * point[2]
