"""A teleop node in a process of its own: leans on its stick for so many seconds, then says nothing.

Usage: teleop.py SECONDS SPEED [PERIOD] [--neutral]: after it, a neutral command
"""

import sys
import time

import rclpy
from geometry_msgs.msg import TwistStamped


def main():
    words = [word for word in sys.argv[1:] if not word.startswith("--")]
    seconds, speed = float(words[0]), float(words[1])
    period = float(words[2]) if len(words) > 2 else 0.05
    rclpy.init()
    node = rclpy.create_node("teleop", enable_rosout=False, start_parameter_services=False)
    publisher = node.create_publisher(TwistStamped, "/cmd_vel", 1)
    while publisher.get_subscription_count() == 0:
        time.sleep(0.01)
    time.sleep(0.3)

    def say(value):
        message = TwistStamped()
        message.header.stamp = node.get_clock().now().to_msg()
        message.header.frame_id = "base_link"
        message.twist.linear.x = value
        publisher.publish(message)

    end = time.monotonic() + seconds
    while time.monotonic() < end:
        say(speed)
        time.sleep(period)
    if "--neutral" in sys.argv:
        say(0.0)
    print("let go", flush=True)
    time.sleep(10)


if __name__ == "__main__":
    main()
