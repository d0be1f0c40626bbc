"""`curling track` on a camera that is filming now; see `track`."""

from __future__ import annotations

from pathlib import Path

from curling_env.commands.cli import print_json, say
from curling_env.storage import make_directory
from curling_env.trajectory import Trajectory, write_tracks
from friction_estimation.camera.scene import Scene
from friction_estimation.live import Seen, follow, open_feed


def track_live(
    source: str,
    scene: Scene,
    output: Path,
    *,
    keep: Path | None,
    throws: int | None,
    report: Path | None,
) -> None:
    """Track throws as they are thrown, until the stream ends, enough are seen, or Ctrl-C.

    The tracks file is written anew after every throw, and what all throws so far say of the ice
    is told, and shown on a page if one is wanted.
    """
    from tqdm import tqdm

    feed = open_feed(source)
    folder = make_directory(output.with_suffix("") if keep is None else keep)
    page = None if report is None else make_directory(report)
    tracks: list[Trajectory] = []
    thrown: list[Trajectory] = []
    say(f"watching {source}; films are kept in {folder}; Ctrl-C ends it")
    if page is not None:
        say(f"from the first throw on, {page / 'report.html'} shows the ice so far")
    with tqdm(desc="recorded", unit="frame", leave=False, delay=0.5) as bar:

        def count(waiting: int) -> None:
            bar.set_postfix_str(f"{waiting} to track" if waiting else "", refresh=False)
            bar.update()

        for news in follow(feed, scene, folder, throws=throws, report=page, on_frame=count):
            if not isinstance(news, Seen):
                say(f"the ice so far: {news.words}")
                continue
            if news.clip.missing:
                say(f"{news.clip.path.name}: {news.clip.missing} of its frames never came")
            if not news.tracks:
                say(f"{news.clip.path.name}: {news.reason}")
                continue
            tracks += news.tracks
            thrown.append(news.tracks[0])
            write_tracks(output, tracks)
            say(f"{news.clip.path.name}: {_words(news.tracks)}")
    say(f"{source} is no longer watched; {len(thrown)} throws")
    print_json(
        [
            {"throw": k.throw, "clock": k.clock, "tracked": len(k), "to_s": float(k.t[-1])}
            for k in thrown
        ]
    )


def _words(tracks: tuple[Trajectory, ...]) -> str:
    """Which throw it was, where its stone went, and how many others were seen."""
    stone, *others = tracks
    x, y = stone.xy[-1]
    also = f", and {len(others)} other stones" if others else ""
    return f"throw {stone.throw}, {len(stone)} rows, last seen at x {x:+.2f}, y {y:+.2f} m{also}"
