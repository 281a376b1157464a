"""Model of each stone of a scene, and its reason: as simple as the requested outputs allow.

The lists of [bodies] take precedence. With `default = "auto"` a stone deforms where an output needs its stress, and
so do those within a few joints of it, as rigid neighbours would restrain it too stiffly; all others are rigid.
"""

from collections import deque
from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, replace

from mechanics.scene.scene import Fidelity
from survey.joints.report import StoneJoint

Neighbours = Mapping[str, Iterable[str]]


@dataclass(frozen=True)
class Wishes:
    """Requests of a scene that bear on the models of its stones.

    Attributes
    ----------
    named : by code, the model that a list of [bodies] gives
    default : of all others; None: as the outputs need
    stress : codes of the stones whose stress is requested; None: not given
    pictures : names of the pictures of stress that are requested
    pushed : codes of the stones on which forces act; forces can act on rigid stones only
    ring : number of joints from a stone whose stress is requested within which stones deform too
    """

    named: Mapping[str, Fidelity]
    default: Fidelity | None
    stress: Set[str] | None = None
    pictures: tuple[str, ...] = ()
    pushed: Set[str] = frozenset()
    ring: int = 0


@dataclass(frozen=True)
class Modelled:
    """Model of one stone.

    Attributes
    ----------
    fidelity : fixed, rigid or deformable
    reason : in words
    ring : joints to the nearest stone for whose stress it deforms; 0: not for that of another
    stress : whether its stress is computed
    """

    fidelity: Fidelity
    reason: str
    ring: int = 0
    stress: bool = False


def modelled(codes: Sequence[str], neighbours: Neighbours, wishes: Wishes) -> dict[str, Modelled]:
    """Choose the model of each stone.

    Parameters
    ----------
    codes : of all stones of the scene
    neighbours : by code, the stones with which it shares a joint; symmetric
    wishes : requests of the scene
    """
    chosen: dict[str, Modelled] = {}
    for code in codes:
        if code in wishes.named:
            chosen[code] = _listed(wishes.named[code])
        elif wishes.default is not None:
            chosen[code] = Modelled(wishes.default, f'default = "{wishes.default}" in [bodies]')
        elif (reason := _needed(code, wishes)) is not None:
            chosen[code] = Modelled(Fidelity.DEFORMABLE, reason)
    if wishes.default is None:
        chosen |= _others(codes, chosen, neighbours, wishes)
    return {
        code: replace(chosen[code], stress=True) if _stressed(code, chosen[code], wishes) else chosen[code]
        for code in codes
    }


def neighbours(joints: Iterable[StoneJoint]) -> dict[str, set[str]]:
    """Return, by code, the stones that face it across a joint; stones without joints are left out."""
    neighbouring: dict[str, set[str]] = {}
    for joint in joints:
        first, second = joint.stones
        neighbouring.setdefault(first, set()).add(second)
        neighbouring.setdefault(second, set()).add(first)
    return neighbouring


def _listed(fidelity: Fidelity) -> Modelled:
    reason = (
        "support: named in [bodies] fixed" if fidelity is Fidelity.FIXED else f"named in [bodies] {fidelity}"
    )
    return Modelled(fidelity, reason)


def _needed(code: str, wishes: Wishes) -> str | None:
    """Return the reason for which the stress of a stone is needed; None if it is not."""
    if wishes.stress is not None:
        return "stress asked for by [output] stress" if code in wishes.stress else None
    if wishes.pictures and code not in wishes.pushed:
        return f"picture {wishes.pictures[0]} of [output] shows the stress of all stones"
    return None


def _stressed(code: str, model: Modelled, wishes: Wishes) -> bool:
    if model.fidelity is not Fidelity.DEFORMABLE:
        return False
    return wishes.stress is None or code in wishes.stress


def _others(
    codes: Sequence[str], chosen: Mapping[str, Modelled], neighbours: Neighbours, wishes: Wishes
) -> dict[str, Modelled]:
    """Model stones whose stress is not needed: deformable within the ring, rigid outside it."""
    fixed = {code for code, model in chosen.items() if model.fidelity is Fidelity.FIXED}
    region = [
        code for code in codes if code in (wishes.stress or ()) and _stressed(code, chosen[code], wishes)
    ]
    within = _within(region, neighbours, wishes.ring, fixed)
    others: dict[str, Modelled] = {}
    for code in codes:
        if code in chosen:
            continue
        if code in wishes.pushed:
            others[code] = Modelled(Fidelity.RIGID, "a force acts on it, and forces act on rigid stones")
        elif code in within:
            distance, nearest = within[code]
            reason = f"within {distance} joint{'' if distance == 1 else 's'} of {nearest}"
            others[code] = Modelled(Fidelity.DEFORMABLE, reason, ring=distance)
        else:
            others[code] = Modelled(Fidelity.RIGID, "no output needs its stress")
    return others


def _within(
    region: Sequence[str], neighbours: Neighbours, reach: int, fixed: Set[str]
) -> dict[str, tuple[int, str]]:
    """Return stones within `reach` joints of a region: the distance and the nearest stone, the first of several.

    Fixed stones transmit no load from one side to another, so paths do not pass through them.
    """
    reached = {code: (0, code) for code in region}
    waiting = deque(region)
    while waiting:
        code = waiting.popleft()
        distance, nearest = reached[code]
        if distance == reach:
            continue
        for neighbour in sorted(neighbours.get(code, ())):
            if neighbour not in reached and neighbour not in fixed:
                reached[neighbour] = distance + 1, nearest
                waiting.append(neighbour)
    return reached
