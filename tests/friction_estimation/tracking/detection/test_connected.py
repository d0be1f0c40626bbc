"""Connected parts of masks, against OpenCV's."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from friction_estimation.tracking.connected import boxes_of_parts, connected_parts


@pytest.mark.parametrize("share", [0.0, 0.05, 0.3, 0.6, 0.9, 1.0])
@pytest.mark.parametrize("shape", [(1, 1), (1, 17), (23, 1), (31, 40)])
def test_parts_are_those_of_opencv(rng, share, shape):
    mask = (rng.random(shape) < share).astype(np.uint8) * np.uint8(255)
    for corners, connectivity in ((False, 4), (True, 8)):
        _, _, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=connectivity)
        found = boxes_of_parts(mask, corners=corners)
        assert sorted(map(tuple, found)) == sorted(map(tuple, stats[1:]))


def test_numbers_of_parts_are_those_of_their_boxes(rng):
    mask = (rng.random((40, 50)) < 0.35).astype(np.uint8)
    labels, boxes = connected_parts(mask)
    assert np.array_equal(labels > 0, mask > 0)
    assert len(boxes) == labels.max() > 10
    for number, (left, top, width, height, count) in enumerate(boxes, start=1):
        rows, columns = np.nonzero(labels == number)
        assert len(rows) == count
        assert (columns.min(), rows.min()) == (left, top)
        assert (np.ptp(columns), np.ptp(rows)) == (width - 1, height - 1)


def test_arms_of_a_comb_are_one_part():
    mask = np.zeros((6, 21), dtype=np.uint8)
    mask[:, ::2] = 1
    assert len(boxes_of_parts(mask)) == 11
    mask[-1] = 1
    assert boxes_of_parts(mask).tolist() == [[0, 0, 21, 6, 5 * 11 + 21]]
