"""The demo's page: one HTML file with its pictures inside, readable without the network."""

from __future__ import annotations

import base64
from html import escape
from pathlib import Path
from string import Template

from agents.closed_loop.demo_findings import Findings
from curling_env.storage import write_text

PAGE = Template("""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>From film to throw</title>
<style>
  :root { --ink: #1d2b3a; --soft: #55606b; --line: #d9e0e7; --deep: #123a63; --card: #f4f8fb; }
  body { margin: 0 auto; max-width: 1240px; padding: 1.2rem 1.4rem 3rem; color: var(--ink);
         font: 16px/1.5 system-ui, "Segoe UI", Helvetica, Arial, sans-serif; background: #fff; }
  h1 { font-size: 1.55rem; line-height: 1.25; margin: 0 0 .5rem; color: var(--deep); }
  h2 { font-size: 1.15rem; margin: 2.2rem 0 .4rem; color: var(--deep); }
  p { margin: .3rem 0 .8rem; max-width: 62rem; }
  .numbers { display: flex; flex-wrap: wrap; gap: .8rem; margin: .8rem 0 1rem; }
  .numbers div { flex: 1 1 12rem; background: var(--card); border: 1px solid var(--line);
                 border-radius: .5rem; padding: .5rem .9rem; }
  .numbers b { display: block; font-size: 1.55rem; line-height: 1.25; color: var(--deep); }
  .numbers span, figcaption, footer { color: var(--soft); font-size: .9rem; }
  figure { margin: .6rem 0; } img { max-width: 100%; height: auto; display: block; }
  .pair { display: grid; grid-template-columns: 1fr 1fr; gap: 1.2rem; }
  @media (max-width: 800px) { .pair { grid-template-columns: 1fr; } }
  ul { margin: .3rem 0 .8rem; padding-left: 1.3rem; }
  table { border-collapse: collapse; font-size: .95rem; } td, th { padding: .2rem 1rem .2rem 0;
          text-align: left; border-bottom: 1px solid var(--line); }
  td.n, th.n { text-align: right; }
  code { background: var(--card); padding: 0 .25rem; border-radius: .2rem; }
</style>
</head>
<body>
<h1>$headline</h1>
<div class="numbers">
  <div><b>$miss</b>
    <span>average miss of $draws draws, planned on the ice read from film</span></div>
  <div><b>$average_miss</b>
    <span>the same draws, planned on the ice&#8217;s average friction</span></div>
  <div><b>$track</b>
    <span>how closely the film followed the stone ($throws throws)</span></div>
  <div><b>$map_error</b>
    <span>error of the friction map; the ice itself varies by $average_error</span></div>
</div>
<figure><img src="$maps" alt="hidden ice, found ice and its uncertainty"></figure>
<h2>What the film says of the ice</h2>
<ul>$areas</ul>
<h2>The throws that test it</h2>
<p>$call</p>
<div class="pair">
  <figure><img src="$house" alt="where the tested draw came to rest"></figure>
  <figure><img src="$more" alt="more draws"></figure>
</div>
<h2>What the model did not know</h2>
<p>$missing Here nobody was told that stones curl: friction was estimated from the same tracks
without it, and <code>curling discover</code> was asked what this ice lacks. Its report:
<a href="discovery/report.html">discovery/report.html</a>.</p>
<figure><img src="$found_missing" alt="the draw before and after discovery" style="max-width:34rem">
</figure>
$film
<h2>How this came about</h2>
<p>The ice was made up with hidden heavy and keen areas, and $throws practice throws on it were
filmed by a virtual camera. From there on only the film was used: the stone was tracked in every
frame, and the friction of each cell of the ice was estimated from how the stones slowed. How
friction follows speed, and how a turning stone curls, was taken as known; where the ice is heavy
and keen was not. The draws were planned on the estimated ice, without execution error, and thrown
on the hidden one.</p>
<p>In this folder: $files. Try, in it,
<code>curling plan --ice ice.json --target 0,17.37</code>.</p>
<footer>$frames frames of $size, $seconds s in all. Every number on this page was computed in this
run; the same seed gives the same ice, throws and films.</footer>
</body>
</html>
""")


def write_page(
    found: Findings, directory: Path, *, film_still: Path | None, files: list[str]
) -> None:
    """Write `index.html` with the pictures that lie beside it.

    Parameters
    ----------
    found : to tell of
    directory : with maps.png, house.png, draws.png and missing.png
    film_still : a frame of the overlay film, if there is one
    files : names to mention, with what they are

    Raises
    ------
    OutputError : the page cannot be written
    """
    film = ""
    if film_still is not None:
        film = (
            "<h2>The film, and what was seen in it</h2>"
            f'<figure><img src="{_inline(film_still)}" alt="a frame of the film with the track">'
            "<figcaption>One frame of the film with the path that was tracked.</figcaption>"
            "</figure>"
        )
    areas = "".join(f"<li>{escape(text)}</li>" for text in found.area_sentences())
    text = PAGE.substitute(
        headline=escape(found.headline()),
        miss=f"{100 * found.mean_miss:.0f} cm",
        average_miss=f"{100 * found.mean_average_miss:.0f} cm",
        draws=len(found.draws),
        throws=len(found.tracks),
        track=f"{1000 * sorted(found.track_errors)[len(found.track_errors) // 2]:.0f} mm",
        map_error=f"{100 * found.map_error:.1f} %",
        average_error=f"{100 * found.average_error:.1f} %",
        maps=_inline(directory / "maps.png"),
        house=_inline(directory / "house.png"),
        more=_inline(directory / "draws.png"),
        areas=areas,
        call=escape(found.sentences()[-4] + " " + found.sentences()[-3]),
        missing=escape(found.missing.sentence()),
        found_missing=_inline(directory / "missing.png"),
        film=film,
        files=", ".join(f"<code>{escape(name)}</code>" for name in files),
        frames=f"{found.film_frames:,}".replace(",", " "),
        size=f"{found.film_size[0]} × {found.film_size[1]}",
        seconds=f"{found.seconds:.0f}",
    )
    write_text(directory / "index.html", text)


def _inline(picture: Path) -> str:
    return "data:image/png;base64," + base64.b64encode(picture.read_bytes()).decode()
