"""Throw by pymunk alone, in fixed steps: the baseline of the speed of throws."""

from __future__ import annotations

import math
from typing import Any

import pymunk

from curling_env.ice import Ice
from curling_env.physics.motion import GRAVITY


def throw_in_pymunk(ice: Ice, throw: Any, rate_hz: float = 60.0) -> tuple[float, float]:
    """Move a stone with pymunk, slow it in a Python callback, and return its place of rest [m].

    Parameters
    ----------
    ice : standard ice, with any friction map
    throw : release, an element of an array of RELEASE_DTYPE
    rate_hz : steps per second
    """
    stone, sheet = ice.stone, ice.sheet
    mu, cell = ice.friction.mu, sheet.cell_size
    exponent = float(ice.effects[0].parameters["exponent"])
    curl = float(ice.effects[2].parameters["strength"])

    def slow(body: pymunk.Body, gravity: Any, damping: float, dt: float) -> None:
        vx, vy = body.velocity
        speed = math.hypot(vx, vy)
        if speed < 1e-9:
            return
        x, y = body.position
        row = min(max(int((y + sheet.length / 2) / cell), 0), mu.shape[0] - 1)
        column = min(max(int((x + sheet.width / 2) / cell), 0), mu.shape[1] - 1)
        loss = (GRAVITY * mu[row, column] * speed**-exponent + 9.5e-4 * speed * speed) * dt
        if loss >= speed:
            body.velocity = (0.0, 0.0)
            body.angular_velocity = 0.0
            return
        left = math.copysign(curl * speed**0.2 * dt, body.angular_velocity)
        keep = 1.0 - loss / speed
        body.velocity = (vx * keep - vy / speed * left, vy * keep + vx / speed * left)

    body = pymunk.Body(stone.mass, stone.inertia)
    body.position = (float(throw["x"]), float(throw["y"]))
    body.velocity = (float(throw["vx"]), float(throw["vy"]))
    body.angular_velocity = float(throw["omega"])
    body.velocity_func = slow
    space = pymunk.Space()
    space.add(body, pymunk.Circle(body, stone.radius))
    for _ in range(int(60 * rate_hz)):
        space.step(1.0 / rate_hz)
        if body.velocity.length < 1e-3:
            break
    return body.position.x, body.position.y
