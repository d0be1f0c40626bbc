"""Learning a stone's look from a film: the profile that no scene file gives, colours, blur.

The film itself tells: over a throw the camera sees the stone from many distances and sides, and
only the right profile leaves no residual in all of them. Places are projected out, so that an error
of the profile cannot hide in them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from friction_estimation.camera import Camera
from friction_estimation.stone_fit import (
    MARGIN_PX,
    OUTLIER_AT,
    PIXEL_CORRELATION,
    Appearance,
    channels_of,
    fit_stone,
)
from friction_estimation.stone_kernels import coverage, normal_equations
from friction_estimation.stone_model import (
    PARTS,
    SHAPE_PARAMETERS,
    StoneModel,
    Window,
    window_at,
)

Floats = NDArray[np.float64]

SHAPE_SPREAD = {
    "radius": 1e-5,
    "height": 1e-5,
    "foot_inset": 0.03,
    "foot_height": 0.015,
    "bevel_height": 0.015,
    "bevel_inset": 0.02,
    "handle_rise": 0.015,
    "handle_back": 0.015,
    "handle_front": 0.015,
    "handle_width": 0.006,
    "blur_px": 0.4,
    "colour_blur_px": 0.6,
    "shadow_x": 0.05,
    "shadow_y": 0.05,
    "shadow_radius": 0.02,
    "shadow_blur": 0.02,
    "shadow": 0.15,
    "handle_depth": 0.01,
    "roundness": 0.5,
    "contact": 0.2,
    "contact_reach": 0.02,
    "mirror": 0.4,
    "collar_radius": 0.025,
    "collar_rise": 0.006,
    "foot_roundness": 0.7,
    "neck_length": 0.015,
}
"""How far stones and cameras differ from the starting values; radius and height are the scene's.

A stone stands on its running band, so its foot is never much wider or narrower than that."""
SHAPE_BOUNDS = {
    "foot_inset": (-0.005, 0.12),
    "foot_height": (0.002, 0.06),
    "bevel_height": (0.001, 0.06),
    "bevel_inset": (0.0, 0.09),
    "handle_rise": (0.0, 0.09),
    "handle_back": (-0.13, 0.05),
    "handle_front": (0.05, 0.15),
    "handle_width": (0.008, 0.05),
    "blur_px": (0.3, 4.0),
    "colour_blur_px": (0.3, 5.0),
    "shadow_radius": (0.05, 0.3),
    "shadow_blur": (0.001, 0.1),
    "shadow": (0.0, 0.9),
    "handle_depth": (0.001, 0.08),
    "roundness": (1.0, 3.0),
    "contact": (0.0, 0.9),
    "contact_reach": (0.01, 0.12),
    "mirror": (0.0, 1.5),
    "collar_radius": (0.0, 0.1),
    "collar_rise": (0.0, 0.03),
    "foot_roundness": (1.0, 4.0),
    "neck_length": (0.0, 0.06),
}
MIN_NOISE = 1.0
"""Residuals are never trusted better than one grey level: that is how films are stored."""
STONE_SHARE = 0.05
"""Pixels of which the stone covers less than this count as ice."""
FOOT_BRIGHTNESS = 1.1
"""The foot overhangs: lit by the ice alone it is at most about as bright as the side."""
HEADINGS_TRIED = 36
SPINS_TRIED = np.linspace(-4.0, 4.0, 33)
"""Rates of turning [rad/s]; a stone thrown to stay in play hardly turns faster."""
SPIN_CHANGE = 0.05
"""The change of spin [rad/s] that costs as much as one standard error of one exposure."""
GRANITE = (
    ("foot", "side", (30.0, 4.0, 4.0)),
    ("bevel", "side", (30.0, 4.0, 4.0)),
    ("top", "side", (30.0, 4.0, 4.0)),
)
"""How far one part of the body differs from another [grey]: it is one stone in different light."""
FOOT_BRIGHTNESS = 1.1
"""The foot overhangs: lit by the ice alone it is at most about as bright as the side."""
HEADINGS_TRIED = 36
SPINS_TRIED = np.linspace(-4.0, 4.0, 33)
"""Rates of turning [rad/s]; a stone thrown to stay in play hardly turns faster."""
SPIN_CHANGE = 0.05
"""The change of spin [rad/s] that costs as much as one standard error of one exposure."""
GRANITE_SPREAD = np.array([30.0, 4.0, 4.0])
"""How far parts of the body differ from its side: light falls on them from elsewhere [grey]."""
SHADOW_TRIED = 0.1
REFINEMENTS = (8, 8, 8)
"""Rounds of adjustment between which noise and headings are found anew."""
EXPOSURES = 20
"""Frames that the look is learnt from; more only cost time."""
COLOUR_DISTRUST = 5.0
"""Colour is stored at half resolution and shifted by the codec: it may find a handle, not move a
stone."""
HANDLE_RISES = (0.03, 0.045, 0.06)
"""Heights above the top at which a handle is looked for [m]."""
HANDLE_COLLARS = (0.0, 0.04)
"""Radii of its round base with which it is looked for, on no post and on a short one [m]."""
HANDLE_CONTRAST = 10.0
"""How far, in grey levels, a handle's colour must lie from the rest of the stone."""


@dataclass(eq=False)
class Exposure:
    """One frame's pixels around the stone, with the current estimate of its place."""

    window: Window
    picture: Floats
    behind: Floats
    pose: Floats
    t: float


def exposures_at(
    frames: Sequence[NDArray[np.uint8]],
    moments: Sequence[float],
    places: Sequence[Floats],
    background: Floats,
    background_origin: tuple[int, int],
    camera: Camera,
    model: StoneModel,
) -> list[Exposure]:
    """Cut the stone out of the frames in which all of it is in the image."""
    found: list[Exposure] = []
    u, v = background_origin
    for frame, t, xy in zip(frames, moments, places, strict=True):
        outline = model.outline_px(camera, xy)
        # The handle stands out above the body and the place is still rough: look a little wider.
        size = 0.35 * float(np.ptp(outline, axis=0).max()) if len(outline) else 0.0
        window = window_at(camera, outline, MARGIN_PX + size)
        if window is None:
            continue
        if not (
            (outline > 1).all()
            and (outline < np.array(camera.size) - 2).all()
            and u <= window.origin_px[0]
            and v <= window.origin_px[1]
            and window.origin_px[0] + window.shape[1] <= u + background.shape[1]
            and window.origin_px[1] + window.shape[0] <= v + background.shape[0]
        ):
            continue
        rows, columns = window.slices
        behind = background[
            rows.start - v : rows.stop - v, columns.start - u : columns.stop - u
        ].reshape(-1, 3)
        found.append(
            Exposure(
                window=window,
                picture=channels_of(frame[rows, columns]).reshape(-1, 3),
                behind=np.ascontiguousarray(behind),
                pose=np.array([xy[0], xy[1], 0.0]),
                t=t,
            )
        )
    return found


def learn_appearance(exposures: Sequence[Exposure], model: StoneModel, noise: float) -> Appearance:
    """Colours, handle, profile and blur that explain all exposures together.

    Parameters
    ----------
    exposures : of one stone; their poses are refined in place
    model : with the scene's radius and height, and typical values for the rest
    noise : of a pixel, standard deviation in grey levels
    """
    sigma = np.maximum([3 * noise, 2 * noise, 2 * noise], MIN_NOISE)
    exposures = exposures[:: max(1, len(exposures) // EXPOSURES)]
    body = _body_colour(exposures, model)
    look = Appearance(
        model=model, colours=np.tile(body, (len(PARTS), 1)), noise=4 * sigma, has_handle=False
    )
    for exposure in exposures:
        _settle(exposure, look)
    look = replace(look, colours=_colours(exposures, look))
    for exposure in exposures:
        _settle(exposure, look)
    look = _with_handle(exposures, look)
    for exposure in exposures:
        _keep_near(exposure, look)
    look = _with_shadow(exposures, look)
    for rounds in REFINEMENTS:
        look = _refine(exposures, look, model, rounds)
        look = replace(look, noise=_residual_noise(exposures, look))
        if look.has_handle:
            _turn_together(exposures, look)
            for exposure in exposures:
                _settle(exposure, look)
    return look


def _settle(exposure: Exposure, look: Appearance) -> float:
    pose, _, misfit, visible = fit_stone(
        exposure.picture, exposure.behind, exposure.window, look, exposure.pose
    )
    if np.linalg.norm(pose[:2] - exposure.pose[:2]) < 0.5:
        exposure.pose = pose
    return misfit / max(visible, 1e-3)


def _keep_near(exposure: Exposure, look: Appearance) -> None:
    """Drop the pixels that neither stone nor shadow can reach, now that the place is known."""
    reach = replace(
        look.model,
        blur_px=MARGIN_PX / 3,
        shadow_radius=1.3 * look.model.radius,
        shadow=1.0,
        mirror=1.0,
    )
    near = _cover(exposure, replace(look, model=reach))[0].sum(axis=1) > 0
    window = exposure.window
    exposure.window = replace(
        window,
        foot=np.ascontiguousarray(window.foot[near]),
        lean=np.ascontiguousarray(window.lean[near]),
    )
    exposure.picture = np.ascontiguousarray(exposure.picture[near])
    exposure.behind = np.ascontiguousarray(exposure.behind[near])


def _cover(exposure: Exposure, look: Appearance, pose: Floats | None = None) -> Floats:
    pose = exposure.pose if pose is None else pose
    window = exposure.window
    out = np.empty((2, len(exposure.picture), len(PARTS) + 1))
    coverage(
        pose[0],
        pose[1],
        pose[2],
        look.model.shape(),
        window.foot,
        window.lean,
        window.scale,
        look.has_handle,
        out,
    )
    return out


def _rendered(cover: Floats, behind: Floats, colours: Floats) -> Floats:
    per_channel = cover[[0, 1, 1]]  # brightness is sharp, both colour differences are not
    parts = per_channel[:, :, :-1]
    ice = behind.copy()
    ice[:, 0] *= 1 - per_channel[0, :, -1]  # a shadow takes light, not colour
    return ice * (1 - parts.sum(axis=2).T) + np.einsum("cnk,kc->nc", parts, colours)


def _weights(residual: Floats, noise: Floats) -> Floats:
    total = np.sum((residual / noise) ** 2, axis=1)
    return 1 / (1 + total / (3 * OUTLIER_AT**2)) ** 2


def _body_colour(exposures: Sequence[Exposure], model: StoneModel) -> Floats:
    black = np.zeros((len(PARTS), 3))
    look = Appearance(model=model, colours=black, noise=np.ones(3), has_handle=False)
    inside = [
        exposure.picture[_cover(exposure, look)[0, :, :-1].sum(axis=1) > 0.9]
        for exposure in exposures
    ]
    return np.median(np.concatenate(inside), axis=0)


def _colours(exposures: Sequence[Exposure], look: Appearance) -> Floats:
    """Colours of the parts by robust linear least squares, drawn weakly to the present ones."""
    colours = look.colours.copy()
    active = len(PARTS) if look.has_handle else len(PARTS) - 1
    covers = [_cover(exposure, look) for exposure in exposures]
    for _ in range(4):
        normal = np.zeros((3, active, active))
        right = np.zeros((3, active))
        for exposure, cover in zip(exposures, covers, strict=True):
            residual = exposure.picture - _rendered(cover, exposure.behind, colours)
            weight = _weights(residual, look.noise)
            for channel, blur in enumerate((0, 1, 1)):
                share = cover[blur, :, :active]
                rest = _rendered(cover, exposure.behind, np.zeros_like(colours))[:, channel]
                target = exposure.picture[:, channel] - rest
                normal[channel] += (share * weight[:, None]).T @ share
                right[channel] += (share * weight[:, None]).T @ target
        for channel in range(3):
            pull = 1e-3 * np.trace(normal[channel]) / active
            colours[:active, channel] = np.linalg.solve(
                normal[channel] + pull * np.eye(active),
                right[channel] + pull * colours[:active, channel],
            )
    return colours


def _with_handle(exposures: Sequence[Exposure], look: Appearance) -> Appearance:
    """Find the handle as what is left on and just above the top, and its heading in each frame."""
    strange: list[Floats] = []
    for exposure in exposures:
        cover = _cover(exposure, look)
        residual = exposure.picture - _rendered(cover, exposure.behind, look.colours)
        x, y = exposure.pose[:2]
        z = look.model.height + look.model.handle_rise
        above = exposure.window.foot + z * exposure.window.lean - np.array([x, y])
        near = np.hypot(*above.T) < 0.8 * look.model.radius
        # Light and shade change the brightness of granite; only a handle has another colour.
        oddness = np.linalg.norm(residual * [1.0, 2.0, 2.0], axis=1)
        strange.append(np.column_stack([exposure.picture, oddness])[near])
    pixels = np.concatenate(strange)
    if len(pixels) < 20:
        return look
    limit = max(HANDLE_CONTRAST, float(np.quantile(pixels[:, 3], 0.97)))
    marked = pixels[pixels[:, 3] >= limit]
    if len(marked) < 0.02 * len(pixels):
        return look
    colour = np.median(marked[:, :3], axis=0)
    colours = look.colours.copy()
    colours[-1] = colour
    for exposure in exposures:
        _settle(exposure, look)
    before = total_misfit(exposures, look)
    poses = [exposure.pose for exposure in exposures]
    best, best_misfit, best_poses = look, before, poses
    for rise, collar in product(HANDLE_RISES, HANDLE_COLLARS):
        for exposure, pose in zip(exposures, poses, strict=True):
            exposure.pose = pose
        model = replace(look.model, handle_rise=rise, collar_radius=collar, neck_length=collar / 2)
        found = replace(look, model=model, colours=colours, has_handle=True)
        _turn_together(exposures, found)
        for exposure in exposures:
            _settle(exposure, found)
        misfit = total_misfit(exposures, found)
        if misfit < best_misfit:
            best, best_misfit = found, misfit
            best_poses = [exposure.pose for exposure in exposures]
    for exposure, pose in zip(exposures, best_poses, strict=True):
        exposure.pose = pose
    return best


def _turn_together(exposures: Sequence[Exposure], look: Appearance) -> None:
    """Set all headings to the likeliest course of a stone that turns steadily.

    In one frame a handle may be read the wrong way round; a slowly changing spin through all of
    them may not (dynamic programming over heading and spin).
    """
    headings = np.linspace(-np.pi, np.pi, HEADINGS_TRIED, endpoint=False)
    step = 2 * np.pi / HEADINGS_TRIED
    ordered = sorted(exposures, key=lambda exposure: exposure.t)
    reluctance = np.abs(SPINS_TRIED[:, None] - SPINS_TRIED[None, :]) / SPIN_CHANGE
    value = np.zeros((HEADINGS_TRIED, len(SPINS_TRIED)))
    came_from: list[NDArray[np.intp]] = []
    for k, exposure in enumerate(ordered):
        if k > 0:
            turned = SPINS_TRIED * (exposure.t - ordered[k - 1].t) / step
            source = np.arange(HEADINGS_TRIED)[:, None] - turned[None, :]
            low = np.floor(source).astype(int)
            share = source - low
            columns = np.arange(len(SPINS_TRIED))[None, :]
            carried = (1 - share) * value[low % HEADINGS_TRIED, columns]
            carried += share * value[(low + 1) % HEADINGS_TRIED, columns]
            # [heading, spin before, spin now]
            options = carried[:, :, None] + reluctance[None]
            came_from.append(np.argmin(options, axis=1))
            value = np.min(options, axis=1)
        poses = [np.array([*exposure.pose[:2], heading]) for heading in headings]
        costs = np.array([_cost(exposure, look, pose) for pose in poses])
        value = value + (costs - costs.min())[:, None] / PIXEL_CORRELATION
    at, spin = np.unravel_index(int(np.argmin(value)), value.shape)
    heading = float(headings[at])
    for k in range(len(ordered) - 1, -1, -1):
        ordered[k].pose = np.array([*ordered[k].pose[:2], heading])
        if k > 0:
            near = round((heading + np.pi) / step) % HEADINGS_TRIED
            spin = came_from[k - 1][near, spin]
            heading -= float(SPINS_TRIED[spin]) * (ordered[k].t - ordered[k - 1].t)


def _with_shadow(exposures: Sequence[Exposure], look: Appearance) -> Appearance:
    """Start a shadow on the side where the ice beside the stone is darkest."""
    costs: list[tuple[float, Appearance]] = []
    tried = [(0.0, 0.0)]
    tried += [(0.04 * np.cos(a), 0.04 * np.sin(a)) for a in np.arange(8) * np.pi / 4]
    for dx, dy in tried:
        model = replace(
            look.model,
            shadow_x=dx,
            shadow_y=dy,
            shadow_radius=look.model.radius,
            shadow=SHADOW_TRIED,
            contact=SHADOW_TRIED,
            mirror=SHADOW_TRIED,
        )
        shaded = replace(look, model=model)
        costs.append((total_misfit(exposures, shaded), shaded))
    return min(costs, key=lambda item: item[0])[1]


def total_misfit(exposures: Sequence[Exposure], look: Appearance) -> float:
    return sum(_cost(exposure, look, exposure.pose) for exposure in exposures)


def _cost(exposure: Exposure, look: Appearance, pose: Floats) -> float:
    """Robust misfit of one exposure with the stone at a pose."""
    cover = _cover(exposure, look, pose)
    residual = exposure.picture - _rendered(cover, exposure.behind, look.colours)
    squares = np.sum((residual / look.noise) ** 2, axis=1)
    return float(np.sum(squares / (1 + squares / (3 * OUTLIER_AT**2))))


def _refine(
    exposures: Sequence[Exposure], look: Appearance, typical_model: StoneModel, rounds: int
) -> Appearance:
    """Gauss-Newton on shape, blur and colours with every exposure's pose projected out."""
    typical = typical_model.shape()
    of_handle = ("handle", "collar", "neck")
    names = [n for n in SHAPE_PARAMETERS if look.has_handle or not n.startswith(of_handle)]
    index = [SHAPE_PARAMETERS.index(n) for n in names]
    spread = np.array([SHAPE_SPREAD[n] for n in names])
    parts = len(PARTS) if look.has_handle else len(PARTS) - 1
    shared = len(names) + 3 * parts
    low, high = np.array([SHAPE_BOUNDS.get(n, (-np.inf, np.inf)) for n in names]).T
    damping = 1e-4
    value = _objective(exposures, look, typical, index, spread)
    for _ in range(rounds):
        normal, right = _joint_equations(exposures, look, index, parts)
        shape = look.model.shape()
        prior = np.zeros(shared)
        prior[: len(names)] = 1 / spread**2
        right[: len(names)] += (typical - shape)[index] / spread**2
        held, drawn = _granite_prior(look.colours, len(names), shared)
        normal += held + np.diag(prior + 1e-6)
        right += drawn
        before = [exposure.pose for exposure in exposures]
        for _ in range(4):
            step = _step_within(normal, right, damping, low - shape[index], high - shape[index])
            moved = shape.copy()
            moved[index] += np.clip(step[: len(names)], -spread, spread)
            moved[index] = np.clip(moved[index], low, high)
            colours = look.colours.copy()
            colours[:parts] += step[len(names) :].reshape(parts, 3)
            foot, side = PARTS.index("foot"), PARTS.index("side")
            colours[foot, 0] = min(colours[foot, 0], FOOT_BRIGHTNESS * colours[side, 0])
            tried = replace(look, model=look.model.with_shape(moved), colours=colours)
            for exposure in exposures:
                _settle(exposure, tried)
            found = _objective(exposures, tried, typical, index, spread)
            if found < value:
                look, value, damping = tried, found, max(damping / 10, 1e-4)
                break
            damping *= 10
            for exposure, pose in zip(exposures, before, strict=True):
                exposure.pose = pose
        else:
            break
    return look


def _objective(
    exposures: Sequence[Exposure],
    look: Appearance,
    typical: Floats,
    index: list[int],
    spread: Floats,
) -> float:
    """What `_refine` minimises: robust misfit and distance from what stones are like."""
    away = (look.model.shape() - typical)[index] / spread
    tint = np.array(
        [
            (look.colours[PARTS.index(name)] - look.colours[PARTS.index(other)]) / spread
            for name, other, spread in GRANITE
        ]
    )
    return total_misfit(exposures, look) / PIXEL_CORRELATION + float(
        away @ away + np.sum(tint * tint)
    )


def _joint_equations(
    exposures: Sequence[Exposure], look: Appearance, index: list[int], parts: int
) -> tuple[Floats, Floats]:
    """Normal equations of shape and colours, with every exposure's pose projected out."""
    poses = 3 if look.has_handle else 2
    shared = len(index) + 3 * parts
    normal, right = np.zeros((shared, shared)), np.zeros(shared)
    for exposure in exposures:
        jacobian, residual, weight = _linearised(exposure, look, index, parts, poses)
        full = np.zeros((shared + poses, shared + poses))
        pulled = np.zeros(shared + poses)
        normal_equations(jacobian, residual, weight, full, pulled)
        own = full[shared:, shared:] + 1e-9 * np.eye(poses)
        cross = full[:shared, shared:]
        solved = np.linalg.solve(own, np.column_stack([cross.T, pulled[shared:]]))
        normal += full[:shared, :shared] - cross @ solved[:, :-1]
        right += pulled[:shared] - cross @ solved[:, -1]
    return normal / PIXEL_CORRELATION, right / PIXEL_CORRELATION


def _step_within(
    normal: Floats, right: Floats, damping: float, lowest: Floats, highest: Floats
) -> Floats:
    """A damped step whose first parameters stay within limits; what stands at one is held there."""
    free = np.ones(len(right), dtype=bool)
    step = np.zeros(len(right))
    damped = normal + damping * np.diag(np.diag(normal))
    n = len(lowest)
    for _ in range(4):
        step[:] = 0.0
        step[free] = np.linalg.solve(damped[np.ix_(free, free)], right[free])
        over = free[:n] & (
            ((lowest > -1e-9) & (step[:n] < 0)) | ((highest < 1e-9) & (step[:n] > 0))
        )
        if not over.any():
            break
        free[:n] &= ~over
    return step


def _granite_prior(colours: Floats, start: int, size: int) -> tuple[Floats, Floats]:
    """What keeps the parts' colours near each other: (size, size) and (size,)."""
    held, drawn = np.zeros((size, size)), np.zeros(size)
    for name, other, spread in GRANITE:
        for channel in range(3):
            i = start + 3 * PARTS.index(name) + channel
            j = start + 3 * PARTS.index(other) + channel
            weight = 1 / spread[channel] ** 2
            pull = weight * (colours[PARTS.index(other)] - colours[PARTS.index(name)])[channel]
            held[i, i] += weight
            held[j, j] += weight
            held[i, j] -= weight
            held[j, i] -= weight
            drawn[i] += pull
            drawn[j] -= pull
    return held, drawn


def _linearised(
    exposure: Exposure, look: Appearance, index: list[int], parts: int, poses: int
) -> tuple[Floats, Floats, Floats]:
    """Derivatives of the standardised residuals by shape, colours and pose; residuals; weights."""
    cover = _cover(exposure, look)
    picture = _rendered(cover, exposure.behind, look.colours)
    residual = exposure.picture - picture
    weight = np.repeat(_weights(residual, look.noise), 3)
    shape = look.model.shape()
    columns: list[Floats] = []
    for i in index:
        moved = shape.copy()
        step = 0.02 if SHAPE_PARAMETERS[i].endswith("blur_px") else 5e-4
        moved[i] += step
        changed = replace(look, model=look.model.with_shape(moved))
        other = _rendered(_cover(exposure, changed), exposure.behind, look.colours)
        columns.append(((other - picture) / step / look.noise).ravel())
    per_channel = cover[[0, 1, 1]]
    for part in range(parts):
        for channel in range(3):
            slope = np.zeros_like(residual)
            slope[:, channel] = per_channel[channel, :, part] / look.noise[channel]
            columns.append(slope.ravel())
    for p in range(poses):
        pose = exposure.pose.copy()
        step = 1e-2 if p == 2 else 1e-3
        pose[p] += step
        other = _rendered(_cover(exposure, look, pose), exposure.behind, look.colours)
        columns.append(((other - picture) / step / look.noise).ravel())
    return (
        np.column_stack(columns),
        (residual / look.noise).ravel(),
        weight,
    )


def _residual_noise(exposures: Sequence[Exposure], look: Appearance) -> Floats:
    """Spread of what the model leaves on the stone, per channel.

    On the ice beside it little is left; measured there, every speckle of granite would count as
    something before the stone.
    """
    left: list[Floats] = []
    for exposure in exposures:
        cover = _cover(exposure, look)
        residual = exposure.picture - _rendered(cover, exposure.behind, look.colours)
        left.append(residual[cover[0, :, :-1].sum(axis=1) > STONE_SHARE])
    spread = np.median(np.abs(np.concatenate(left)), axis=0)
    noise = np.maximum(1.4826 * spread, MIN_NOISE)
    return noise * np.array([1.0, COLOUR_DISTRUST, COLOUR_DISTRUST])
