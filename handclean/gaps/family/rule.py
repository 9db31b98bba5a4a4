"""A linear rule from donors to a hidden marker, seen from the body.

Every frame's donors are laid onto those of the first frame to learn from (`body`); the
rule holds in these coordinates.
"""

from collections.abc import Callable
from dataclasses import dataclass

from handclean.arrays import Floats, Ints
from handclean.gaps.body import motion_onto
from handclean.gaps.family.donors import Group, expect_width, spread_evenly
from handclean.gaps.family.ends import frames_of, root_mean_square
from handclean.gaps.family.learnt import prepare_learnt
from handclean.gaps.runs import Gap
from handclean.gaps.tracks import Fill, Tracks

Slopes = Callable[[Floats, Floats], Floats]
"""Learns (3 V, 3) slopes from donors (N, V, 3) [m] and hidden places (N, 3) [m] in the
body's coordinates. Donors less their mean, as rows, times slopes are to give places
less theirs."""


@dataclass(frozen=True, kw_only=True)
class Rule:
    """Place less ``place`` = (donors less ``mean``) times ``slopes``, of one marker.

    Attributes
    ----------
    markers : (V,) donors.
    reference : (V, 3) [m] what each frame's donors are laid onto.
    mean : (V, 3) [m]; slopes : (3 V, 3); place : (3,) [m]
    residual : [m] root mean square error per axis where it was learnt.
    """

    tracks: Tracks
    markers: Ints
    reference: Floats
    mean: Floats
    slopes: Floats
    place: Floats
    residual: float

    def path(self, gap: Gap) -> Floats:
        """(N, 3) [m] places in a gap and at the ends it has."""
        frames = frames_of(self.tracks, gap)
        points = self.tracks.positions[frames][:, self.markers]
        motion = motion_onto(points, self.reference)
        rows = (motion.to_body(points) - self.mean).reshape(len(frames), -1)
        return motion.to_laboratory(rows @ self.slopes + self.place)


def prepare_rule(tracks: Tracks, slopes_of: Slopes) -> Fill:
    """Return a filler that follows a linear rule."""

    def learn(hidden: int, group: Group) -> Rule:
        frames = spread_evenly(group.frames)
        points = tracks.positions[frames][:, group.markers]
        expect_width(points[0])
        motion = motion_onto(points, points[0])
        local = motion.to_body(points)
        places = motion.to_body(tracks.positions[frames][:, [hidden]])[:, 0]
        slopes = slopes_of(local, places)
        mean, place = local.mean(axis=0), places.mean(axis=0)
        left = places - place - (local - mean).reshape(len(frames), -1) @ slopes
        return Rule(
            tracks=tracks,
            markers=group.markers,
            reference=points[0],
            mean=mean,
            slopes=slopes,
            place=place,
            residual=root_mean_square(left),
        )

    return prepare_learnt(tracks, learn)
