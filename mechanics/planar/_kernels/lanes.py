"""Eight contacts of disks at a time, in vectors of the processor.

Contacts that share no body are solved side by side, with the bits that one after the other would give: no operation
mixes the lanes of two contacts. The compiler splits the vectors where a processor has narrower ones.
"""

from collections.abc import Sequence
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

LANES = 8

_DOUBLE, _INDEX = ir.DoubleType(), ir.IntType(64)
_ROW = ir.VectorType(_DOUBLE, 4)
_VECTOR = ir.VectorType(_DOUBLE, LANES)
_BYTES = 8  # to which rows and vectors are aligned, at least


class _Lanes:
    """Expression of eight numbers, one for each contact."""

    def __init__(self, builder: Any, value: Any) -> None:
        self._builder, self.value = builder, value

    def __add__(self, other: "_Lanes") -> "_Lanes":
        return _Lanes(self._builder, self._builder.fadd(self.value, other.value))

    def __sub__(self, other: "_Lanes") -> "_Lanes":
        return _Lanes(self._builder, self._builder.fsub(self.value, other.value))

    def __mul__(self, other: "_Lanes") -> "_Lanes":
        return _Lanes(self._builder, self._builder.fmul(self.value, other.value))

    def __neg__(self) -> "_Lanes":
        return _Lanes(self._builder, self._builder.fneg(self.value))

    def at_least(self, low: "_Lanes") -> "_Lanes":
        """Return the larger of the two; of a number that is none, that."""
        below = self._builder.fcmp_ordered("<", self.value, low.value)
        return _Lanes(self._builder, self._builder.select(below, low.value, self.value))

    def at_most(self, high: "_Lanes") -> "_Lanes":
        """Return the smaller of the two; of a number that is none, that."""
        above = self._builder.fcmp_ordered(">", self.value, high.value)
        return _Lanes(self._builder, self._builder.select(above, high.value, self.value))


def _shuffled(builder: Any, first: Any, second: Any, order: Sequence[int]) -> Any:
    return builder.shuffle_vector(
        first, second, ir.Constant(ir.VectorType(ir.IntType(32), len(order)), list(order))
    )


def _columns(builder: Any, rows: Sequence[Any]) -> list[_Lanes]:
    """Transpose eight rows of four numbers into four columns of eight."""
    # rows k and k + 4 side by side, then their first and third numbers, and their second and fourth
    halves = [_shuffled(builder, rows[k], rows[k + 4], range(8)) for k in range(4)]
    odd, even = [0, 8, 2, 10, 4, 12, 6, 14], [1, 9, 3, 11, 5, 13, 7, 15]
    pairs = [_shuffled(builder, halves[k], halves[k + 1], order) for order in (odd, even) for k in (0, 2)]
    low, high = [0, 1, 8, 9, 4, 5, 12, 13], [2, 3, 10, 11, 6, 7, 14, 15]
    return [
        _Lanes(builder, _shuffled(builder, pairs[k], pairs[k + 1], order))
        for order in (low, high)
        for k in (0, 2)
    ]


def _rows(builder: Any, columns: Sequence[_Lanes]) -> list[Any]:
    """Transpose four columns of eight numbers into eight rows of four."""
    odd, even = [0, 8, 2, 10, 4, 12, 6, 14], [1, 9, 3, 11, 5, 13, 7, 15]
    pairs = [
        _shuffled(builder, columns[k].value, columns[k + 1].value, order)
        for order in (odd, even)
        for k in (0, 2)
    ]
    low, high = [0, 1, 8, 9, 4, 5, 12, 13], [2, 3, 10, 11, 6, 7, 14, 15]
    halves = [_shuffled(builder, pairs[k], pairs[k + 1], order) for order in (low, high) for k in (0, 2)]
    return [
        _shuffled(builder, half, half, range(4 * side, 4 * side + 4)) for side in range(2) for half in halves
    ]


@intrinsic
def solve_disks(context, record, v, body, group):
    """Solve the contacts of a group, whose arms run along n, and pass what has changed on to their bodies.

    W_αα is diagonal, so the normal does not feel the tangent.

    Inputs
    ------
    record : (ng, 12, 8) float64, columns of `sweep`; the impulses in it are changed
    v : (ns, 4) float64, rows of the bodies: vx, vy, spin, 1/m; changed
    body : (ng, 2, 8) uint32, rows of v; no body that moves twice in a group
    group : int64
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        """Emit the vector instruction."""
        data = [
            cgutils.create_struct_proxy(kind)(context, builder, value=value).data
            for kind, value in zip(signature.args[:3], arguments[:3], strict=True)
        ]
        fields, speeds, numbers = data
        wide = builder.bitcast(fields, _VECTOR.as_pointer())
        first = builder.mul(arguments[3], ir.Constant(_INDEX, 12))
        places = [builder.gep(wide, [builder.add(first, ir.Constant(_INDEX, k))]) for k in range(12)]
        one = [_Lanes(builder, builder.load(place, align=_BYTES)) for place in places]
        nx, ny, lever_i, lever_j, shift_n, shift_t, mu, cohesion, old_n, old_t, inv_nn, inv_tt = one
        rows = _places_of(builder, speeds, numbers, arguments[3])
        vi, vj = (_columns(builder, [builder.load(row, align=_BYTES) for row in side]) for side in rows)
        x, y = vi[0] - vj[0], vi[1] - vj[1]
        un = shift_n + nx * x + ny * y
        ut = shift_t + nx * y - ny * x + lever_i * vi[2] - lever_j * vj[2]
        none = _Lanes(builder, ir.Constant(_VECTOR, [0.0] * LANES))
        n = (old_n - un * inv_nn).at_least(none)
        limit = mu * n + cohesion
        t = (old_t - ut * inv_tt).at_least(-limit).at_most(limit)
        builder.store(n.value, places[8], align=_BYTES)
        builder.store(t.value, places[9], align=_BYTES)
        dn, dt = n - old_n, t - old_t
        fx, fy = nx * dn - ny * dt, ny * dn + nx * dt
        mi, mj = vi[3], vj[3]
        after_i = [vi[0] + mi * fx, vi[1] + mi * fy, vi[2] + mi * lever_i * dt, mi]
        after_j = [vj[0] - mj * fx, vj[1] - mj * fy, vj[2] - mj * lever_j * dt, mj]
        for side, after in zip(rows, (after_i, after_j), strict=True):
            for row, value in zip(side, _rows(builder, after), strict=True):
                builder.store(value, row, align=_BYTES)
        return context.get_dummy_value()

    return types.void(record, v, body, group), generate


def _places_of(builder: Any, speeds: Any, numbers: Any, group: Any) -> list[list[Any]]:
    """Return pointers to the rows of the candidates, and of the antagonists, of a group."""
    narrow = builder.bitcast(speeds, _ROW.as_pointer())
    first = builder.mul(group, ir.Constant(_INDEX, 2 * LANES))
    found = []
    for side in range(2):
        here = [
            builder.gep(numbers, [builder.add(first, ir.Constant(_INDEX, side * LANES + lane))])
            for lane in range(LANES)
        ]
        found.append([builder.gep(narrow, [builder.zext(builder.load(at), _INDEX)]) for at in here])
    return found
