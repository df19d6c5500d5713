#!/usr/bin/env python3
"""A camera for thin_camera.md: 640x480 at 30 a second, of hills that pass by."""

import array
import math
import random

import rclpy
from rclpy.node import Node
from sensor_msgs.msg import CameraInfo, Image

WIDTH, HEIGHT, AROUND = 640, 480, 1600


def landscape():
    """Each row once around, and its beginning again."""
    rows = []
    for y in range(HEIGHT):
        noise, row = random.Random(y).randbytes(AROUND), bytearray()
        for x in range(AROUND):
            turn = 2 * math.pi * x / AROUND
            ridge = HEIGHT * (0.45 + 0.12 * math.sin(3 * turn) + 0.05 * math.sin(11 * turn))
            tree = 40 if (x // 20 * 7 + y // 30 * 5) % 11 < 3 else 0
            grain = noise[x] % 16
            if y < ridge:
                row += bytes((90 + y // 4 + grain, 130 + y // 4 + grain, 215 + grain))
            else:
                row += bytes((70 + tree + grain, 120 + grain - tree, 60 + y // 10 + grain))
        rows.append(bytes(row + row[: 3 * WIDTH]))
    return rows


class Camera(Node):
    def __init__(self):
        super().__init__("thin_camera")
        self._images = self.create_publisher(Image, "/camera/image_raw", 1)
        self._infos = self.create_publisher(CameraInfo, "/camera/camera_info", 1)
        self._rows, self._number = landscape(), 0
        self.create_timer(1 / 30, self._publish)

    def _publish(self):
        self._number += 1
        image = Image(height=HEIGHT, width=WIDTH, encoding="rgb8", step=3 * WIDTH)
        image.header.stamp = self.get_clock().now().to_msg()
        image.header.frame_id = "camera"
        # What is near passes faster.
        begins = (3 * (self._number * (2 + y // 60) // 2 % AROUND) for y in range(HEIGHT))
        data = b"".join(row[at : at + 3 * WIDTH] for row, at in zip(self._rows, begins))
        image.data = array.array("B", data)
        self._images.publish(image)
        self._infos.publish(CameraInfo(header=image.header, height=HEIGHT, width=WIDTH))


def main():
    rclpy.init()
    try:
        rclpy.spin(Camera())
    except KeyboardInterrupt:
        pass


if __name__ == "__main__":
    main()
