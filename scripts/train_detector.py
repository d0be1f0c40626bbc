"""Train the network that finds stones and people in pictures of the ice.

    python scripts/train_detector.py -o runs/detector            # about two hours of two cores
    python scripts/train_detector.py -o runs/detector --keep     # and put it into the package

It learns from drawn pictures alone (`learn.rink_patches`), with fixed seeds. The network is written
for `cv2.dnn` and tested on unseen patches. Patches are kept in the folder, for a repeated run.
"""

from __future__ import annotations

import argparse
import json
import math
import shutil
import warnings
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import torch
from learn.rink_patches import MAX_STONES, PATCH_PX, draw_patch
from torch import nn
from torch.nn import functional
from tqdm import tqdm

from friction_estimation.tracking.detection.detector import NETWORK_FILE, SURE, DetectorNetwork

WIDTHS = (12, 24, 48, 64)
"""Channels at full, half, quarter and eighth size."""
CHUNK, HELD_OUT, BATCH = 500, 1_000, 32
SEEDS = range(72, 128)
"""One for each `CHUNK` patches."""
STEPS, RATE = 12_000, 4e-3
SPOT_PX = 2.2
"""Standard deviation of the spot that marks a stone in the heat map [px]."""
PRECISION = 0.97
"""Share of stones among the detections in held-out patches that are called sure."""
NEAR_PX = 5.0
"""Maximum distance of a detection from its stone, a third of a stone's width [px]."""
PEOPLE_WEIGHT = 0.3
"""Weight of people in the loss, beside stones."""


class StoneNetwork(nn.Module):
    """A U-Net that maps (n, 3, H, W) RGB in -0.5 to 0.5 to (n, 2, H/2, W/2) logits.

    The first channel is high at the centres of stones on the ice, the second where people are.
    """

    def __init__(self) -> None:
        super().__init__()
        a, b, c, d = WIDTHS
        self.down = nn.ModuleList([_block(3, a), _block(a, b), _block(b, c), _block(c, d)])
        self.up = nn.ModuleList([_block(d + c, c), _block(c + b, b)])
        self.head = nn.Conv2d(b, 2, 1)
        self.head.bias = nn.Parameter(torch.full((2,), -3.0))

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        levels = []
        for depth, block in enumerate(self.down):
            x = block(functional.max_pool2d(x, 2) if depth else x)
            levels.append(x)
        for block, level in zip(self.up, (levels[2], levels[1]), strict=True):
            x = block(torch.cat([functional.interpolate(x, scale_factor=2.0), level], 1))
        return self.head(x)


def _block(inside: int, outside: int) -> nn.Sequential:
    layers: list[nn.Module] = []
    for channels in (inside, outside):
        layers.append(nn.Conv2d(channels, outside, 3, padding=1, bias=False))
        layers += [nn.BatchNorm2d(outside), nn.ReLU(inplace=True)]
    return nn.Sequential(*layers)


# --- patches ------------------------------------------------------------------------------------


def draw_chunk(seed: int, folder: Path) -> Path:
    """Draw `CHUNK` patches into a file of the folder, unless it is there."""
    path = folder / f"patches-{seed}.npz"
    if not path.exists():
        rng = np.random.default_rng([seed, 47])
        stones = np.full((CHUNK, MAX_STONES, 2), np.nan, np.float32)
        pictures, people = [], []
        for k in range(CHUNK):
            patch = draw_patch(rng, harder=True)
            stones[k, : len(patch.stones)] = patch.stones
            pictures.append(patch.picture)
            people.append(np.round(255 * patch.people).astype(np.uint8))
        draft = path.with_suffix(".draft.npz")
        np.savez(draft, pictures=np.array(pictures), people=np.array(people), stones=stones)
        draft.replace(path)
    return path


def draw_patches(folder: Path, workers: int) -> dict[str, np.ndarray]:
    """Draw the patches, or read them; the last `HELD_OUT` are not for training."""
    with ProcessPoolExecutor(workers) as pool:
        drawn = pool.map(partial(draw_chunk, folder=folder), SEEDS)
        paths = list(tqdm(drawn, "draw", len(SEEDS)))
    parts = [np.load(path) for path in paths]
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0].files}


# --- training -----------------------------------------------------------------------------------


def train(network: Any, patches: dict[str, np.ndarray]) -> None:
    """Train a network on all patches but the held-out ones."""
    rng = np.random.default_rng(0)
    network.to(memory_format=torch.channels_last).train()
    optimiser = torch.optim.AdamW(network.parameters(), weight_decay=1e-4)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, RATE, total_steps=STEPS)
    count, mean = len(patches["pictures"]) - HELD_OUT, 0.0
    bar = tqdm(range(STEPS), "train")
    for _ in bar:
        picture, spots, people = _batch(patches, rng.integers(0, count, BATCH), rng)
        out = network(picture.contiguous(memory_format=torch.channels_last))
        loss = _loss(out, spots, people)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        schedule.step()
        mean = 0.99 * mean + 0.01 * loss.item() if mean else loss.item()
        bar.set_postfix(loss=f"{mean:.3f}", refresh=False)
    network.eval()


def _batch(
    patches: dict[str, np.ndarray], chosen: np.ndarray, rng: np.random.Generator
) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Return pictures, each varied at random, with heat maps and masks of people."""
    varied = [
        vary(patches["pictures"][k], patches["people"][k], patches["stones"][k], rng)
        for k in chosen
    ]
    pictures, people, stones = (np.array(part) for part in zip(*varied, strict=True))
    spots = heat_map(stones)
    arrays = (pictures.transpose(0, 3, 1, 2) / 255 - 0.5, spots, people[:, ::2, ::2] / 255)
    made = [torch.from_numpy(np.ascontiguousarray(a, dtype=np.float32)) for a in arrays]
    return made[0], made[1], made[2]


def heat_map(stones: np.ndarray) -> np.ndarray:
    """Return maps of half the size of patches, 1 at the pixel next to a stone, lower around it.

    Parameters
    ----------
    stones : (n, k, 2) centres in each patch [px]; NaN for none
    """
    y, x = np.mgrid[:PATCH_PX:2, :PATCH_PX:2] + 0.5
    away = (x - stones[..., 0, None, None]) ** 2 + (y - stones[..., 1, None, None]) ** 2
    spots = np.nan_to_num(np.exp(-away / (2 * SPOT_PX**2)))
    highest = spots.max(axis=(2, 3), keepdims=True)
    return np.where(spots == highest, highest > 0, spots).max(axis=1)


def vary(
    picture: np.ndarray, people: np.ndarray, stones: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mirror, turn, move and recolour a patch at random; stones that leave it become NaN.

    A network that saw the same patches again would learn them by heart.
    """
    middle, size = (PATCH_PX - 1) / 2, (PATCH_PX, PATCH_PX)
    turn = cv2.getRotationMatrix2D(
        (middle, middle), rng.normal(0, 8), math.exp(rng.normal(0, 0.06))
    )
    turn[:, 2] += rng.uniform(-16, 16, 2)
    if rng.random() < 0.5:
        turn = turn @ np.array([[-1.0, 0.0, 2 * middle], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    moved = stones @ turn[:, :2].T + turn[:, 2]
    inside = ((moved > -0.5) & (moved < PATCH_PX - 0.5)).all(axis=1)
    moved[~inside] = np.nan
    seen, person = (
        cv2.warpAffine(part, turn, size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        for part in (picture, people)
    )
    seen = seen[..., rng.permutation(3)].astype(np.float32)
    if rng.random() < 0.2:
        seen = cv2.GaussianBlur(seen, (0, 0), rng.uniform(0.3, 1.0))
    if rng.random() < 0.3:
        seen += rng.normal(0, rng.uniform(1, 8), seen.shape)
    grey = seen.mean(axis=2, keepdims=True, dtype=np.float32)
    seen = grey + (seen - grey) * rng.uniform(0.5, 1.2)
    seen = seen * rng.uniform(0.7, 1.2, 3) ** 0.5 * rng.uniform(0.8, 1.15) + rng.uniform(-20, 20)
    return np.clip(seen, 0, 255), person, moved


def _loss(out: torch.Tensor, spots: torch.Tensor, people: torch.Tensor) -> torch.Tensor:
    """Focal loss of the heat map (Zhou et al., Objects as Points, 2019) plus entropy of people."""
    score, centre = torch.sigmoid(out[:, 0]), (spots == 1.0).float()
    hit = centre * (1 - score) ** 2 * functional.logsigmoid(out[:, 0])
    miss = (1 - centre) * (1 - spots) ** 4 * score**2 * functional.logsigmoid(-out[:, 0])
    stones = -(hit + miss).sum() / centre.sum().clamp(min=1)
    return stones + PEOPLE_WEIGHT * functional.binary_cross_entropy_with_logits(out[:, 1], people)


# --- the file -----------------------------------------------------------------------------------


def write_onnx(network: StoneNetwork, path: Path) -> None:
    """Write a network as ONNX, with its normalisations folded into the convolutions."""
    free = {"picture": {2: "H", 3: "W"}, "logits": {2: "h", 3: "w"}}
    empty = torch.zeros(1, 3, PATCH_PX, PATCH_PX)
    with warnings.catch_warnings(action="ignore"):  # the newer exporter needs onnxscript
        torch.onnx.export(
            network, (empty,), path, input_names=["picture"], output_names=["logits"],
            dynamic_axes=free, opset_version=13, dynamo=False,
        )  # fmt: skip


def calibrate(network: StoneNetwork, file: Path, patches: dict[str, np.ndarray]) -> None:
    """Shift the scores of a network so that `PRECISION` of those from `SURE` on are stones.

    Parameters
    ----------
    file : the network, as it was written
    patches : of which the last `HELD_OUT` were not for training
    """
    score, away = np.array(sorted(judged(DetectorNetwork(file), patches)[0], reverse=True)).T
    right = np.cumsum(away < NEAR_PX) / np.arange(1, len(away) + 1)
    least = score[np.flatnonzero(right >= PRECISION)[-1]]
    assert network.head.bias is not None
    with torch.no_grad():
        network.head.bias[0] += math.log(SURE / (1 - SURE)) - math.log(least / (1 - least))


def try_out(detector: DetectorNetwork, patches: dict[str, np.ndarray]) -> dict[str, float]:
    """Report found stones, false positives and position errors in the held-out patches."""
    seen, total = judged(detector, patches)
    score, away = np.array(seen).T
    sure, right = score >= SURE, away < NEAR_PX
    errors = away[sure & right]
    return {
        "stones": total,
        "found_percent": 100 * len(errors) / total,
        "right_percent_of_sure": 100 * float(right[sure].mean()),
        "right_percent_of_doubtful": 100 * float(right[~sure].mean()),
        "median_error_px": float(np.median(errors)),
        "rms_error_px": float(np.sqrt(np.mean(errors**2))),
    }


def judged(
    detector: DetectorNetwork, patches: dict[str, np.ndarray]
) -> tuple[list[tuple[float, float]], int]:
    """Return the detections in the held-out patches and the number of their stones.

    A detection is its score and its distance from the nearest stone [px].
    """
    seen: list[tuple[float, float]] = []
    total = 0
    for k in range(len(patches["pictures"]) - HELD_OUT, len(patches["pictures"])):
        picture = cv2.cvtColor(patches["pictures"][k], cv2.COLOR_RGB2BGR)
        stones = patches["stones"][k]
        stones = stones[np.isfinite(stones[:, 0])]
        total += len(stones)
        for one in detector.detect(picture):
            away = np.linalg.norm(stones - one.px, axis=1)
            seen.append((one.score, float(away.min(initial=np.inf))))
    return seen, total


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("runs/detector"))
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--keep", action="store_true", help="put it into the package")
    arguments = parser.parse_args()
    folder = arguments.output
    folder.mkdir(parents=True, exist_ok=True)
    torch.set_num_threads(arguments.workers)
    torch.manual_seed(0)

    network, file = StoneNetwork(), folder / "network.onnx"
    patches = draw_patches(folder, arguments.workers)
    train(network, patches)
    write_onnx(network, file)
    calibrate(network, file, patches)
    write_onnx(network, file)
    print(json.dumps(try_out(DetectorNetwork(file), patches), indent=1))
    if arguments.keep:
        shutil.copyfile(file, NETWORK_FILE)


if __name__ == "__main__":
    main()
