"""The written network gives the same output as the trained one."""

from __future__ import annotations

import numpy as np
import torch
from train_detector import StoneNetwork, write_onnx

from friction_estimation.tracking.detection.detector import DOUBTFUL, NETWORK_FILE, Detector


def test_the_written_network_is_the_trained_one(tmp_path, rng):
    torch.manual_seed(3)
    network = StoneNetwork()
    for layer in network.modules():
        if isinstance(layer, torch.nn.BatchNorm2d):
            layer.running_mean.uniform_(-0.2, 0.2)
            layer.running_var.uniform_(0.5, 2.0)
    network.head.bias.data += 3.0
    write_onnx(network.eval(), tmp_path / "network.onnx")
    picture = rng.integers(0, 256, (88, 120, 3)).astype(np.uint8)
    seen = torch.from_numpy(picture[..., ::-1].transpose(2, 0, 1)[None] / 255 - 0.5).float()
    with torch.no_grad():
        both = network(seen) + network(seen.flip(3)).flip(3)
        stones = torch.sigmoid(both / 2)[0, 0].numpy()
    found = Detector(tmp_path / "network.onnx").detect(picture)
    assert found
    highest = stones.max()
    assert highest > DOUBTFUL
    assert abs(found[0].score - highest) < 1e-5
    row, column = np.unravel_index(stones.argmax(), stones.shape)
    assert np.abs(found[0].px - (2 * np.array([column, row]) + 0.5)).max() < 4


def test_the_network_in_the_package_is_small():
    assert NETWORK_FILE.stat().st_size < 2e6
