"""Entities, structures and their history as text."""

from collections.abc import Mapping, Sequence
from typing import Any

from moma.cli.text.formats import as_lines

__all__ = ["entity_lines", "history_lines"]

Values = Mapping[str, Any]


def entity_lines(description: Values) -> str:
    """Format the result of `describe` as indented lines, without unknown values."""
    shown = dict(description)
    shown["knowledge"] = {
        name: _named(content) if isinstance(content, Mapping) else [_statement(one) for one in content or ()]
        for name, content in description["knowledge"].items()
    }
    shown["knowledge"] = {name: one for name, one in shown["knowledge"].items() if one}
    for name, one in (("structures", _structure), ("joints", _joint), ("corrections", _correction)):
        shown[name] = [one(each) for each in description.get(name, ())]
    if description.get("measured"):
        shown["measured"] = dict(description["measured"])
        shown["measured"]["evidence"] = [_located(one) for one in description["measured"]["evidence"]]
    shown["own"] = {name: _with_unit(one) for name, one in description.get("own", {}).items()}
    shown["relations"] = {
        name: [_neighbour(one) for one in ones] for name, ones in description.get("relations", {}).items()
    }
    if not shown.get("hypothesis"):
        shown.pop("hypothesis", None)  # nearly all entities were surveyed
    for name in ("recorded", "withdrawn"):
        shown[name] = _by(description[name]) if description.get(name) else None
    return as_lines({name: _listed(one) for name, one in shown.items()})


def _located(one: Values) -> str:
    """Format how a point of the face was located: its place, its precision, and the marks behind it."""
    place = ", ".join(f"{value:.4f}" for value in one["place"])
    precision = ", ".join(f"{1e3 * value:.1f}" for value in one["sigma"])
    rays = [
        f"{ray['photo']} at ({ray['x']:.2f}, {ray['y']:.2f}) px from {ray['distance']:.2f} m"
        + (f", residual ({ray['residual'][0]:z.2f}, {ray['residual'][1]:z.2f}) px" if ray["test"] else "")
        for ray in one["rays"]
    ]
    what = "corner" if one["role"] == "vertex" else "point"
    return f"{what} {one['point']} at ({place}) ± ({precision}) mm: {one['how']}" + "".join(
        f"; {ray}" for ray in rays
    )


def history_lines(code: str, events: Sequence[Values]) -> str:
    """Format a history, entry by entry."""
    lines, last = [f"history of {code}"], None
    for event in events:
        if event["entry"] != last:
            last = event["entry"]
            lines.append(f"entry {last}, {event['recorded_at']}: {event['action']}{_who(event)}")
        lines.append(f"  {event['event']} {_words(event['what'])}: {_change(event)}")
    return "\n".join(lines)


def _change(event: Values) -> str:
    """Format the values of an event, and those before it."""
    says, before = event["says"], event["before"]
    if event["event"] == "corrected":
        return f"{_value(before.get('value'))} → {_value(says.get('value'))}"
    if not before or before == says:
        return _values(says)
    return f"{_values(says)}; before: {_values(before)}"


def _listed(content: Any) -> Any:
    """Number the texts of a list, so that they appear one below the other."""
    if isinstance(content, Mapping):
        return {name: _listed(one) for name, one in content.items()}
    if isinstance(content, list) and content and all(isinstance(one, str) for one in content):
        long = any(" " in one for one in content)
        return {str(number): one for number, one in enumerate(content, start=1)} if long else content
    return content


def _named(one: Values) -> dict[str, Any]:
    """Describe a material with its properties, or a phase with its years."""
    shown: dict[str, Any] = {"name": one["name"], "description": one["description"]}
    if "begins" in one:
        years = [str(one[end]) if one[end] is not None else "?" for end in ("begins", "ends")]
        shown["years"] = None if years == ["?", "?"] else "–".join(years)
    for name, value in one.get("properties", {}).items():
        sigma = "" if value["sigma"] is None else f" ± {value['sigma']:.4g}"
        unit = "" if value["unit"] == "-" else f" {value['unit']}"
        shown[name] = f"{value['value']:.4g}{sigma}{unit} ({value['source']})"
    if one.get("others"):
        shown["disputed" if one["disputed"] else "agreed"] = one["rule"]
        shown["beside it"] = [_statement(other) for other in one["others"]]
    return shown | {"evidence": _cited(one), "recorded": _by(one)}


def _statement(one: Values) -> str:
    """Format a statement in one line."""
    own = {
        name: value
        for name, value in one.items()
        if name not in (*_PROVENANCE, "text", "document", "locator", "observed_on", "said_of")
    }
    parts = [_values(own), _cited(one)]
    return f"{', '.join(part for part in parts if part)} [{_by(one)}]"


_PROVENANCE = ("entry", "action", "author", "source", "recorded_at", "stated_on")


def _cited(one: Values) -> str:
    """Format text, document, date and, if it is inherited, the subject of a statement."""
    where = one.get("document", "")
    parts = [
        one.get("text"),
        f"{where} {one['locator']}" if where and "locator" in one else where,
        f"seen {one['observed_on']}" if "observed_on" in one else None,
        f"inherited from {one['said_of']}" if "said_of" in one else None,
    ]
    return ", ".join(part for part in parts if part)


def _by(one: Values) -> str:
    return f"entry {one['entry']}{_who(one)}"


def _who(one: Values) -> str:
    return "".join(f", {one[name]}" for name in ("author", "source") if one[name])


def _structure(one: Values) -> str:
    place = f", place {one['rank']} in it" if one["rank"] is not None else ""
    within = f", in {' in '.join(one['part_of'])}" if one["part_of"] else ""
    return f"{one['kind']} {one['code']}{place}{within}"


def _neighbour(one: Values) -> str:
    if one["area"] is None:
        return f"{one['code']} (declared)"
    gap = "" if one["gap"] is None else f", gap {one['gap'] * 1e3:z.0f} mm"
    return f"{one['code']} ({one['area']:.3g} m²{gap})"


def _joint(one: Values) -> str:
    width = "" if one["width"] is None else f", {one['width'] * 1e3:z.1f} mm wide as surveyed"
    pressure = "" if one["pressure_max"] is None else f", up to {one['pressure_max']:.3g} Pa"
    return (
        f"{one['neighbour']}: {one['force_normal']:.4g} N across, {one['force_shear']:.4g} N along, "
        f"on {one['area']:.3g} m²{pressure}{width}"
    )


def _correction(one: Values) -> str:
    return f"{_words(one['attribute'])} {_value(one['before'])} → {_value(one['after'])} [{_by(one)}]"


def _with_unit(one: Values) -> str:
    return _value(one["value"]) if one["unit"] in (None, "-") else f"{_value(one['value'])} {one['unit']}"


def _values(values: Values) -> str:
    return ", ".join(f"{_words(name)} {_value(value)}" for name, value in values.items())


def _words(name: str) -> str:
    return name.replace("_", " ")


def _value(value: Any) -> str:
    if isinstance(value, list):
        return f"({', '.join(map(_value, value))})"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, bool):
        return _TRUTHS[value]
    return "not known" if value is None else str(value)


_TRUTHS = {True: "true", False: "false"}
