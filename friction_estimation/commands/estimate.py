"""`curling estimate`: the friction of the ice from tracks or films."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from typer import Argument, Option

from curling_env.commands.options import OUTPUT, Measured, SeedOption, grouped, option, output_to
from curling_env.commands.outputs import Writes
from curling_env.commands.terminal import print_remark, progress_bar
from curling_env.errors import InputError
from friction_estimation.commands.film_options import SCENE, Tracking

if TYPE_CHECKING:
    from curling_env.trajectory import Trajectory
    from friction_estimation.estimation.evidence_file import Choices
    from friction_estimation.reports.estimate_page import Still

Effects = Literal["all", "none"]
Bias = Literal["auto", "off"]
Method = Literal["trajectory", "paper"]
FILMS_SHOWN = 4
"""Number of films with frames in the report; each adds about a megabyte."""


@dataclass(frozen=True, kw_only=True)
class Model:
    """Model"""

    uniform: bool = option(False, "Estimate one friction for the sheet, not a map.", "--uniform")
    effects: Effects = option("all", "all: map and effects of the ice; none: friction alone.")
    camera_bias: Bias = option(
        "auto", "auto: also fit a smooth camera error, if it is significant."
    )
    method: Method = option("trajectory", "paper: differentiate the tracks, as in the paper.")
    start: str | None = option(None, "Ice with the expected effects.", metavar="ICE")
    prior: str | None = option(None, "Ice of another day, as a prior for the map.", metavar="ICE")
    update: Path | None = option(None, "Ice to which these throws are added.", metavar="ICE")

    def choices(self) -> tuple[Choices, list[Trajectory]]:
        """Load the choices of the estimate, and the throws of the estimate that it updates.

        Raises
        ------
        InputError : options that exclude each other, or differ from those of the first estimate
        """
        from curling_env.ice import load_ice
        from friction_estimation.estimation.evidence_file import Choices, load_evidence

        if sum(name is not None for name in (self.start, self.prior, self.update)) > 1:
            raise InputError("expected at most one of --start, --prior and --update")
        if self.method == "paper" and (self.prior is not None or self.update is not None):
            raise InputError("the paper's method supports neither --prior nor --update")
        asked = Choices(
            effects=self.effects,
            uniform=self.uniform,
            camera_bias=self.camera_bias,
            start=None if self.start is None else load_ice(self.start),
            prior=None if self.prior is None else load_ice(self.prior),
        )
        if self.update is None:
            return asked, []
        evidence = load_evidence(load_ice(self.update), self.update)
        evidence.check(asked, self.update)
        return evidence.choices, evidence.tracks


@grouped
def estimate(
    inputs: Annotated[
        list[Path], Argument(metavar="TRACKS.csv|VIDEO...", help="Tracks, or films.")
    ],
    output: Annotated[
        Path,
        output_to("ICE.json", "The ice file to write."),
        Writes(kinds=("ice",), rewrites=("update",), beside=(".evidence.npz",)),
    ],
    *,
    model: Model,
    scene: Annotated[list[Path] | None, SCENE] = None,
    tracking: Tracking,
    report: Annotated[
        Path | None,
        Option(metavar="DIR", help="Also write a page and tables.", rich_help_panel=OUTPUT),
        Writes(folder=True),
    ] = None,
    results: Measured,
    seed: SeedOption = 0,
) -> None:
    """Estimate the ice from throws: friction cell by cell, curl and other effects.

    \b
    Examples:
        curling estimate tracks.csv -o ice.json --report runs/report
        curling estimate tracks.csv -o ice.json --uniform
        curling estimate later.csv --update ice.json -o ice.json
        curling estimate end-0.mp4 end-1.mp4 --scene end.scene.json -o ice.json

    Throws at several speeds, in both directions and on several lines measure the most (`curling
    design`). Only the free slide of each throw is used. The JSON has the level mu of the friction
    (at 1 m/s) with its 95 % interval. See docs/science/estimation.md.
    """
    from curling_env.ice import save_ice
    from curling_env.infrastructure.files.writing import make_directory, together
    from curling_env.infrastructure.provenance import provenance
    from friction_estimation.discovery.posterior_file import write_posterior_of
    from friction_estimation.estimation.evidence_file import (
        evidence_path,
        save_evidence,
        with_later_throws,
    )
    from friction_estimation.estimation.paper_method import estimate_by_paper
    from friction_estimation.estimation.whole_ice import estimate_ice
    from friction_estimation.reports.estimate_page import headline, write_report
    from friction_estimation.tracking.films.resume import Checkpoints
    from friction_estimation.tracks.plausible_friction import friction_question
    from friction_estimation.tracks.throw_list import NO_NOTES, load_tracks, throws_beside

    choices, earlier = model.choices()
    stills: list[Still] = []
    notes = NO_NOTES
    if is_table := any(path.suffix.lower() == ".csv" for path in inputs):
        if len(inputs) > 1:
            problem = "expected one tracks file, or films"
            raise InputError(problem, source=inputs[1])
        for name in ("camera", "height", "slow"):
            if getattr(tracking, name):
                raise InputError("applies to films, not to tracks", source=f"--{name}")
        if scene:
            raise InputError("applies to films, not to tracks", source="--scene")
        tracks, notes = load_tracks(inputs[0]), throws_beside(inputs[0])
        if report is not None and any(track.by_gates for track in tracks):
            problem = "draws paths, which light gates do not measure"
            raise InputError(problem, source="--report")
        if model.method == "paper" and any(track.by_gates for track in tracks):
            problem = "the paper's method differentiates paths, which light gates do not measure"
            raise InputError(problem, source="--method")
    else:
        shown = 0 if report is None else FILMS_SHOWN
        tracks, stills = _track(inputs, scene, tracking, output, shown)
    models = (tracking.camera, model.start, model.prior, model.update)
    before = None if model.update is None else evidence_path(model.update)
    origin = provenance([*inputs, *(scene or []), *models, before], seed=seed)
    if earlier:
        tracks, remarks = with_later_throws(earlier, tracks)
        for remark in remarks:
            print_remark(remark)
    with progress_bar() as bar:
        if model.method == "paper":
            found = estimate_by_paper(tracks, start=choices.start, uniform=model.uniform)
        else:
            found = estimate_ice(tracks, **vars(choices), seed=seed, progress=bar)
    with together():
        save_ice(found.ice, output, provenance=origin)
        if model.method != "paper":
            save_evidence(tracks, choices, found.ice, output)
        if report is not None:
            folder = make_directory(report)
            if found.discovery is not None:
                path = folder / "posterior.nc"
                write_posterior_of(found.discovery.final, path, seed=seed, provenance=origin)
            names = write_report(
                found, folder, stills, provenance=origin, units=results.units, notes=notes
            )
            print_remark(f"{report}: {', '.join(names)}")
    if not is_table:
        Checkpoints(output).delete()
    bias, question = found.camera_bias, friction_question(found.mu)
    remarks = [bias.words] if bias is not None and bias.found else []
    remarks += [*found.remarks, *(f"dropped: {reason}" for reason in found.skipped)]
    for remark in [*remarks, *([] if question is None else [question])]:
        print_remark(remark)
    numbers = {
        **found.summary(),
        **({"throws_before": len(earlier)} if earlier else {}),
        **({} if question is None else {"question": question}),
    }
    results.show(numbers, headline(found))


def _track(
    films: list[Path], scene: list[Path] | None, tracking: Tracking, output: Path, shown: int
) -> tuple[list[Trajectory], list[Still]]:
    """Track films, and draw frames of the first ones for the report.

    Raises
    ------
    InputError : no scene, or a film that cannot be tracked
    """
    from curling_env.infrastructure.files.writing import together
    from friction_estimation.reports.estimate_page import Still
    from friction_estimation.tracking.overlay.film import draw_stills

    if not scene:
        problem = (
            "a film needs the scene of its camera: give --scene SCENE.json (a tracks file ends in "
            ".csv)"
        )
        raise InputError(problem, source=films[0])
    scenes = tracking.scenes(scene)
    tracks: list[Trajectory] = []
    stills: list[Still] = []
    with together(), progress_bar("frame") as bar:
        tracked = tracking.throws_in(films, scenes, output, always_track=shown, progress=bar)
        for i, one in enumerate(tracked):
            tracks += one.tracks
            if i < shown and one.found is not None:
                frames = draw_stills(one.shown or one.film, one.scene or scenes[0], one.found)
                stills += [Still.of(one.film.name, t, image) for t, image in frames]
    return tracks, stills
