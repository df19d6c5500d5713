"""The operator: steers with /cmd_vel, calls services, actions, parameters; watches the rest."""

import math
import time

from geometry_msgs.msg import Twist
from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from std_srvs.srv import SetBool
from tf2_msgs.action import LookupTransform

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


class Calling(Node):
    """Every half second one call of each kind, if the last one has been answered."""

    def __init__(self, context, tally):
        super().__init__("calling", context=context)
        self._tally = tally
        self._open = set()
        self._count = 0
        self._service = self.create_client(SetBool, "/arm/enable")
        self._action = ActionClient(self, LookupTransform, "/lookup")
        self._parameters = AsyncParameterClient(self, "/talker")
        self.create_timer(0.5, self._tick)

    def _tick(self):
        self._count += 1
        if self._service.service_is_ready():
            self._call("/arm/enable", self._enable)
        if self._action.server_is_ready():
            self._call("/lookup", self._look_up)
        if self._parameters.services_are_ready():
            self._call("/talker", self._greet)

    def _call(self, name, begin):
        if name not in self._open:
            self._open.add(name)
            begin(name, time.monotonic())

    def _end(self, name, begun, good):
        self._open.discard(name)
        if good:
            self._tally.done(name, begun)

    def _enable(self, name, begun):
        future = self._service.call_async(SetBool.Request(data=self._count % 2 == 0))
        future.add_done_callback(lambda f: self._end(name, begun, f.result().success))

    def _look_up(self, name, begun):
        goal = LookupTransform.Goal(target_frame="odom", source_frame="base_link")

        def accepted(future):
            if not future.result().accepted:
                return self._end(name, begun, False)
            result = future.result().get_result_async()
            return result.add_done_callback(ended)

        def ended(future):
            frame = future.result().result.transform.child_frame_id
            self._end(name, begun, frame == "base_link")

        self._action.send_goal_async(goal).add_done_callback(accepted)

    def _greet(self, name, begun):
        greeting = Parameter("greeting", value=f"hello {self._count}")
        future = self._parameters.set_parameters([greeting])
        future.add_done_callback(
            lambda f: self._end(name, begun, all(r.successful for r in f.result().results))
        )


if __name__ == "__main__":
    graph_side.run(lambda context, tally: [Steering(context), Calling(context, tally)])
