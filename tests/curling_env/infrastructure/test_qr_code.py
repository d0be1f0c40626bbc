"""An address in the terminal is read by a camera."""

from __future__ import annotations

import cv2
import numpy as np

from curling_env.infrastructure.qr_code import qr_code


def test_a_camera_reads_the_code_in_the_terminal():
    address = "http://192.168.178.23:45671/abcdefghijklmnopqrstuv/"
    light = {"█": (1, 1), "▀": (1, 0), "▄": (0, 1), " ": (0, 0)}
    rows = [
        row.removeprefix("\033[97;40m").removesuffix("\033[0m")
        for row in qr_code(address).split("\n")
    ]
    shown = np.array([[light[block] for block in row] for row in rows], dtype=np.uint8)
    picture = 255 * shown.transpose(0, 2, 1).reshape(2 * len(rows), -1)
    large = np.pad(np.kron(picture, np.ones((6, 6), np.uint8)), 40, constant_values=255)
    assert cv2.QRCodeDetector().detectAndDecode(large)[0] == address
