"""Two campaigns of one structure, compared stone by stone; they are never pooled."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from archmodel.store.campaigns import Displacement, FacePlace, compare, face_place
from mechanics.arrays import Array
from survey.geometry.solids import plane_frame
from survey.quality.precision import StoneQuality


@dataclass(frozen=True)
class MovedStone:
    """Stone that both campaigns measured.

    Attributes
    ----------
    code : of the stone
    displacement : from the earlier to the later place
    outwards : its part across the face, positive towards the observer [m]
    """

    code: str
    displacement: Displacement
    outwards: float


@dataclass(frozen=True)
class CampaignComparison:
    """Later campaign beside an earlier one.

    Attributes
    ----------
    name : of the earlier campaign
    files : its files
    stones : that both measured, the most significant displacement first
    scatter : of one coordinate along the face, beyond the stated standard deviations [m]: corners of two campaigns are
        not the same points of a stone; more than half of the stones must stand still for it not to hide movement
    common : (3,) median displacement [m]: of all stones alike, it is that of the frame or of the whole structure
    gone, fresh : codes that only the earlier, or only the later campaign has
    remarks : on what the places of all stones together tell, in words
    """

    name: str
    files: tuple[str, ...]
    stones: tuple[MovedStone, ...]
    scatter: float
    common: Array
    gone: tuple[str, ...]
    fresh: tuple[str, ...]
    remarks: tuple[str, ...] = ()

    @property
    def moved(self) -> tuple[MovedStone, ...]:
        """Stones that have moved, by what both campaigns can tell."""
        return tuple(stone for stone in self.stones if stone.displacement.significant)

    def as_values(self) -> dict[str, object]:
        """Return plain values for JSON, in metres."""
        return {
            "campaign": self.name,
            "files": list(self.files),
            "compared": len(self.stones),
            "moved": [stone.code for stone in self.moved],
            "scatter": self.scatter,
            "common": self.common.tolist(),
            "only_earlier": list(self.gone),
            "only_later": list(self.fresh),
            "displacements": [
                {
                    "code": stone.code,
                    "vector": stone.displacement.vector.tolist(),
                    "distance": stone.displacement.distance,
                    "sigma": stone.displacement.sigma,
                    "outwards": stone.outwards,
                    "moved": stone.displacement.significant,
                }
                for stone in self.stones
            ],
        }


def compare_campaigns(
    name: str, files: Sequence[str], earlier: Sequence[StoneQuality], later: Sequence[StoneQuality]
) -> CampaignComparison:
    """Compare the stones of a later campaign with those of an earlier one.

    Parameters
    ----------
    name, files : of the earlier campaign
    earlier, later : measured stones of each, in one frame
    """
    before, after = ({stone.code: stone for stone in stones} for stones in (earlier, later))
    both = [code for code in after if code in before]
    compared = compare({code: (_place(before[code]), _place(after[code])) for code in both})
    moved = [
        MovedStone(code, moved_by, float(moved_by.vector @ after[code].normal))
        for code, moved_by in compared.displacements.items()
    ]
    moved.sort(key=lambda stone: -stone.displacement.distance / stone.displacement.sigma)
    return CampaignComparison(
        name,
        tuple(files),
        tuple(moved),
        compared.scatter,
        compared.common,
        tuple(code for code in before if code not in after),
        tuple(code for code in after if code not in before),
        compared.remarks,
    )


def _place(stone: StoneQuality) -> FacePlace:
    tilt = np.radians(stone.tilt_sigma)
    covariance = np.diag([tilt**2, tilt**2, stone.offset_sigma**2])
    centroid = stone.outline.mean(axis=0)
    axes = plane_frame(stone.normal)[:2]
    return face_place(stone.outline, stone.normal, centroid, axes, covariance, stone.corner_sigma)


def comparison_lines(comparison: CampaignComparison) -> Iterator[str]:
    """Yield the comparison in lines for people."""
    moved, compared = comparison.moved, comparison.stones
    listed = ", ".join(
        f"{stone.code} by {1e3 * stone.displacement.distance:.1f} ± {1e3 * stone.displacement.sigma:.1f} mm"
        for stone in moved[:3]
    )
    rest = f" and {len(moved) - 3} more" if len(moved) > 3 else ""
    text = f": {listed}{rest}" if listed else ""
    yield f"since {comparison.name}: {len(moved)} of {len(compared)} stones moved{text}"
    for remark in comparison.remarks:
        yield f"  {remark}"
    for what, codes in (("only the earlier", comparison.gone), ("only this", comparison.fresh)):
        if codes:
            more = ", …" if len(codes) > 3 else ""
            yield f"  {what} campaign has {len(codes)} stones: {', '.join(codes[:3])}{more}"
