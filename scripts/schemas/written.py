"""Forms of the documents that the program writes for other programs, and does not read itself."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from curling_env.infrastructure.files.schema import Document

Metres = Annotated[float, Meta(description="m")]
Seconds = Annotated[float, Meta(description="s")]
Radians = Annotated[float, Meta(description="rad")]
Speed = Annotated[float, Meta(ge=0, description="m/s")]
Spin = Annotated[float, Meta(description="rad/s")]
Share = Annotated[float, Meta(ge=0, le=1)]
Pixels = Annotated[float, Meta(description="px")]
Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]
Place = Annotated[tuple[float, float], Meta(description="x, y in the sheet frame [m]")]
Provenance = Annotated[
    dict[str, Any], Meta(description="version, command, seed, and the inputs with their SHA-256")
]


# --- a discovery's report ------------------------------------------------------------------------


class Value(Document):
    """A parameter with its standard error."""

    value: float
    stderr: float
    unit: str


class Effect(Document):
    """Something that the model lacks."""

    name: str
    kind: Literal["physics", "measurement", "unknown"]
    parameters: dict[str, Value]
    depends_on: Annotated[
        list[str], Meta(max_length=3, description="variables that the unknown follows")
    ]
    where: Annotated[str, Meta(description="by what it shows, in plain words")]
    evidence: dict[str, Any]
    alternatives: Annotated[list[str], Meta(description="names that the data cannot rule out")]


class Change(Document):
    """A strength or shape of the given model that the throws correct."""

    name: str
    parameter: str
    given: float
    found: float
    stderr: float


class Gap(Document):
    """How far predicted paths are off the measured ones."""

    path_rms_m: float
    rest_error_m: float


class Gaps(Document):
    """The gap before and after, and what noise alone would leave."""

    before: Gap
    after: Gap
    noise_floor: Gap
    held_out_throws: list[int]
    closure: Annotated[float, Meta(description="share of the gap that the found effects close")]


class Baseline(Document):
    """The model that was given or assumed, fitted to the same throws."""

    mu: float
    mu_stderr: float
    mu_spread: Annotated[float, Meta(description="of ln μ between throws")]
    spin_coupling: float
    effects: list[str]
    slow_misfit: float


class Remaining(Document):
    """What is left over in the end."""

    slow_misfit: float
    white: bool
    mu_spread: float
    mu_follows: str
    mu_follows_p: float


class Noise(Document):
    """The noise of the positions."""

    position_m: float
    heading_rad: float
    memory_s: float


class Candidate(Document):
    """An effect of the catalogue that was weighed."""

    name: str
    gain: Annotated[float, Meta(description="of ln likelihood over the baseline")]
    needed: float | None
    closure: float | None


class Undecidable(Document):
    """What throws alone cannot show."""

    names: list[str]
    why: str


class Score(Document):
    """A model's expected log predictive density over left-out throws."""

    name: str
    elpd: float
    se: float
    difference: float
    difference_se: float


class Forecasts(Document):
    """Where each throw lay among its forecasts: uniform on 0 to 1 if they are honest."""

    throws: list[int]
    along: list[Share]
    across: list[Share]


class NextThrow(Document):
    """A throw worth making."""

    words: str
    weight: str
    hog_to_hog_s: float | None
    speed: Speed
    spin: Spin
    direction: Literal["home", "away"]
    x: Metres
    stone: int
    swept: bool
    teaches: Annotated[dict[str, float], Meta(description="share of a variance that it removes")]


class Report(Document):
    """What `curling discover` found: report.json."""

    format: str
    verdict: str
    effects: list[Effect]
    changes: list[Change]
    gap: Gaps
    baseline: Baseline
    remaining: Remaining
    noise: Noise
    candidates: list[Candidate]
    smallest_detectable: dict[str, dict[str, float]]
    undecidable: Undecidable
    left_out: Annotated[list[str], Meta(description="throws that could not be used, and why")]
    models: list[Score] | msgspec.UnsetType = msgspec.UNSET
    loo_pit: Forecasts | msgspec.UnsetType = msgspec.UNSET
    next_throws: list[NextThrow] | msgspec.UnsetType = msgspec.UNSET
    provenance: Provenance | msgspec.UnsetType = msgspec.UNSET


# --- an estimate ---------------------------------------------------------------------------------


class EstimatedThrow(Document):
    """One throw of an estimate."""

    throw: int
    released_at_s: Seconds
    seconds: Seconds
    rests: bool
    wild_rows: int
    speed: Speed | msgspec.UnsetType = msgspec.UNSET
    mu_factor: float | msgspec.UnsetType = msgspec.UNSET
    rms_m: Metres | msgspec.UnsetType = msgspec.UNSET


class TrackNoise(Document):
    """The noise of the tracks."""

    white: Metres
    slow: Metres
    slow_time_s: Seconds


class MapSummary(Document):
    """The friction map in a few numbers."""

    observed_cells: int
    cells: int
    mu_keenest: float
    mu_heaviest: float
    sigma_median: float
    resolution_m: float | msgspec.UnsetType | None = msgspec.UNSET
    spread: float | msgspec.UnsetType = msgspec.UNSET
    length_m: Metres | msgspec.UnsetType = msgspec.UNSET
    smoothness: float | Literal["gaussian"] | msgspec.UnsetType = msgspec.UNSET


class EstimatedEffect(Document):
    """An effect of the estimated ice."""

    name: str
    parameters: dict[str, float]
    sigma: dict[str, float | None]
    believed: list[str] | msgspec.UnsetType = msgspec.UNSET


class Estimate(Document, kw_only=True):
    """The numbers of the page of `curling estimate --report`: estimate.json."""

    format: str
    mu: float
    sigma: Annotated[float | None, Meta(description="null where rounding has lost it")]
    low: float | None
    high: float | None
    throws: int
    samples: int
    method: str
    scatter: float | msgspec.UnsetType = msgspec.UNSET
    noise_m: TrackNoise | msgspec.UnsetType = msgspec.UNSET
    map: MapSummary | msgspec.UnsetType = msgspec.UNSET
    camera_bias: dict[str, Any] | msgspec.UnsetType = msgspec.UNSET
    effects: list[EstimatedEffect] | msgspec.UnsetType = msgspec.UNSET
    each: list[EstimatedThrow]
    skipped: list[str] | msgspec.UnsetType = msgspec.UNSET
    provenance: Provenance | msgspec.UnsetType = msgspec.UNSET


# --- a rendered film -----------------------------------------------------------------------------


class FilmCamera(Document):
    """The camera of a rendered film."""

    size: tuple[int, int]
    position: Vector
    matrix: Matrix
    distortion: list[float]
    rotation: Annotated[Matrix, Meta(description="from the sheet frame to the camera's")]
    translation: Vector


class FilmStone(Document):
    """The stone's body as it was drawn."""

    radius: Metres
    height: Metres
    outline: list[list[float]]


class FilmThrow(Document):
    """A throw of a rendered film."""

    film: str
    throw: int
    released_at_s: Seconds
    rested_at_s: Seconds
    rest: Place


class Truth(msgspec.Struct, kw_only=True):
    """What a rendered film shows: NAME.truth.json; further notes may stand beside."""

    format: str
    fps: float
    exposure_s: Seconds
    noise: float
    people: bool
    seed: int
    camera: FilmCamera
    stone: FilmStone
    resting: list[Vector]
    throws: list[FilmThrow]


# --- the demo, and training ----------------------------------------------------------------------


class HiddenEffect(Document):
    """The effect that the demo leaves out of the model."""

    named: list[str]
    miss_before_m: Metres
    miss_after_m: Metres


class Area(Document):
    """An area of the ice that the demo found keen or heavy."""

    kind: str
    place: str
    found: float
    sigma: float
    true: float


class Findings(Document):
    """The numbers of `curling demo`: findings.json."""

    format: str
    throws: int
    film_frames: int
    track_rms_m: list[float]
    map_error: float
    average_error: float
    hidden_effect: HiddenEffect
    areas: list[Area]
    plan: Annotated[
        dict[str, Any], Meta(description="the throw at the button, as `curling plan` gives it")
    ]
    miss_on_estimated_ice_m: Metres
    miss_on_true_ice_m: Metres
    miss_planned_on_average_ice_m: Metres
    draws: int
    mean_miss_m: Metres
    mean_miss_planned_on_average_ice_m: Metres
    seconds: Seconds
    headline: str
    provenance: Provenance


class MissSummary(Document):
    """Misses of one thrower over all draws."""

    mean_miss_m: Metres
    median_miss_m: Metres
    mean_miss_with_error_m: Metres
    median_miss_with_error_m: Metres


class Ratio(Document):
    """A ratio of mean misses with its 95 % interval."""

    ratio: float
    low: float
    high: float


class Evaluation(Document):
    """How a trained agent draws beside the planner and the best possible throw: evaluation.json."""

    format: str
    draws: int
    skill: str
    agent: MissSummary
    planner: MissSummary
    best: MissSummary
    agent_over_best: Ratio
    planner_over_best: Ratio


# --- a solved camera -----------------------------------------------------------------------------


class SolvedCamera(msgspec.Struct, kw_only=True):
    """The camera of a scene as its films have it: NAME.solved.json. Not meant to be edited."""

    format: str
    scene: Annotated[str, Meta(pattern="^[0-9a-f]{64}$", description="digest of the scene")]
    image_size: tuple[int, int]
    camera_matrix: Matrix
    distortion: list[float]
    rotation: Annotated[Matrix, Meta(description="from the sheet frame to the camera's")]
    translation: Vector
    measured: Annotated[int, Meta(ge=0, description="points of paint")]
    rms_px: Pixels
    before_px: Pixels
    misfit: float
    covariance: Annotated[list[list[float]], Meta(description="of the free parameters")]
    lens: Annotated[dict[str, bool], Meta(description="which parts were fitted")]
    farther: Annotated[dict[str, Any], Meta(description="the second of two solutions")] | None = (
        None
    )
