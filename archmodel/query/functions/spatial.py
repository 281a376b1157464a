"""Query functions on places, and on their change."""

from sqlalchemy import Double, and_, literal

from archmodel.query.functions.usages import Ask, Condition, metres, tokens
from archmodel.query.grammar import Call
from archmodel.query.names import campaign_named, stone_named
from archmodel.query.scope import Scope
from archmodel.query.tokens import complaint


def within(scope: Scope, call: Call, ask: Ask) -> Condition:
    """Test for a centroid near a stone, or near a place."""
    values = tokens(call, 2, 4)
    radius = metres(values[-1])
    if radius < 0.0:
        raise complaint(values[-1], f"the radius {values[-1].text[:40]} is negative")
    if len(values) == 4:
        x, y, z = map(metres, values[:3])
        return _ball(scope, (x, y, z), radius)
    stone = stone_named(scope.context, values[0])
    if stone.x is None or stone.y is None or stone.z is None:
        raise complaint(values[0], f"the place of {values[0].text[:40]} is not known")
    return and_(_ball(scope, (stone.x, stone.y, stone.z), radius), scope.entity.c.id != stone.id)


def _ball(scope: Scope, centre: tuple[float, ...], radius: float) -> Condition:
    """Test for a centroid at most `radius` from the centre; the box around it comes first, for the index."""
    columns = [scope.entity.c[axis] for axis in "xyz"]
    offsets = [column - literal(value, Double) for column, value in zip(columns, centre, strict=True)]
    square = sum((offset * offset for offset in offsets[1:]), offsets[0] * offsets[0])
    low = [value - radius for value in centre]
    high = [value + radius for value in centre]
    return and_(_box(scope, low, high), square <= literal(radius * radius, Double))


def within_box(scope: Scope, call: Call, ask: Ask) -> Condition:
    """Test for a centroid in a box along the axes."""
    numbers = list(map(metres, tokens(call, 6)))
    low, high = numbers[:3], numbers[3:]
    if any(a > b for a, b in zip(low, high, strict=True)):
        remedy = "write the lowest corner first: within_box(x0, y0, z0, x1, y1, z1)"
        raise complaint(call.function, "the box has a corner above the other", remedy)
    return _box(scope, low, high)


def _box(scope: Scope, low: list[float], high: list[float]) -> Condition:
    return and_(
        *(
            scope.entity.c[axis].between(literal(a, Double), literal(b, Double))
            for axis, a, b in zip("xyz", low, high, strict=True)
        )
    )


def moved_since(scope: Scope, call: Call, ask: Ask) -> Condition:
    """Test for a place that differs from that of an earlier campaign by more than both can err."""
    (token,) = tokens(call, 1)
    context, name = scope.context, campaign_named(scope.context, token)
    if context.campaign not in (None, name):
        raise complaint(token, f"displacements since {context.campaign} and {name}", "ask in two queries")
    context.campaign = name
    # numpy is loaded only by those who ask
    from archmodel.store.campaigns import SIGNIFICANT, campaigns, measured_again

    surveys = campaigns(context.session)
    if not context.once(("again", name), lambda: measured_again(context.session, surveys[name])):
        others = ", ".join(survey for survey in surveys if survey != name) or "there is none"
        what = f"no stone was measured again since the survey {name[:40]!r}"
        raise complaint(token, what, f"name the earlier survey of two: {others[:200]}")
    rows = scope.displacement()
    return rows.c.moved > SIGNIFICANT * rows.c.moved_sigma
