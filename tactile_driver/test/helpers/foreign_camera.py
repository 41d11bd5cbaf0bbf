# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A camera driver of somebody else, in a process of its own: 60 images of 640 x 480 bgr8 at 15 Hz on image_raw, but every tenth,
reliable, by the middleware's own transports. Its stamps are those of a recording, and /clock has their time, as of
`ros2 bag play --clock`. Prints how many it sent.
"""
import time

import rclpy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Image

RATE, HEIGHT, WIDTH, FRAMES, SKIP = 15, 480, 640, 60, 10


def main():
    rclpy.init()
    node = rclpy.create_node('foreign_camera')
    publisher, clock = node.create_publisher(Image, 'image_raw', 10), node.create_publisher(Clock, '/clock', 10)
    image = Image(height=HEIGHT, width=WIDTH, step=3 * WIDTH, encoding='bgr8', data=bytes(3 * WIDTH * HEIGHT))
    until = time.monotonic() + 60
    while not publisher.get_subscription_count() and time.monotonic() < until:
        time.sleep(0.05)
    begin = time.monotonic() + 1  # a subscription may be replaced first
    sent = 0
    for k in range(FRAMES):
        time.sleep(max(0.0, begin + k / RATE - time.monotonic()))
        image.header.stamp.sec, image.header.stamp.nanosec = 100 + k // RATE, round(k % RATE / RATE * 1e9)
        clock.publish(Clock(clock=image.header.stamp))
        if k % SKIP:
            publisher.publish(image)
            sent += 1
    time.sleep(1)
    print(sent)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
