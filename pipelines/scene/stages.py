"""Stages of building: from [[stages]] of a scene file to the stones that stand and are held in each."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from ground.errors import UsageError
from ground.settings import Setting
from ground.toml.keys import Stones, Texts, keys_of
from ground.toml.lines import Path
from ground.toml.schema import TomlDocument, nearest
from pipelines.scene.array_tables import ArrayTable, read_entries

Codes = frozenset[str]


@dataclass(frozen=True, kw_only=True)
class Stage:
    """Table [[stages]]."""

    name: Annotated[str, Setting("Name, by which loads refer to it.")]
    lay: Annotated[
        Stones,
        Setting(
            "Codes or expressions of the stones that are laid in it. Fixed stones that no stage lays stand "
            "from the first."
        ),
    ] = ()
    remove: Annotated[
        Stones,
        Setting(
            "Codes or expressions of the stones that are taken away before it: a centring that was laid."
        ),
    ] = ()
    hold: Annotated[
        Stones,
        Setting(
            "Codes or expressions of the stones that a rigid centring holds in it, if they stand: they do "
            "not move."
        ),
    ] = ()


STAGE_KEYS = keys_of(Stage)


@dataclass(frozen=True, kw_only=True)
class LoadTable:
    """Keys of every load."""

    stages: Annotated[
        Texts,
        Setting(
            "Names of the stages in which it acts, from the beginning of each; needed in a scene with `[[stages]]`, "
            "and only there."
        ),
    ] = ()


@dataclass(frozen=True)
class StandingStones:
    """Stones that stand in a stage, and those of them that its centring holds, by code."""

    entry: ArrayTable
    standing: Codes
    held: Codes

    @property
    def name(self) -> str:
        """Name of the stage."""
        return str(self.entry.values["name"])


def read_stages(
    document: TomlDocument,
    toml: Mapping[str, Any],
    loads: Iterable[ArrayTable],
    throws: Sequence[ArrayTable],
) -> tuple[ArrayTable, ...]:
    """Check all stages, and the names by which loads refer to them; their stones are still expressions."""
    stages = read_entries(document, toml, "stages", {"stage": STAGE_KEYS})
    names: list[str] = []
    for entry in stages:
        if entry.values["name"] in names:
            document.fail(
                f"two stages named {entry.values['name']!r}", *entry.path, "name", remedy="give each its own"
            )
        names.append(entry.values["name"])
    for load in loads:
        _check_load(document, load, names)
    if stages and throws:
        what = "stones that begin in motion, in a building in stages"
        document.fail(what, *throws[0].path, remedy="leave out [[throw]], or [[stages]]")
    return stages


def _check_load(document: TomlDocument, load: ArrayTable, names: Sequence[str]) -> None:
    asked = load.values["stages"]
    if names and not asked:
        document.fail(
            "a load that does not say in which stages it acts",
            *load.path,
            remedy=f"give stages, e.g. [{names[-1]!r}]",
        )
    if asked and not names:
        document.fail("stages of a load, in a scene without", *load.path, "stages", remedy="add [[stages]]")
    for name in asked:
        if name not in names:
            document.fail(f"no stage {name!r}", *load.path, "stages", remedy=nearest(name, names))


def standing_stones(
    document: TomlDocument,
    stages: Sequence[ArrayTable],
    groups: Mapping[Path, Sequence[Codes]],
    codes: Iterable[str],
    fixed: Codes,
    loads: Iterable[ArrayTable],
) -> tuple[StandingStones, ...]:
    """Return the stones that stand in each stage; `fixed` ones that no stage lays stand in the first.

    Parameters
    ----------
    document, stages, loads : of the scene
    groups : the stones that its tables name
    codes, fixed : of its stones, and of those that never move

    Raises
    ------
    SceneError : a stage lays what stands, removes what does not, or holds only what does not; a stone is never laid; a
        load acts on stones of which none stands
    """
    loads = tuple(loads)
    laid = frozenset[str]().union(*(groups[entry.path][0] for entry in stages))
    standing, found = fixed - laid, list[StandingStones]()
    for entry in stages:
        name, (lay, remove, hold) = entry.values["name"], groups[entry.path]
        now = (standing - remove) | lay
        for key, wrong, what, remedy in (
            ("remove", remove - standing, "is removed before it is laid", "lay it in an earlier stage"),
            ("lay", lay & (standing - remove), "is laid, but stands already", "lay it once"),
            (
                "hold",
                hold if not hold & now else None,
                "is held, but does not stand",
                "lay it first, or with it",
            ),
        ):
            if wrong:
                document.fail(f"stone {min(wrong)} {what} in stage {name!r}", *entry.path, key, remedy=remedy)
        hold &= now
        acting = [load for load in loads if name in load.values["stages"]]
        if not now:
            document.fail(f"no stone stands in stage {name!r}", *entry.path, remedy="give lay")
        for load in acting:
            for (key, _), stones in zip(load.groups, groups[load.path], strict=True):
                if not stones & now:
                    what = f"none of its stones stands in stage {name!r}"
                    document.fail(what, *load.path, key, remedy="let it act in a later stage")
        standing = now
        found.append(StandingStones(entry, standing, hold))
    if never := set(codes) - laid - fixed:
        document.fail(
            f"{len(never)} stones are never laid, e.g. {min(never)}",
            *stages[-1].path,
            remedy="lay them in a stage, or leave them out by exclude in [select]",
        )
    return tuple(found)


def refuse_stages(stages: Sequence[ArrayTable], document: TomlDocument, command: str) -> None:
    """Refuse a scene with stages in a command that knows none.

    Raises
    ------
    UsageError : with file and line
    """
    if stages:
        raise UsageError(
            f"{command} knows no stages of building",
            where=document.where(*stages[0].path),
            remedy="leave [[stages]] out of a copy of the scene, or run it with: moma run",
        )
