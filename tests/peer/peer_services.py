"""Shared by the tests of services: real services, and requests and responses as bytes."""

import struct

import rclpy.task
from rclpy.callback_groups import ReentrantCallbackGroup
from std_srvs.srv import SetBool

from peer_world import until

SET_BOOL, GET_PARAMETERS = "std_srvs/srv/SetBool", "rcl_interfaces/srv/GetParameters"
TRUE, FALSE = b"\0\1\0\0\1", b"\0\1\0\0\0"


def names_request(*names):
    """GetParameters_Request"""
    data = struct.pack("<I", len(names))
    for name in names:
        data += bytes(-len(data) % 4) + struct.pack("<I", len(name) + 1) + name.encode() + b"\0"
    return b"\0\1\0\0" + data


NO_VALUES = b"\0\1\0\0" + struct.pack("<I", 0)  # GetParameters_Response


def set_bool_response(success, text):
    return b"\0\1\0\0" + struct.pack("<BxxxI", success, len(text) + 1) + text.encode() + b"\0"


def answer_of(cdr):
    """success and message of a SetBool_Response"""
    success, size = struct.unpack_from("<BxxxI", cdr, 4)
    return bool(success), cdr[12 : 11 + size].decode()


def in_graph(world, act, *arguments):
    """Runs on the thread of the graph's callbacks, which otherwise might be using what is
    destroyed."""
    task = world.graph.tester.executor.create_task(act, *arguments)
    until(task.done, f"{act.__name__}")


class Service:
    """A real service. `hold`: it answers only on request."""

    def __init__(self, world, name, kind=SetBool, hold=False):
        self._world, self._node = world, world.graph.tester
        self.requests, self.held = [], []
        callback = self._held if hold else self._answered
        # In the node's own callback group a held call would block all others.
        group = ReentrantCallbackGroup()
        self._service = self._node.create_service(kind, name, callback, callback_group=group)

    def _answered(self, request, response):
        self.requests.append(request)
        if isinstance(response, SetBool.Response):
            response.success, response.message = request.data, f"number {len(self.requests)}"
        return response

    async def _held(self, request, response):
        future = rclpy.task.Future(executor=self._node.executor)
        self.held.append(future)
        self._answered(request, response)
        await future
        return response

    def go_on(self, index):
        self.held[index].set_result(None)

    def close(self):
        if self._service:
            in_graph(self._world, self._node.destroy_service, self._service)
        self._service = None


def attached(mine, name):
    return mine.attach(mine.find(name))


def result_of(future):
    until(future.done, "an answer")
    return future.result()


def ready(client, wanted=True):
    until(lambda: client.service_is_ready() == wanted, f"a service that is ready: {wanted}")


def flip(request):
    return set_bool_response(request[4:5] == b"\0", f"got {len(request)} bytes")


def caller_again(mine, channel, caller):
    count = len(mine.served[channel].got)
    future = caller.call_async(SetBool.Request(data=True))
    call, _ = mine.wait_requests(channel, count + 1)[-1]
    mine.respond(channel, call, set_bool_response(True, "again"))
    return future
