"""Camera of 1080 lines and 50 frames a second that sends its film in real time.

Draws seen from behind the sheet are rendered and sent over the network in H.264, as a camera sends
them, and are recorded and tracked at the same time.
"""

from __future__ import annotations

import socket
import time
from collections.abc import Generator, Sequence
from fractions import Fraction
from itertools import count
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import av
from av.error import FFmpegError

from curling_env.ice import load_ice
from curling_env.infrastructure.files.writing import atomic_path, make_directory
from curling_env.infrastructure.workers import begin_worker
from curling_env.physics import slide
from curling_env.throw import Throw
from curling_env.trajectory import Trajectory
from friction_estimation.camera.scene import load_scene
from friction_estimation.live import Feed, LiveFrame, TrackedClip, follow_stream, open_feed
from friction_estimation.live.tuning import QUIET_SECONDS
from friction_estimation.synthetic import FilmSpec, render_films
from friction_estimation.tracking.tuning import COMPARED_AFTER

SPEC = FilmSpec(
    camera="end",
    size=(1920, 1080),
    fps=50.0,
    people=False,
    lead_in=2.0,
    tail=QUIET_SECONDS + COMPARED_AFTER + 1.0,
)
WEIGHTS = (2.15, 2.2, 2.18)
"""Speeds of the draws at the hog line [m/s]; no throw is in the picture for longer."""


def delays(folder: Path) -> tuple[list[float], int]:
    """Play draws in real time, and record and track them at the same time.

    Parameters
    ----------
    folder : folder of the rendered films

    Returns
    -------
    time from the end of each throw until its track was known [s], and number of lost frames
    """
    sent = folder / "sent.mp4"
    if not sent.exists():
        _code(render_films(folder, [draw(weight) for weight in WEIGHTS], SPEC), sent)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    camera = get_context("spawn").Process(target=_send, args=(sent, address))
    camera.start()
    feed = Timed(open_feed(f"{address}?listen=1"))
    scene = load_scene(folder / f"{SPEC.name}.scene.json")
    after: list[float] = []
    missing = 0
    for news in follow_stream(feed, scene, make_directory(folder / "kept"), report=folder):
        if isinstance(news, TrackedClip):
            after.append(feed.since - (news.clip.clock + news.clip.frames / SPEC.fps))
            missing += news.clip.missing
    camera.join()
    return after, missing


def draw(weight: float) -> Trajectory:
    """Return the path of a draw with a speed at the hog line [m/s]."""
    path = slide(
        load_ice("standard"), Throw(speed=weight, angle=-0.02, spin=1.5).release(), fps=100
    ).trajectory
    assert path is not None  # a rate was requested
    return path


def _code(films: Sequence[Path], sent: Path) -> None:
    """Encode one film of several draws, as cameras do."""
    with atomic_path(sent) as draft, av.open(str(draft), "w", format="mp4") as output:
        stream = output.add_stream("libx264", rate=round(SPEC.fps))
        stream.width, stream.height = SPEC.size or (0, 0)
        stream.options = {"preset": "veryfast", "crf": "20", "g": "50", "bf": "0"}
        number = count()
        for film in films:
            with av.open(str(film)) as source:
                for frame in source.decode(video=0):
                    frame.pts, frame.time_base = next(number), 1 / Fraction(SPEC.fps)
                    output.mux(stream.encode(frame))
        output.mux(stream.encode())


def _send(film: Path, address: str) -> None:
    """Send a film in real time to an address."""
    begin_worker()
    with av.open(str(film)) as source:
        video = source.streams.video[0]
        while True:
            output: Any = av.open(address, "w", format="mpegts", options={"flush_packets": "1"})
            stream = output.add_stream_from_template(video)
            try:
                output.start_encoding()  # connects
                break
            except FFmpegError:
                time.sleep(0.1)
        begun: float | None = None
        for packet in source.demux(video):
            if packet.dts is None:
                continue
            t = float(packet.dts * packet.time_base)
            begun = time.monotonic() - t if begun is None else begun
            time.sleep(max(0.0, begun + t - time.monotonic()))
            packet.stream = stream
            output.mux(packet)
        output.close()


class Timed:
    """Feed that notes the time of its first frame."""

    def __init__(self, feed: Feed) -> None:
        self._feed, self._begun = feed, time.monotonic()
        self.size, self.fps = feed.size, feed.fps
        self.add_to, self.close = feed.add_to, feed.close

    @property
    def since(self) -> float:
        """Return the time since the first frame [s]."""
        return time.monotonic() - self._begun

    def frames(self) -> Generator[LiveFrame]:
        """Yield the frames of the feed."""
        for number, moment in enumerate(self._feed.frames()):
            if number == 0:
                self._begun = time.monotonic() - moment.t
            yield moment
