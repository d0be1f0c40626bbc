"""The demo's page: one HTML file with its pictures inside, readable without the network."""

from __future__ import annotations

from html import escape
from pathlib import Path

from agents.closed_loop.demo_findings import Findings
from friction_estimation.reports.html import facts, picture, write_page


def write_demo_page(found: Findings, directory: Path, *, film_still: Path | None) -> None:
    """Write `index.html`, with the pictures that lie beside it.

    Parameters
    ----------
    found : the results to show
    directory : folder that holds maps.png, house.png, draws.png and missing.png
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
                found.told(found.mean_miss),
                f"average miss of {draws} draws, planned on the ice read from film",
            ),
            (
                found.told(found.mean_other_miss),
                "the same draws, planned on the ice’s average friction",
            ),
            (
                found.told(float(median_error)),
                f"how closely the film followed the stone ({throws} throws)",
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
        f"<h2>What the film says of the ice</h2><ul>{areas}</ul>"
        + image("maps.png", "hidden ice, found ice and its uncertainty"),
        "<h2>The throws that test it</h2>"
        f"<p>{escape(' '.join(found.draw_sentences()))}</p><div class=side>"
        + image("house.png", "where the tested draw came to rest")
        + image("draws.png", "more draws")
        + "</div>",
        "<h2>What the model did not know</h2><div class=side><div style='flex:1 1 20rem'>"
        f"<p>{escape(found.missing_sentence())}</p><p>Here the model was not told that stones "
        "curl: friction was estimated from the same tracks without it, and <code>curling "
        "discover</code> was asked what this ice lacks. Its report: <a "
        "href='discovery/report.html'>discovery/report.html</a>.</p></div>"
        + image("missing.png", "the draw before and after discovery")
        + "</div>",
    ]
    if film_still is not None:
        sections.append(
            "<h2>The film, and what was seen in it</h2>"
            + picture(
                film_still.read_bytes(),
                "a frame of the film with the track",
                caption="One frame of the film with the path that was tracked.",
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
        "practice throws on it were filmed by a virtual camera. From there on only the film was "
        "used: the stone was tracked in every frame, and the friction of each cell of the ice was "
        "estimated from how the stones slowed and curled, beginning with what is believed of every "
        "ice. Only the average friction, beside it, was told how friction follows the speed and "
        "how stones curl. The draws were planned on the estimated ice, without execution error, "
        "and thrown on the hidden one.</p>"
        f"<p>In this folder: {files}. Try, in it, "
        "<code>curling plan --ice ice.json --target 0,17.37</code>.</p>"
        f"<p class=faint>{frames} frames of {width} × {height}, {found.seconds:.0f} s in all. "
        "Every number on this page was computed in this run; the same seed gives the same ice, "
        "throws and films.</p>"
    )
