"""An action server and client for tests, and a goal as its client sees it."""

import time

from connect_bridge_test_interfaces.action import Fibonacci
from rclpy.action import ActionClient, ActionServer, CancelResponse
from rclpy.callback_groups import ReentrantCallbackGroup

from graph import WAIT, until


class FibonacciServer:
    """Takes every goal, and can be cancelled."""

    def __init__(self, graph, name, node=None):
        self.goals = 0
        self._graph, self._name, self._node = graph, name, node or graph.tester
        self._server = None
        self.start()

    def start(self):
        with self._graph.still():
            self._server = ActionServer(
                self._node,
                Fibonacci,
                self._name,
                self._execute,
                cancel_callback=lambda _: CancelResponse.ACCEPT,
                callback_group=ReentrantCallbackGroup(),
            )

    def stop(self):
        with self._graph.still():
            self._server.destroy()

    def _execute(self, handle):
        self.goals += 1
        sequence = [0, 1]
        for _ in range(handle.request.order - 1):
            if handle.is_cancel_requested:
                handle.canceled()
                return Fibonacci.Result(sequence=sequence)
            sequence.append(sequence[-1] + sequence[-2])
            handle.publish_feedback(Fibonacci.Feedback(sequence=sequence))
            time.sleep(handle.request.period_ms / 1000)
        handle.succeed()
        return Fibonacci.Result(sequence=sequence)


class Client(ActionClient):
    """A client that its graph's executor sees as a whole or not at all."""

    def __init__(self, graph, name, node=None):
        self.still = graph.still
        with self.still():
            super().__init__(node or graph.tester, Fibonacci, name)

    def destroy(self):
        with self.still():
            super().destroy()


class Goal:
    """One goal as its client sees it."""

    def __init__(self, client, order, period_ms=20):
        self.feedback = []
        self._still = client.still
        goal = Fibonacci.Goal(order=order, period_ms=period_ms)
        with self._still():
            self._sent = client.send_goal_async(
                goal, lambda message: self.feedback.append(list(message.feedback.sequence))
            )
        self._result = None

    def sent(self):
        return self._sent.done()

    @property
    def handle(self):
        until(self._sent.done, "the goal is answered", step=0.001)
        return self._sent.result()

    def result(self, timeout=WAIT):
        if self._result is None:
            handle = self.handle
            with self._still():
                self._result = handle.get_result_async()
        until(self._result.done, "a result", timeout, step=0.002)
        return self._result.result()

    def cancel(self):
        handle = self.handle
        with self._still():
            future = handle.cancel_goal_async()
        until(future.done, "an answer to the cancelling", step=0.002)
        return future.result()
