"""How the stones of a scene were meshed, and how well."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

from mechanics.stones.meshing.quality import MeshQuality

__all__ = ["MeshReport", "StoneMesh"]


@dataclass(frozen=True)
class StoneMesh:
    """How one stone was meshed.

    Attributes
    ----------
    code : the stone
    how : the mesher that made its mesh
    failures : meshers that were tried before, each with its reason
    like : the stone of the same shape whose mesh it was given, moved and turned; its own code if it was meshed itself
    quality : of its mesh
    """

    code: str
    how: str
    failures: tuple[str, ...]
    like: str
    quality: MeshQuality


@dataclass(frozen=True)
class MeshReport:
    """How all deformable stones of a scene were meshed, in the order of its blocks."""

    stones: tuple[StoneMesh, ...] = ()

    @property
    def nodes(self) -> int:
        """Of all stones together."""
        return sum(stone.quality.nodes for stone in self.stones)

    @property
    def cells(self) -> int:
        """Of all stones together."""
        return sum(stone.quality.cells for stone in self.stones)

    @property
    def distinct(self) -> int:
        """Meshes that had to be made."""
        return sum(stone.like == stone.code for stone in self.stones)

    @property
    def how(self) -> Mapping[str, int]:
        """How many stones got their mesh from which mesher."""
        return dict(sorted(Counter(stone.how for stone in self.stones).items()))

    @property
    def sharpest(self) -> StoneMesh | None:
        """The first stone with the smallest dihedral angle; None without deformable stones."""
        return min(self.stones, key=lambda stone: stone.quality.min_dihedral, default=None)

    @property
    def worst(self) -> StoneMesh | None:
        """The first stone with the smallest scaled Jacobian; None without deformable stones."""
        return min(self.stones, key=lambda stone: stone.quality.min_scaled_jacobian, default=None)

    @property
    def retried(self) -> tuple[StoneMesh, ...]:
        """Stones at which a mesher failed before another succeeded."""
        return tuple(stone for stone in self.stones if stone.failures and stone.like == stone.code)
