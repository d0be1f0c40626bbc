"""Options for reading films, and the tracking that they configure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Option

from curling_env.commands.options import option
from curling_env.commands.terminal import print_remark
from curling_env.typing import Progress
from friction_estimation.camera.scene import CAMERA_HEIGHTS

if TYPE_CHECKING:
    from friction_estimation.camera.scene import Scene
    from friction_estimation.tracking import TrackedFilm

SCENE = Option(
    metavar="SCENE.json",
    help="Scene from `curling corners`; one for all films, or one for each.",
    rich_help_panel="Film and camera",
)
LensOption = Annotated[
    Path | None,
    Option(metavar="CAMERA.json", help="Lens from `curling calibrate`, instead of the scene's."),
]
HeightOption = Annotated[
    float | None,
    Option(
        metavar="M",
        min=CAMERA_HEIGHTS[0],
        max=CAMERA_HEIGHTS[1],
        help="Measured height of the camera above the ice [m].",
    ),
]


@dataclass(frozen=True, kw_only=True)
class Viewing:
    """Film and camera"""

    camera: LensOption = None
    height: HeightOption = None
    tracker: str = option("built-in", "Other tracker: NAME or MODULE:FUNCTION.")

    def scenes(self, paths: Sequence[Path]) -> list[Scene]:
        """Load scenes with the given lens and height.

        Raises
        ------
        InputError : a file that cannot be read or does not fit
        """
        from friction_estimation.camera.scene import load_scene

        return [load_scene(path, self.camera, self.height) for path in paths]


@dataclass(frozen=True, kw_only=True)
class Tracking(Viewing):
    """Film and camera"""

    refine: bool = option(True, "Correct the marks by the paint.", "--refine/--as-marked")
    slow: float | None = option(None, "Factor of slow motion.", min=0.05, metavar="N")

    def throws_in(
        self,
        films: Sequence[Path],
        scenes: Sequence[Scene],
        output: Path,
        *,
        always_track: int = 0,
        progress: Progress,
    ) -> Iterator[TrackedFilm]:
        """Track films, and report each throw on stderr.

        Parameters
        ----------
        films, scenes, always_track, progress : see `track_each`
        output : file of the result; tracks are kept next to it until all films are tracked

        Raises
        ------
        InputError : an unknown tracker, options that it does not support, or a film that it refuses
        """
        import cv2

        from friction_estimation.tracking import TrackingOptions, load_tracker, track_each
        from friction_estimation.tracking.films.in_words import film_in_words
        from friction_estimation.tracking.films.resume import Checkpoints
        from friction_estimation.tracking.films.shared_cameras import SharedCameras

        cv2.setNumThreads(1)
        options = TrackingOptions(refine=self.refine, slow=self.slow)
        for one in track_each(
            films,
            scenes,
            tracker=load_tracker(self.tracker, options),
            checkpoints=Checkpoints(output),
            cameras=SharedCameras(keep=True),
            always_track=always_track,
            left_out=lambda why: print_remark(f"dropped: {why}"),
            progress=progress,
        ):
            print_remark(f"{one.name}: {film_in_words(one)}")
            yield one
