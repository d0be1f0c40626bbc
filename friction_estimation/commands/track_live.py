"""`curling track` on a camera that is filming now; see `track`."""

from __future__ import annotations

from pathlib import Path

from curling_env.cli import print_json, say
from curling_env.errors import TrackTooShortError
from curling_env.storage import make_directory
from curling_env.trajectory import Trajectory, write_tracks
from friction_estimation.inversion import estimate_ice
from friction_estimation.live import follow, frames_of
from friction_estimation.scene import Scene


def track_live(
    source: str, scene: Scene, output: Path, *, keep: Path | None, throws: int | None
) -> None:
    """Track throws as they are thrown, until the stream ends, enough are seen, or Ctrl-C.

    The tracks file is written anew after every throw, and what all throws so far say of the ice
    is told.
    """
    from tqdm import tqdm

    frames, fps = frames_of(source)
    folder = make_directory(output.with_suffix("") if keep is None else keep)
    tracks: list[Trajectory] = []
    say(f"watching {source}; films are kept in {folder}; Ctrl-C ends it")
    with tqdm(desc="recorded", unit="frame", leave=False, delay=0.5) as bar:
        try:
            for seen in follow(
                frames, fps, scene, folder, throws=throws, on_frame=lambda _: bar.update()
            ):
                if seen.track is None:
                    say(f"{seen.clip.path.name}: {seen.reason}")
                    continue
                tracks.append(seen.track)
                write_tracks(output, tracks)
                say(f"{seen.clip.path.name}: throw {seen.track.throw}, {_words(tracks)}")
        except KeyboardInterrupt:
            say(f"ended; {len(tracks)} throws")
    print_json(
        [
            {"throw": k.throw, "clock": k.clock, "tracked": len(k), "to_s": float(k.t[-1])}
            for k in tracks
        ]
    )


def _words(tracks: list[Trajectory]) -> str:
    """Where the last stone went, and what all of them say of the ice."""
    last = tracks[-1]
    ends = f"{len(last)} rows, last seen at x {last.xy[-1, 0]:+.2f}, y {last.xy[-1, 1]:+.2f} m"
    try:
        found = estimate_ice(tracks, uniform=True)
    except TrackTooShortError:
        return f"{ends}; too short to tell of the ice"
    low, high = found.interval
    return (
        f"{ends}; so far μ = {found.mu:.5f} ± {50 * (high - low) / found.mu:.2g} % "
        f"({len(found.slides)} throws)"
    )
