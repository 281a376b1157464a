"""IFC4: an element with a body for each stone, with property sets, materials and groups."""

import uuid
from base64 import b64encode
from collections.abc import Sequence
from importlib.metadata import version

import numpy as np

from pipelines.record.export.building import Building, Value, plain_values, stable_uuid
from pipelines.record.export.step import StepFile, enumeration, list_of, real, text, triples

_DIGITS = bytes.maketrans(
    b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/",
    b"0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_$",
)
"""Digits of base 64 in identifiers of IFC, which are those of RFC 4648 in another order."""

_SETS = {"Stone": "MOMA_Stone", "Depth": "MOMA_Depth", "Survey": "MOMA_Survey", "Results": "MOMA_Results"}
_KNOWLEDGE = "MOMA_Knowledge"


def global_id(identifier: uuid.UUID) -> str:
    """Return an identifier in the 22 characters of IFC.

    >>> global_id(uuid.UUID(int=0)), len(global_id(uuid.UUID(int=2**128 - 1)))
    ('0000000000000000000000', 22)
    """
    # 128 bits are 2 and 21 times 6: of 18 bytes, the first two digits have none of them
    return b64encode(b"\0\0" + identifier.bytes)[2:].translate(_DIGITS).decode("ascii")


def ifc_content(building: Building, crs: str | None = None) -> bytes:
    """Return a building as an IFC4 file.

    Parameters
    ----------
    crs : name of the coordinate reference system of the site, e.g. "EPSG:25832"; None: it is not known
    """
    return _Writer(building, crs).content()


class _Writer:
    """A file in the making."""

    def __init__(self, building: Building, crs: str | None) -> None:
        self._building = building
        program = f"MOMA {version('moma-masonry')}"
        self._file = StepFile(
            "IFC4", building.title, building.date, program, "ViewDefinition [ReferenceView_V1.2]"
        )
        self._shared: dict[tuple[str, str], str] = {}
        self._body, self._place = self._frame(crs)

    def content(self) -> bytes:
        """Return the whole file."""
        elements = self._elements()
        self._relate(
            "IFCRELCONTAINEDINSPATIALSTRUCTURE", "contained", list_of(elements), self._spatial(), "stones"
        )
        self._assign_materials(elements)
        self._assign_groups(elements)
        for column_set, columns in self._sets().items():
            self._assign_properties(elements, column_set, columns)
        return self._file.content()

    def _frame(self, crs: str | None) -> tuple[str, str]:
        """Add units and frame; return the context of bodies and the placement of the site."""
        add = self._file.add
        zero = add("IFCCARTESIANPOINT", triples([(0.0, 0.0, 0.0)])[1:-1])
        axes = add("IFCAXIS2PLACEMENT3D", zero, "$", "$")
        context = add("IFCGEOMETRICREPRESENTATIONCONTEXT", "$", "'Model'", "3", "1.E-06", axes, "$")
        body = add(
            "IFCGEOMETRICREPRESENTATIONSUBCONTEXT",
            *("'Body'", "'Model'", "*", "*", "*", "*", context, "$", enumeration("MODEL_VIEW"), "$"),
        )
        units = [
            add("IFCSIUNIT", "*", enumeration(kind), "$", enumeration(name))
            for kind, name in (
                ("LENGTHUNIT", "METRE"),
                ("AREAUNIT", "SQUARE_METRE"),
                ("VOLUMEUNIT", "CUBIC_METRE"),
                ("PLANEANGLEUNIT", "RADIAN"),
                ("PRESSUREUNIT", "PASCAL"),
                ("FORCEUNIT", "NEWTON"),
            )
        ]
        assigned = add("IFCUNITASSIGNMENT", list_of(units))
        self._project = add(
            "IFCPROJECT",
            self._id("project"),
            "$",
            text(self._building.title),
            *"$$$$",
            list_of([context]),
            assigned,
        )
        if crs is not None:
            system = add("IFCPROJECTEDCRS", text(crs), "$", "$", "$", "$", "$", "$")
            add("IFCMAPCONVERSION", context, system, "0.", "0.", "0.", "1.", "0.", "1.")
        return body, add("IFCLOCALPLACEMENT", "$", axes)

    def _spatial(self) -> str:
        """Add site and building, and return the building."""
        title = text(self._building.title)
        about = "$", title, *"$$", self._place, *"$$", enumeration("ELEMENT")  # $: not stated
        site = self._file.add("IFCSITE", self._id("site"), *about, *"$$$$$")
        house = self._file.add("IFCBUILDING", self._id("building"), *about, *"$$$")
        self._relate("IFCRELAGGREGATES", "sites", self._project, list_of([site]))
        self._relate("IFCRELAGGREGATES", "buildings", site, list_of([house]))
        return house

    def _elements(self) -> list[str]:
        """Add the stones, and return the references to them."""
        building, add = self._building, self._file.add
        starts = building.starts()
        triangles = building.mesh.triangles
        stone = building.mesh.owner[triangles[:, 0]]
        bounds = np.searchsorted(stone, np.arange(len(building.codes) + 1))
        references = []
        for row, (code, kind) in enumerate(zip(building.codes, building.kinds, strict=True)):
            first = int(starts[row])
            points = add(
                "IFCCARTESIANPOINTLIST3D", triples(building.mesh.vertices[first : starts[row + 1]].tolist())
            )
            corners = (triangles[bounds[row] : bounds[row + 1]] - first + 1).tolist()
            faces = list_of(f"({a},{b},{c})" for a, b, c in corners)
            solid = add("IFCTRIANGULATEDFACESET", points, "$", enumeration("T"), faces, "$")
            shape = add("IFCSHAPEREPRESENTATION", self._body, "'Body'", "'Tessellation'", list_of([solid]))
            form = add("IFCPRODUCTDEFINITIONSHAPE", "$", "$", list_of([shape]))
            references.append(
                add(
                    "IFCBUILDINGELEMENTPROXY",
                    self._id("stone", code),
                    "$",
                    text(code),
                    "$",
                    text(kind),
                    self._place,
                    form,
                    text(code),
                    enumeration("ELEMENT"),
                )
            )
        return references

    def _sets(self) -> dict[str, list[tuple[str, Sequence[Value]]]]:
        """Return the attributes by property set, with their values."""
        sets: dict[str, list[tuple[str, Sequence[Value]]]] = {}
        for column in self._building.columns:
            sets.setdefault(_SETS.get(column.group, _KNOWLEDGE), []).append(
                (column.name, plain_values(column))
            )
        volumes = self._building.volumes.tolist()
        sets.setdefault("MOMA_Solid", []).append(("solid_volume", volumes))
        return sets

    def _assign_properties(
        self, elements: Sequence[str], name: str, columns: Sequence[tuple[str, Sequence[Value]]]
    ) -> None:
        for row, (element, code) in enumerate(zip(elements, self._building.codes, strict=True)):
            there = [(label, value) for label, values in columns if (value := values[row]) is not None]
            if not there:
                continue
            properties = list_of(self._property(label, _measure(value)) for label, value in there)
            property_set = self._file.add(
                "IFCPROPERTYSET", self._id("set", name, code), "$", text(name), "$", properties
            )
            self._relate("IFCRELDEFINESBYPROPERTIES", f"set {name}", list_of([element]), property_set, code)

    def _property(self, label: str, value: str) -> str:
        """Return a property; stones with the same value share it."""
        key = (label, value)
        if key not in self._shared:
            self._shared[key] = self._file.add("IFCPROPERTYSINGLEVALUE", text(label), "$", value, "$")
        return self._shared[key]

    def _assign_materials(self, elements: Sequence[str]) -> None:
        stones: dict[str, list[str]] = {}
        for element, name in zip(elements, self._building.values("material"), strict=True):
            if name is not None:
                stones.setdefault(str(name), []).append(element)
        for name, some in sorted(stones.items()):
            material = self._file.add("IFCMATERIAL", text(name), "$", "$")
            known = self._building.materials.get(name, {})
            if known:
                properties = [
                    self._property(f"{each} [{unit}]" if unit else each, f"IFCREAL({real(value)})")
                    for each, (value, unit) in known.items()
                ]
                self._file.add("IFCMATERIALPROPERTIES", "'MOMA_Material'", "$", list_of(properties), material)
            self._relate("IFCRELASSOCIATESMATERIAL", "material", list_of(some), material, name)

    def _assign_groups(self, elements: Sequence[str]) -> None:
        groups = self._building.groups
        made = {
            group.code: self._file.add(
                "IFCGROUP",
                self._id("group", group.code),
                "$",
                text(group.code),
                text(group.title),
                text(group.kind),
            )
            for group in groups
        }
        for group in groups:
            members = [elements[row] for row in group.members]
            members += [made[member.code] for member in groups if member.parent == group.code]
            if members:
                self._relate(
                    "IFCRELASSIGNSTOGROUP", "group", list_of(members), f"$,{made[group.code]}", group.code
                )

    def _relate(self, kind: str, role: str, first: str, second: str, name: str = "") -> None:
        """Add a relationship."""
        self._file.add(kind, self._id("relation", kind, role, name), "$", "$", "$", first, second)

    def _id(self, *words: str) -> str:
        return f"'{global_id(stable_uuid(*words))}'"


def _measure(value: float | str) -> str:
    """Return a value with the type that IFC asks for."""
    return f"IFCREAL({real(value)})" if isinstance(value, float) else f"IFCLABEL({text(_short(value))})"


def _short(value: str) -> str:
    """Return a text of no more than the 255 characters of a label."""
    return value if len(value) <= 255 else value[:254] + "…"
