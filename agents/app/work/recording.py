"""Recording from a camera: every throw becomes a film of the session, which is then tracked.

The first numbers of a throw are there as soon as its stone has passed a line or come to rest.
"""

from __future__ import annotations

import re
from contextlib import closing

from agents.app.club import Club, Session
from agents.app.club.club import encoded
from agents.app.club.films import take_film
from agents.app.club.session_files import load_part, part_path
from agents.app.work.jobs import Reported, submit
from curling_env.errors import InputError
from curling_env.infrastructure.files.writing import make_directory
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.pose import camera_from_scene
from friction_estimation.camera.scene import Scene, load_scene
from friction_estimation.live import open_feed
from friction_estimation.live.glance import Glance
from friction_estimation.live.recorder import Clip, Recorder
from friction_estimation.tracking.films.motion_detector import MotionDetector
from friction_estimation.tracking.films.shared_cameras import camera_from

SOURCE = r"\d{1,3}|(?:rtsps?|rtmps?|https?|udp|rtp|srt)://\S{1,500}"
"""Cameras of this machine by their number, and streams by their address; no files."""


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
    glance = Glance(_latest_camera(club, session, scene, feed.size), scene)
    folder = make_directory(club.folder_of(session) / "films")
    recorder = Recorder(feed=feed, motion=motion, folder=folder)
    with closing(feed):
        try:
            with closing(feed.frames()) as frames:
                for frame in frames:
                    if glance.wants(frame.t) and glance.add(frame.t, frame.picture()):
                        seen = b"" if glance.seen is None else encoded(glance.seen)
                        place = 1 + max((k.place for k in club.films(session)), default=-1)
                        about = {"live_rests": glance.rests, "live_film": place}
                        club.change("session", session.id, live=seen, **about)
                    keep(recorder.add(frame))
                    progress(f"watching the camera, {count} throws recorded", 0.0, 0.0)
        finally:
            keep(recorder.finish())


def _latest_camera(club: Club, session: Session, scene: Scene, size: tuple[int, int]) -> Camera:
    """The camera as it was solved for the latest film that was tracked, or as it was marked."""
    for film in reversed(club.films(session)):
        part = None if film.camera_id else load_part(part_path(club, session, film))
        if part is not None and part.camera is not None:
            solved = camera_from(part.camera).camera
            if solved.size == size:
                return solved
    return camera_from_scene(scene, size)
