"""The nodes of one side for test_rmw.py, in a process that has a middleware of its own:
rmw_nodes.py robot | operator, or many of a graph: member N | listener COUNT. What the operator's
nodes and the listener receive is printed as lines of JSON."""

import json
import sys
import threading
import time

import rclpy
from connect_bridge_test_interfaces.action import Fibonacci
from rcl_interfaces.msg import ParameterEvent
from rclpy.action import ActionClient, ActionServer
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String
from std_srvs.srv import SetBool

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
LISTENER = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def tell(what, value):
    # Printed with its line end in one call, because several threads print.
    print(json.dumps({what: value}) + "\n", end="", flush=True)


def serve_goal(handle):
    # The first feedback comes at once, before the client knows that its goal is accepted.
    for count in range(1, handle.request.order + 1):
        handle.publish_feedback(Fibonacci.Feedback(sequence=list(range(count))))
        time.sleep(handle.request.period_ms / 1000)
    handle.succeed()
    return Fibonacci.Result(sequence=[handle.request.order])


def answer(request, response):
    response.success, response.message = request.data, "robot"
    return response


def robot(node):
    nodes, kept = [node], []
    for name in ("lidar", "camera", "imu"):
        nodes.append(Node(name))
        kept.append(nodes[-1].create_publisher(String, "/t/static", LATCHED))
        kept[-1].publish(String(data=name))
    chat = node.create_publisher(String, "/t/chat", 10)
    node.create_timer(0.05, lambda: chat.publish(String(data="from the robot")))
    node.create_subscription(String, "/o/chat", lambda m: tell("robot heard", m.data), 10)
    node.create_service(SetBool, "/s/set", answer)
    kept.append(ActionServer(node, Fibonacci, "/a/count", serve_goal))
    for name in ("open", "secret"):
        of = Node(name)
        of.declare_parameter("value", 0)
        nodes.append(of)

    def change():
        for of in nodes[-2:]:
            value = of.get_parameter("value").value
            of.set_parameters([Parameter("value", value=value + 1)])

    node.create_timer(0.2, change)
    return nodes, kept


def act(node, client):
    while not client.server_is_ready():
        time.sleep(0.002)
    feedback, done = [], threading.Event()
    goal = Fibonacci.Goal(order=3, period_ms=100)
    sent = client.send_goal_async(goal, lambda m: feedback.append(len(m.feedback.sequence)))
    while not sent.done():
        time.sleep(0.01)
    time.sleep(1)
    result = sent.result().get_result_async()
    result.add_done_callback(lambda _: done.set())
    done.wait(10)
    tell("feedback", feedback)
    tell("result", list(result.result().result.sequence))


def call(node, client):
    client.wait_for_service()
    answered = client.call_async(SetBool.Request(data=True))
    while not answered.done():
        time.sleep(0.01)
    tell("answer", answered.result().message)


def operator(node):
    chat = node.create_publisher(String, "/o/chat", 10)
    node.create_timer(0.05, lambda: chat.publish(String(data="from the operator")))
    node.create_subscription(String, "/t/chat", lambda m: tell("chat", m.data), 10)
    node.create_subscription(String, "/t/static", lambda m: tell("static", m.data), LISTENER)
    node.create_subscription(
        ParameterEvent, "/parameter_events", lambda m: tell("event", m.node), 100
    )
    client = node.create_client(SetBool, "/s/set")
    action = ActionClient(node, Fibonacci, "/a/count")
    for work, of in ((call, client), (act, action)):
        threading.Thread(target=work, args=(node, of), daemon=True).start()
    return [node], [client, action]


def member(node):
    """One of many: a latched sample, and a topic of its own."""
    number = sys.argv[2]
    latched = node.create_publisher(String, "/t/static", LATCHED)
    latched.publish(String(data=number))
    own = node.create_publisher(String, f"/t/own{number}", 10)
    node.create_timer(0.1, lambda: own.publish(String(data=number)))
    return [node], [latched]


def listener(node):
    node.create_subscription(String, "/t/static", lambda m: tell("static", m.data), LISTENER)
    for number in range(int(sys.argv[2])):
        node.create_subscription(String, f"/t/own{number}", lambda m: tell("own", m.data), 10)
    return [node], []


ROLES = {"robot": robot, "operator": operator, "member": member, "listener": listener}


def main():
    rclpy.init()
    # Its own events would be among those that it prints.
    node = Node("_".join(sys.argv[1:]), start_parameter_services=False)
    nodes, kept = ROLES[sys.argv[1]](node)
    executor = MultiThreadedExecutor(4)
    for each in nodes:
        executor.add_node(each)
    tell("uses", rclpy.get_rmw_implementation_identifier())
    executor.spin()
    del kept


main()
