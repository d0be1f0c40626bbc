"""The written network gives the same output as the trained one."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
import torch
import train_detector
from learn.rink_patches import PATCH_PX
from train_detector import (
    PRECISION,
    StoneNetwork,
    calibrate,
    draw_chunk,
    heat_map,
    try_out,
    vary,
    write_onnx,
)

from friction_estimation.tracking.detection.detector import DOUBTFUL, NETWORK_FILE, DetectorNetwork


@pytest.fixture
def network():
    torch.manual_seed(3)
    network = StoneNetwork()
    for layer in network.modules():
        if isinstance(layer, torch.nn.BatchNorm2d):
            layer.running_mean.uniform_(-0.2, 0.2)
            layer.running_var.uniform_(0.5, 2.0)
    network.head.bias.data += 3.0
    return network.eval()


@pytest.fixture
def picture(rng):
    return rng.integers(0, 256, (88, 120, 3)).astype(np.uint8)


def as_seen(picture):
    return torch.from_numpy(picture[..., ::-1].transpose(2, 0, 1)[None] / 255 - 0.5).float()


def test_the_written_network_is_the_trained_one(tmp_path, network, picture):
    write_onnx(network, tmp_path / "network.onnx")
    seen = as_seen(picture)
    with torch.no_grad():
        both = network(seen) + network(seen.flip(3)).flip(3)
        stones = torch.sigmoid(both / 2)[0, 0].numpy()
    found = DetectorNetwork(tmp_path / "network.onnx").detect(picture)
    assert found
    highest = stones.max()
    assert highest > DOUBTFUL
    assert abs(found[0].score - highest) < 1e-5
    row, column = np.unravel_index(stones.argmax(), stones.shape)
    assert np.abs(found[0].px - (2 * np.array([column, row]) + 0.5)).max() < 4


def test_a_varied_patch_has_its_stones_where_its_labels_are(rng):
    x, y = np.meshgrid(np.arange(PATCH_PX), np.arange(PATCH_PX))
    places = np.array([[30.0, 50.0], [70.0, 20.0], [np.nan, np.nan]])
    gone = mirrored = 0
    for _ in range(60):
        shown = []
        for place in places[:2]:
            spot = 220 * np.exp(-((x - place[0]) ** 2 + (y - place[1]) ** 2) / 18)
            shown.append(np.repeat(spot[..., None], 3, axis=2).astype(np.uint8))
        state = rng.bit_generator.state
        for k, picture in enumerate(shown):
            rng.bit_generator.state = state
            seen, _, moved = vary(picture, picture[..., 0], places, rng)
            if np.isnan(moved[k]).any():
                gone += 1
                continue
            row, column = np.unravel_index(seen.sum(axis=2).argmax(), (PATCH_PX, PATCH_PX))
            assert np.hypot(column - moved[k, 0], row - moved[k, 1]) < 2.5
        mirrored += bool(moved[0, 0] > moved[1, 0])
        assert np.isnan(moved[2]).all()
    assert gone < 20
    assert 15 < mirrored < 45


def test_every_stone_has_one_highest_pixel_in_the_heat_map():
    stones = np.array([[[10.3, 21.8], [40.0, 40.0], [np.nan, np.nan]], [[np.nan, np.nan]] * 3])
    maps = heat_map(stones)
    rows, columns = np.nonzero(maps[0] == 1)
    assert maps.shape == (2, PATCH_PX // 2, PATCH_PX // 2)
    assert set(zip(2 * columns + 0.5, 2 * rows + 0.5, strict=True)) == {(10.5, 22.5), (40.5, 40.5)}
    assert maps[1].max() == 0


def the_networks_weights():
    """The network of the package; the file has the normalisations in its convolutions."""
    network = StoneNetwork().eval()
    file = cv2.dnn.readNetFromONNX(str(NETWORK_FILE), cv2.dnn.ENGINE_CLASSIC)
    layers = [file.getLayer(file.getLayerId(name)) for name in file.getLayerNames()]
    weights = iter([layer.blobs for layer in layers if layer.type == "Convolution"])
    for layer in network.modules():
        if isinstance(layer, torch.nn.Conv2d):
            weight, bias = map(torch.from_numpy, next(weights))
            layer.weight.data, layer.bias = weight, torch.nn.Parameter(bias.ravel())
        elif isinstance(layer, torch.nn.BatchNorm2d):
            layer.eps = 0.0  # passes on what it gets
    return network


def test_scores_are_shifted_until_sure_detections_are_mostly_stones(tmp_path, monkeypatch):
    for name in ("CHUNK", "HELD_OUT"):
        monkeypatch.setattr(train_detector, name, 60)
    patches = dict(np.load(draw_chunk(3, tmp_path)))
    network, file = the_networks_weights(), tmp_path / "network.onnx"
    with torch.no_grad():
        network.head.bias[0] += 1.5
    write_onnx(network, file)
    before = try_out(DetectorNetwork(file), patches)["right_percent_of_sure"]
    assert before < 100 * PRECISION - 3
    calibrate(network, file, patches)
    write_onnx(network, file)
    after = try_out(DetectorNetwork(file), patches)
    assert 100 * PRECISION - 0.1 < after["right_percent_of_sure"] < 100 * PRECISION + 2
    assert after["found_percent"] > 70


def test_the_network_in_the_package_is_small():
    assert NETWORK_FILE.stat().st_size < 2e6
