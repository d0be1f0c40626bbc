"""Recording from a camera: every throw becomes a film of the session, which is then tracked."""

from __future__ import annotations

import re
from contextlib import closing
from typing import TYPE_CHECKING

from agents.app.club import Club, Session
from agents.app.club.films import take_film
from agents.app.work.jobs import submit
from curling_env.errors import InputError
from curling_env.infrastructure.files.writing import make_directory
from friction_estimation.camera.pose import camera_from_scene
from friction_estimation.camera.scene import load_scene
from friction_estimation.live import open_feed
from friction_estimation.live.recorder import Clip, Recorder
from friction_estimation.tracking.films.motion_detector import MotionDetector

SOURCE = r"\d{1,3}|(?:rtsps?|rtmps?|https?|udp|rtp|srt)://\S{1,500}"
"""Cameras of this machine by their number, and streams by their address; no files."""

if TYPE_CHECKING:
    from agents.app.work.reported import Reported


def do_record(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """Record throws until the stream ends or the work is cancelled; the last one is kept too.

    Parameters
    ----------
    given : number of a camera of this machine, or address of a stream

    Raises
    ------
    InputError : no camera's number or address, nothing comes from there, or it is not marked
    """
    camera = club.camera(session.camera_id)
    if camera is None or camera.scene is None:
        raise InputError("mark the sheet in the camera's picture first", source=session.name)
    if re.fullmatch(SOURCE, given, re.IGNORECASE) is None:
        raise InputError("expected a camera index or a stream URL", source=given[:80])
    scene = load_scene(club.path(camera.scene))
    feed = open_feed(given)
    count = 0

    def keep(clip: Clip | None) -> None:
        nonlocal count
        if clip is not None:
            count += 1
            take_film(club, session, clip.path)
            submit(club, "track", session)

    motion = MotionDetector.for_camera(camera_from_scene(scene, feed.size), scene)
    folder = make_directory(club.folder_of(session) / "films")
    recorder = Recorder(feed=feed, motion=motion, folder=folder)
    with closing(feed):
        try:
            with closing(feed.frames()) as frames:
                for frame in frames:
                    keep(recorder.add(frame))
                    progress(f"watching the camera, {count} throws recorded", 0.0, 0.0)
        finally:
            keep(recorder.finish())
