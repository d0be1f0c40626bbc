"""Page of the demo: one HTML file with its pictures inside, readable without the network."""

from __future__ import annotations

from html import escape
from pathlib import Path

from agents.closed_loop.demo_findings import Findings
from friction_estimation.reports.html import facts, picture, write_page


def write_demo_page(found: Findings, directory: Path, *, film_still: Path | None) -> None:
    """Write `index.html`, with the pictures of its folder.

    Parameters
    ----------
    found : the results to show
    directory : folder with maps.png, house.png, draws.png and missing.png
    film_still : a frame of the overlay film, if there is one

    Raises
    ------
    OutputError : the page cannot be written
    """

    def image(name: str, alt: str, caption: str = "") -> str:
        return picture((directory / name).read_bytes(), alt, caption=caption)

    throws, draws = len(found.tracks), len(found.draws)
    median_error = sorted(found.track_errors)[len(found.track_errors) // 2]
    numbers = facts(
        [
            (
                found.in_units(found.mean_miss),
                f"average miss of {draws} draws, planned on the estimated ice",
            ),
            (
                found.in_units(found.mean_other_miss),
                "the same draws, planned on the ice’s average friction",
            ),
            (
                found.in_units(float(median_error)),
                f"accuracy of tracking the stone ({throws} throws)",
            ),
            (
                f"{100 * found.map_error(found.estimated_ice):.1f} %",
                "error of the friction map; the ice itself varies by "
                f"{100 * found.map_error(found.average_ice):.1f} %",
            ),
        ]
    )
    areas = "".join(f"<li>{escape(text)}</li>" for text in found.area_sentences())
    sections = [
        f"<h1>{escape(found.headline())}</h1>{numbers}",
        f"<h2>The estimated ice</h2><ul>{areas}</ul>"
        + image("maps.png", "hidden ice, estimated ice and its uncertainty"),
        "<h2>Test throws</h2>"
        f"<p>{escape(' '.join(found.draw_sentences()))}</p><div class=side>"
        + image("house.png", "final places of the test draw")
        + image("draws.png", "more draws")
        + "</div>",
        "<h2>The effect that the model lacked</h2><div class=side><div style='flex:1 1 20rem'>"
        f"<p>{escape(found.missing_sentence())}</p><p>Here the model had no curl: friction was "
        "estimated from the same tracks without it, and <code>curling discover</code> had to find "
        "the missing effect. Its report: <a "
        "href='discovery/report.html'>discovery/report.html</a>.</p></div>"
        + image("missing.png", "the draw before and after discovery")
        + "</div>",
    ]
    if film_still is not None:
        sections.append(
            "<h2>The film and the track</h2>"
            + picture(
                film_still.read_bytes(),
                "a frame of the film with the track",
                caption="One frame of the film with the tracked path.",
            )
        )
    sections.append(_how_it_was_made(found))
    write_page(directory / "index.html", "From film to throw", sections)


def _how_it_was_made(found: Findings) -> str:
    names = ("films/", "overlay.mp4", "tracks.csv", "ice.json", "true-ice.json", "page.png")
    files = ", ".join(f"<code>{name}</code>" for name in (*names, "discovery/report.html"))
    frames = f"{found.film_frames:,}".replace(",", " ")
    width, height = found.film_size
    return (
        "<h2>How these results were made</h2>"
        f"<p>The ice was made up with hidden heavy and keen areas, and {len(found.tracks)} "
        "practice throws on it were filmed by a virtual camera. From then on only the film was "
        "used: the stone was tracked in every frame, and the friction of each cell of the ice was "
        "estimated from the deceleration and curl of the stones, starting from the assumptions "
        "for every ice. Only the average friction for comparison got the true law of friction and "
        "curl. The draws were planned on the estimated ice, without execution error, "
        "and thrown on the hidden one.</p>"
        f"<p>In this folder: {files}. Try there: "
        "<code>curling plan --ice ice.json --target 0,17.37</code>.</p>"
        f"<p class=faint>{frames} frames of {width} × {height}, {found.seconds:.0f} s in all. "
        "Every number on this page was computed in this run; the same seed gives the same ice, "
        "throws and films.</p>"
    )
