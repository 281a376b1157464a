"""Entities, structures and their history as text."""

from collections.abc import Mapping, Sequence
from typing import Any

from moma.cli.text.formats import as_lines

Values = Mapping[str, Any]


def entity_lines(description: Values) -> str:
    """Format the result of `describe` as indented lines, without unknown values."""
    shown = dict(description)
    shown["knowledge"] = {
        name: _named(content)
        if isinstance(content, Mapping)
        else [_statement(statement) for statement in content or ()]
        for name, content in description["knowledge"].items()
    }
    shown["knowledge"] = {name: value for name, value in shown["knowledge"].items() if value}
    for name, describe in (("structures", _structure), ("joints", _joint), ("corrections", _correction)):
        shown[name] = [describe(each) for each in description.get(name, ())]
    if description.get("measured"):
        shown["measured"] = dict(description["measured"])
        shown["measured"]["evidence"] = [_located(point) for point in description["measured"]["evidence"]]
    shown["own"] = {name: _with_unit(value) for name, value in description.get("own", {}).items()}
    shown["relations"] = {
        name: [_neighbour(neighbour) for neighbour in ones]
        for name, ones in description.get("relations", {}).items()
    }
    if not shown.get("hypothesis"):
        shown.pop("hypothesis", None)  # nearly all entities were surveyed
    for name in ("recorded", "withdrawn"):
        shown[name] = _by(description[name]) if description.get(name) else None
    return as_lines({name: _listed(content) for name, content in shown.items()})


def _located(point: Values) -> str:
    """Format how a point of the face was located: its place, its precision, and the marks behind it."""
    place = ", ".join(f"{value:.4f}" for value in point["place"])
    precision = ", ".join(f"{1e3 * value:.1f}" for value in point["sigma"])
    rays = [
        f"{ray['photo']} at ({ray['x']:.2f}, {ray['y']:.2f}) px from {ray['distance']:.2f} m"
        + (f", residual ({ray['residual'][0]:z.2f}, {ray['residual'][1]:z.2f}) px" if ray["test"] else "")
        for ray in point["rays"]
    ]
    what = "corner" if point["role"] == "vertex" else "point"
    return f"{what} {point['point']} at ({place}) ± ({precision}) mm: {point['how']}" + "".join(
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
        return {name: _listed(entry) for name, entry in content.items()}
    if isinstance(content, list) and content and all(isinstance(entry, str) for entry in content):
        long = any(" " in entry for entry in content)
        return {str(number): entry for number, entry in enumerate(content, start=1)} if long else content
    return content


def _named(opinion: Values) -> dict[str, Any]:
    """Describe a material with its properties, or a phase with its years."""
    shown: dict[str, Any] = {"name": opinion["name"], "description": opinion["description"]}
    if "begins" in opinion:
        years = [str(opinion[end]) if opinion[end] is not None else "?" for end in ("begins", "ends")]
        shown["years"] = None if years == ["?", "?"] else "–".join(years)
    for name, value in opinion.get("properties", {}).items():
        sigma = "" if value["sigma"] is None else f" ± {value['sigma']:.4g}"
        unit = "" if value["unit"] == "-" else f" {value['unit']}"
        shown[name] = f"{value['value']:.4g}{sigma}{unit} ({value['source']})"
    if opinion.get("others"):
        shown["disputed" if opinion["disputed"] else "agreed"] = opinion["rule"]
        shown["beside it"] = [_statement(other) for other in opinion["others"]]
    return shown | {"evidence": _cited(opinion), "recorded": _by(opinion)}


def _statement(statement: Values) -> str:
    """Format a statement in one line."""
    values = {
        name: value
        for name, value in statement.items()
        if name not in (*_PROVENANCE, "text", "document", "locator", "observed_on", "said_of")
    }
    parts = [_values(values), _cited(statement)]
    return f"{', '.join(part for part in parts if part)} [{_by(statement)}]"


_PROVENANCE = ("entry", "action", "author", "source", "recorded_at", "stated_on")


def _cited(statement: Values) -> str:
    """Format text, document, date and, if it is inherited, the subject of a statement."""
    where = statement.get("document", "")
    parts = [
        statement.get("text"),
        f"{where} {statement['locator']}" if where and "locator" in statement else where,
        f"seen {statement['observed_on']}" if "observed_on" in statement else None,
        f"inherited from {statement['said_of']}" if "said_of" in statement else None,
    ]
    return ", ".join(part for part in parts if part)


def _by(statement: Values) -> str:
    return f"entry {statement['entry']}{_who(statement)}"


def _who(statement: Values) -> str:
    return "".join(f", {statement[name]}" for name in ("author", "source") if statement[name])


def _structure(structure: Values) -> str:
    place = f", place {structure['rank']} in it" if structure["rank"] is not None else ""
    within = f", in {' in '.join(structure['part_of'])}" if structure["part_of"] else ""
    return f"{structure['kind']} {structure['code']}{place}{within}"


def _neighbour(neighbour: Values) -> str:
    if neighbour["area"] is None:
        return f"{neighbour['code']} (declared)"
    gap = "" if neighbour["gap"] is None else f", gap {neighbour['gap'] * 1e3:z.0f} mm"
    return f"{neighbour['code']} ({neighbour['area']:.3g} m²{gap})"


def _joint(joint: Values) -> str:
    width = "" if joint["width"] is None else f", {joint['width'] * 1e3:z.1f} mm wide as surveyed"
    pressure = "" if joint["pressure_max"] is None else f", up to {joint['pressure_max']:.3g} Pa"
    return (
        f"{joint['neighbour']}: {joint['force_normal']:.4g} N across, {joint['force_shear']:.4g} N along, "
        f"on {joint['area']:.3g} m²{pressure}{width}"
    )


def _correction(correction: Values) -> str:
    change = f"{_value(correction['before'])} → {_value(correction['after'])}"
    return f"{_words(correction['attribute'])} {change} [{_by(correction)}]"


def _with_unit(value: Values) -> str:
    return (
        _value(value["value"])
        if value["unit"] in (None, "-")
        else f"{_value(value['value'])} {value['unit']}"
    )


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
