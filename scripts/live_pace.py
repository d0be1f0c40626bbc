"""Does live tracking keep up with a camera of 1080 lines and 50 frames a second?

Draws seen from behind the sheet are rendered and then sent over the network at their own pace, in
H.264, as a camera sends them. They are recorded and tracked meanwhile. The script prints how long
after the end of a throw its track and the ice were known, how far off the track is, and how far the
recording lagged behind the camera.

python scripts/live_pace.py
"""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import count
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated, Any

import av
import numpy as np
import typer
from av.error import FFmpegError

from curling_env.ice import load_ice
from curling_env.infrastructure.files.storage import atomic_path, make_directory
from curling_env.infrastructure.workers import begin_worker
from curling_env.physics import slide
from curling_env.throw import Throw
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from friction_estimation.camera.scene import load_scene
from friction_estimation.live import Feed, LiveFrame, TrackedClip, follow_stream, open_feed
from friction_estimation.live.tuning import QUIET_SECONDS
from friction_estimation.synthetic import FilmSpec, on_film, render_films
from friction_estimation.tracking.cutting.tuning import COMPARED_AFTER

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


@dataclass(frozen=True, kw_only=True)
class Pace:
    """Delays of live tracking.

    Parameters
    ----------
    after : from the end of each throw until its track was known [s]
    missing : number of frames that were lost
    off : root mean square errors of the tracks [m]
    untracked : number of throws that were not tracked
    frame_seconds : processor time for a frame, tracking included [s]
    lags : of the recording behind the camera, for each frame [s]
    """

    after: tuple[float, ...]
    missing: int
    off: tuple[float, ...]
    untracked: int
    frame_seconds: float
    lags: Floats


def played(folder: Path, tell: Callable[[str], object]) -> Pace:
    """Play draws at the pace of a camera, and record and track them meanwhile.

    Parameters
    ----------
    folder : keeps what was rendered
    tell : called with a line of news
    """
    thrown = [_draw(weight) for weight in WEIGHTS]
    sent = folder / "sent.mp4"
    if not sent.exists():
        _code(render_films(folder, thrown, SPEC), sent)
    truths = [on_film(path, SPEC) for path in thrown]

    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    camera = get_context("spawn").Process(target=_send, args=(sent, address))
    camera.start()
    feed = Timed(open_feed(f"{address}?listen=1"))
    scene = load_scene(folder / f"{SPEC.name}.scene.json")
    after: list[float] = []
    off: list[float] = []
    missing = untracked = 0
    used = time.process_time()
    for news in follow_stream(feed, scene, make_directory(folder / "kept"), report=folder):
        now = feed.since
        if not isinstance(news, TrackedClip):
            tell(f"{now:6.1f} s  {news.words}")
            continue
        after.append(now - (news.clip.clock + news.clip.frames / SPEC.fps))
        missing += news.clip.missing
        words = news.reason
        if news.tracks:
            off.append(_off(news, truths))
            words = f"{len(news.tracks[0])} rows, {1000 * off[-1]:.1f} mm off"
        else:
            untracked += 1
        tell(
            f"{now:6.1f} s  {news.clip.path.name}, {after[-1]:.1f} s after its end, "
            f"{news.clip.missing} frames missing: {words}"
        )
    used = time.process_time() - used
    camera.join()
    lags: Floats = np.array(feed.lags) - min(feed.lags)
    return Pace(
        after=tuple(after),
        missing=missing,
        off=tuple(off),
        untracked=untracked,
        frame_seconds=used / len(lags),
        lags=lags,
    )


def main(
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="DIR", help="Keeps what was rendered.")
    ] = Path("runs/live_pace"),
) -> None:
    """Play draws at the pace of a camera and see whether they are tracked as they come."""
    pace = played(make_directory(output), print)
    lags = 1000 * pace.lags
    print(
        f"{len(lags)} frames; recording took {1000 * pace.frame_seconds:.1f} ms of a core a frame; "
        f"behind the camera by {np.median(lags):.0f} ms in the middle, by {lags.max():.0f} ms at "
        "most"
    )


def _draw(weight: float) -> Trajectory:
    path = slide(
        load_ice("standard"), Throw(speed=weight, angle=-0.02, spin=1.5).release(), fps=100
    ).trajectory
    assert path is not None  # a rate was given
    return path


def _off(seen: TrackedClip, truths: Sequence[Trajectory]) -> float:
    """Root mean square error of a track from one second after the release on [m]."""
    track = seen.tracks[0]
    before = sum(len(truth) for truth in truths[: track.throw]) / SPEC.fps
    truth, t = truths[track.throw], track.t + seen.clip.clock - before
    late = t > SPEC.lead_in + 1
    there = np.column_stack([np.interp(t, truth.t, truth.xy[:, k]) for k in (0, 1)])
    miss = np.linalg.norm(track.xy - there, axis=1)[late]
    return float(np.sqrt(np.mean(miss**2)))


def _code(films: Sequence[Path], sent: Path) -> None:
    """One film of several, coded as cameras do."""
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
    """Send a film at its own pace to who listens there."""
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
    """A feed that notes how late each of its frames is taken."""

    def __init__(self, feed: Feed) -> None:
        self._feed = feed
        self.size, self.fps = feed.size, feed.fps
        self.add_to, self.close = feed.add_to, feed.close
        self.lags: list[float] = []
        self._begun = time.monotonic()

    @property
    def since(self) -> float:
        """Time since the first frame [s]."""
        return time.monotonic() - self._begun

    def frames(self) -> Generator[LiveFrame]:
        for moment in self._feed.frames():
            if not self.lags:
                self._begun = time.monotonic() - moment.t
            self.lags.append(self.since - moment.t)
            yield moment


if __name__ == "__main__":
    typer.run(main)
