"""The robot: nodes that publish, an arm with a service, and an action that looks transforms up."""

import array
import math
import time

from geometry_msgs.msg import TransformStamped
from rclpy.action import ActionServer
from rclpy.node import Node
from sensor_msgs.msg import Image
from std_msgs.msg import String
from std_srvs.srv import SetBool
from tf2_msgs.action import LookupTransform
from tf2_msgs.msg import TFMessage

import graph_side

STATIC_FRAMES = ("camera", "lidar", "imu")


class Talker(Node):
    def __init__(self, context):
        super().__init__("talker", context=context)
        self._publisher = self.create_publisher(
            String, "/chatter", graph_side.TOPICS["/chatter"][1]
        )
        self.declare_parameter("greeting", "hello")  # the operator changes it
        self._count = 0
        self.create_timer(0.1, self._tick)

    def _tick(self):
        self._count += 1
        greeting = self.get_parameter("greeting").value
        self._publisher.publish(String(data=f"{greeting} {self._count} at {time.time():.6f}"))


class Camera(Node):
    """500 kB at 10 Hz, of bytes that do not compress."""

    def __init__(self, context):
        super().__init__("camera", context=context)
        self._publisher = self.create_publisher(
            Image, "/camera/image", graph_side.TOPICS["/camera/image"][1]
        )
        self._image = Image(height=500, width=1000, encoding="mono8", step=1000)
        self._image.header.frame_id = "camera"
        with open("/dev/urandom", "rb") as noise:
            self._image.data = array.array("B", noise.read(500_000))
        self.create_timer(0.1, self._tick)

    def _tick(self):
        self._image.header.stamp = self.get_clock().now().to_msg()
        self._publisher.publish(self._image)


class Odometry(Node):
    """/tf at 50 Hz: the robot drives in a circle."""

    def __init__(self, context):
        super().__init__("odometry", context=context)
        self._publisher = self.create_publisher(TFMessage, "/tf", graph_side.TOPICS["/tf"][1])
        self.create_timer(0.02, self._tick)

    def _tick(self):
        transform = TransformStamped(child_frame_id="base_link")
        transform.header.frame_id = "odom"
        now = self.get_clock().now()
        transform.header.stamp = now.to_msg()
        angle = now.nanoseconds / 1e9 % (2 * math.pi)
        transform.transform.translation.x = math.cos(angle)
        transform.transform.translation.y = math.sin(angle)
        transform.transform.rotation.z = math.sin(angle / 2)
        transform.transform.rotation.w = math.cos(angle / 2)
        self._publisher.publish(TFMessage(transforms=[transform]))


class Mount(Node):
    """Publishes once where a sensor is mounted; late subscribers still get it."""

    def __init__(self, context, frame):
        super().__init__(f"{frame}_mount", context=context)
        self._publisher = self.create_publisher(TFMessage, "/tf_static", graph_side.STATIC_QOS)
        transform = TransformStamped(child_frame_id=frame)
        transform.header.frame_id = "base_link"
        transform.header.stamp = self.get_clock().now().to_msg()
        transform.transform.rotation.w = 1.0
        self._publisher.publish(TFMessage(transforms=[transform]))


class Arm(Node):
    """Can be enabled and disabled."""

    def __init__(self, context):
        super().__init__("arm", context=context)
        self.create_service(SetBool, "/arm/enable", self._enable)

    def _enable(self, request, response):
        response.success = True
        response.message = "enabled" if request.data else "disabled"
        return response


class Lookup(Node):
    """The action of tf2's buffer server, for one frame."""

    def __init__(self, context):
        super().__init__("lookup", context=context)
        self._server = ActionServer(self, LookupTransform, "/lookup", self._execute)

    def _execute(self, goal):
        result = LookupTransform.Result()
        result.transform.header.frame_id = goal.request.target_frame
        result.transform.child_frame_id = goal.request.source_frame
        goal.succeed()
        return result


if __name__ == "__main__":
    graph_side.run(
        lambda context, _: [
            Talker(context),
            Camera(context),
            Odometry(context),
            Arm(context),
            Lookup(context),
            *(Mount(context, frame) for frame in STATIC_FRAMES),
        ]
    )
