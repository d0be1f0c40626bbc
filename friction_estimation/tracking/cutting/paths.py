"""Where stones were seen that may have been thrown, and what became of them since.

Between sweepers a stone is lost for a while, or only those who go beside it are seen. What goes on
is joined. What vanishes before it was thrown, or is slid back afterwards, is no throw.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from curling_env.sheet import HOG_LINE_Y
from friction_estimation.camera.camera import Camera
from friction_estimation.tracking.cutting import tuning
from friction_estimation.tracking.cutting.pace import slides_until
from friction_estimation.tracking.detection.thrown_stone import RoughPath


@dataclass(frozen=True, kw_only=True, eq=False)
class LostPath:
    """Where a stone was seen, and what may have become of it.

    Parameters
    ----------
    path : where it was seen
    begin, end : from when to when it, or who goes beside it, was seen [s]
    until : until when it is looked for: longer than it was seen where people may hide it [s]
    slides : until when it may have slid on [s]
    seen : whether it was seen itself, or only who goes beside it
    """

    path: RoughPath
    begin: float
    end: float
    until: float
    slides: float
    seen: bool = True

    @property
    def rests(self) -> bool:
        """Whether it was seen to come to rest, or to leave the picture."""
        return self.seen and self.until <= self.end

    @classmethod
    def of(cls, path: RoughPath, slides: float = 0.0, *, hidden: bool = False) -> LostPath:
        """A path by itself.

        Parameters
        ----------
        slides : until when its stone may have slid on [s]
        hidden : whether people may hide it at the end
        """
        begin, end = path.sightings[0].t, path.sightings[-1].t
        return cls(path=path, begin=begin, end=end, until=slides if hidden else end, slides=slides)


def with_groups(
    paths: Sequence[LostPath], groups: Sequence[RoughPath], far: float
) -> list[LostPath]:
    """Paths of stones, and those of sweepers whose stone was not seen; they last as long as both.

    A stone that was seen for a while only is looked for as long as people go on beside it.

    Parameters
    ----------
    far : where the ice ends, from the middle of the sheet [m]
    """
    found = list(paths)
    for group in groups:
        y = np.array([s.xy[1] for s in group.sightings])
        # Before it sets out, it may be somebody else, as where a film goes on with another throw.
        sets_out = int(np.argmax(np.abs(y - y[0]) >= (1 - tuning.MOVING_SHARE) * abs(y[-1] - y[0])))
        path = RoughPath(sightings=group.sightings[sets_out:])
        slides = slides_until(path, far, tuning.GROUP_PACE_SECONDS)
        one = replace(LostPath.of(path, slides, hidden=True), seen=False)
        own = [k for k, path in enumerate(found) if path.begin < one.end and one.begin < path.end]
        for k in own:
            found[k] = replace(
                found[k],
                begin=min(found[k].begin, one.begin),
                end=max(found[k].end, one.end),
                until=max(found[k].until, one.until),
                slides=max(found[k].slides, one.slides),
            )
        if not own:
            found.append(one)
    return sorted(found, key=lambda path: path.begin)


def vanishes_behind_its_hog_line(path: LostPath, camera: Camera) -> bool:
    """Whether something is seen no more, and nobody hides it, before it was thrown.

    A camera that does not see the hog line of that end cannot tell.
    """
    begin, last = path.path.sightings[0].xy, path.path.sightings[-1].xy
    line = -HOG_LINE_Y * np.sign(last[1] - begin[1])
    short = (line - last[1]) * line < 0
    hidden = path.until > path.end
    return bool(short and not hidden and camera.sees(np.array([[last[0], line, 0.0]]))[0])


def without_returns(
    paths: Sequence[LostPath],
    slid_back: Callable[[float, float], object] = lambda begin, end: None,
) -> Iterator[LostPath]:
    """The paths without those of stones that are slid back from where they came to rest.

    What goes on at once from where a stone came to rest was hit by it.

    Parameters
    ----------
    slid_back : called with when each of them was, from and to [s]
    """
    before: LostPath | None = None
    for one in paths:
        if before is not None and one.seen and before.seen:
            begin, end = one.path.sightings[0].xy, one.path.sightings[-1].xy
            first, last = before.path.sightings[0].xy, before.path.sightings[-1].xy
            near = np.linalg.norm(begin - last) < tuning.RETURN_DISTANCE
            at_once = one.path.sightings[0].t < before.path.sightings[-1].t + tuning.STRUCK_SECONDS
            back = before.rests and (end - begin)[1] * (last - first)[1] < 0
            if near and (back or at_once):
                if not at_once:
                    slid_back(one.begin, one.end)
                continue
        before = one
        yield one


def joined(paths: Sequence[LostPath]) -> list[LostPath]:
    """The paths, those of a stone that was lost between sweepers joined with what goes on."""
    whole: list[LostPath] = []
    for path in paths:
        before = whole[-1] if whole else None
        if before is not None and _goes_on(before, path):
            joined = (*before.path.sightings, *path.path.sightings)
            whole[-1] = replace(path, path=RoughPath(sightings=joined), begin=before.begin)
        else:
            whole.append(path)
    return whole


def _goes_on(before: LostPath, path: LostPath) -> bool:
    """Whether a path sets out ahead of a stone that may still slide, and the same way."""
    if path.begin > before.slides:
        return False
    y = [s.xy[1] for s in before.path.sightings]
    own = [s.xy[1] for s in path.path.sightings]
    way = y[-1] - y[0]
    return bool((own[0] - y[-1]) * way > 0 and (own[-1] - own[0]) * way > 0)
