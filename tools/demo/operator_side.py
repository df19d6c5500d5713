"""The operator: steers with /cmd_vel and watches the rest."""

import math
import time

from geometry_msgs.msg import Twist
from rclpy.node import Node

import graph_side


class Steering(Node):
    def __init__(self, context):
        super().__init__("steering", context=context)
        self._publisher = self.create_publisher(Twist, "/cmd_vel", graph_side.TOPICS["/cmd_vel"][1])
        self.create_timer(0.05, self._tick)

    def _tick(self):
        twist = Twist()
        twist.linear.x = 0.5
        twist.angular.z = 0.5 * math.sin(time.time())
        twist.linear.z = time.time()  # see graph_side.sent_at
        self._publisher.publish(twist)


if __name__ == "__main__":
    graph_side.run(lambda context: [Steering(context)])
