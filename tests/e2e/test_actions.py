"""Actions: goals, feedback, status, cancelling and results, by rclpy's own server and client."""

import signal
import time

import pytest
from action_msgs.msg import GoalStatus

from actions import Client, FibonacciServer, Goal
from calls import OPEN_CALLS, servers_graph
from graph import until
from lacking import services_of_any_type

pytestmark = services_of_any_type
SERVER = OPEN_CALLS


@pytest.fixture
def action(request):
    return "/a/" + "".join(c if c.isalnum() else "_" for c in request.node.name)


@pytest.fixture
def served(pair, robot, action):
    """(server, client) of an action that is ready."""
    server = FibonacciServer(robot, action)
    client = Client(pair.operator, action)
    until(client.server_is_ready, "the action is ready", step=0.002)
    yield server, client
    client.destroy()
    server.stop()


def fibonacci(count):
    sequence = [0, 1]
    while len(sequence) < count:
        sequence.append(sequence[-1] + sequence[-2])
    return sequence


def test_goal_feedback_and_result(served):
    """Also the first feedback of a goal that is sent as soon as the server is ready."""
    _, client = served
    goal = Goal(client, 10)
    assert goal.handle.accepted
    # Before the result is asked for: rclpy drops the feedback that it takes after a result.
    until(lambda: fibonacci(11) in goal.feedback, lambda: f"feedback, got {goal.feedback}")
    assert len(goal.feedback) >= 8
    assert goal.feedback == sorted(goal.feedback, key=len), "feedback out of order"
    answer = goal.result()
    assert answer.status == GoalStatus.STATUS_SUCCEEDED
    assert list(answer.result.sequence) == fibonacci(11)


def test_status(served):
    _, client = served
    goal = Goal(client, 10, period_ms=50)
    until(lambda: goal.handle.status == GoalStatus.STATUS_EXECUTING, "executing")
    goal.result()
    until(lambda: goal.handle.status == GoalStatus.STATUS_SUCCEEDED, "succeeded")


def test_cancel_one_of_three(served):
    _, client = served
    goals = [Goal(client, 30, period_ms) for period_ms in (30, 200, 30)]
    for goal in goals:
        assert goal.handle.accepted
    assert len(goals[1].cancel().goals_canceling) == 1
    assert goals[1].result().status == GoalStatus.STATUS_CANCELED
    for goal in (goals[0], goals[2]):
        assert goal.result().status == GoalStatus.STATUS_SUCCEEDED


def test_several_clients_and_goals_at_once(pair, served, action):
    """Each client gets its own results and feedback."""
    _, first = served
    others = [Client(pair.operator, action, pair.operator.node(f"client_{n}")) for n in range(2)]
    for client in others:
        until(client.server_is_ready, "the action is ready")
    goals = {}
    for number, client in enumerate((first, *others)):
        for order in range(3, 6):  # nine: a server's queue holds ten
            goals[number, order] = Goal(client, order)
    for (_, order), goal in goals.items():
        answer = goal.result()
        assert answer.status == GoalStatus.STATUS_SUCCEEDED
        assert list(answer.result.sequence) == fibonacci(order + 1)
        assert all(f == fibonacci(len(f)) for f in goal.feedback)
        assert len(goal.feedback) <= order - 1
    for client in others:
        client.destroy()


@pytest.mark.alone
def test_ready_as_a_whole_or_not_at_all(pair, robot, action):
    """The parts of an action come and go together, and within 200 ms."""
    server = FibonacciServer(robot, action)
    client = Client(pair.operator, action)
    until(client.server_is_ready, "ready")
    gone = []
    for _ in range(3):
        begin = time.monotonic()
        server.stop()
        until(lambda: not client.server_is_ready(), "not ready", step=0.002)
        gone.append(time.monotonic() - begin)
        server.start()
        until(client.server_is_ready, "ready again", step=0.002)
        assert Goal(client, 3, period_ms=1).result().status == GoalStatus.STATUS_SUCCEEDED
    assert sorted(gone)[1] < 0.3, f"not ready after {gone} s"
    client.destroy()
    server.stop()


def works(goal, timeout=1.0):
    """Whether the goal is accepted and succeeds soon. A goal that a dead mirror took does not."""
    try:
        until(goal.sent, "the goal is answered", timeout)
        return goal.result(timeout).status == GoalStatus.STATUS_SUCCEEDED
    except AssertionError:
        return False


@pytest.mark.slow
@pytest.mark.parametrize("which", ["server", "client"])
def test_a_side_is_killed_during_goals(make_pair, which):
    """The goals run on at the robot; a new goal works as soon as the bridge is back."""
    pair = make_pair(server=OPEN_CALLS)
    robot = servers_graph(pair, 8)
    try:
        server = FibonacciServer(robot, "/a/killed")
        client = Client(pair.operator, "/a/killed")
        until(client.server_is_ready, "ready")
        goals = [Goal(client, 46, period_ms=100) for _ in range(3)]
        assert all(goal.handle.accepted for goal in goals)
        side = getattr(pair, which)
        side.kill()
        side.start()
        pair.client.wait_linked()
        end = time.monotonic() + 40  # the dead process's endpoints leave with their lease
        while not works(Goal(client, 3, period_ms=1)):
            assert time.monotonic() < end, "no goal works after the kill"
        assert server.goals >= 4
    finally:
        robot.close()


def cancelling(seconds):
    rule = {**OPEN_CALLS["rule"]["all"], "cancel_after": seconds}
    return {"rules": ["all"], "rule": {"all": rule}}


def test_a_goal_of_a_link_that_does_not_come_back_is_cancelled(make_pair):
    """And its caller gets that result, if the link comes back later."""
    pair = make_pair(server=cancelling(1.5))
    robot = servers_graph(pair, 4)
    server = FibonacciServer(robot, "/a/cancelled")
    client = Client(pair.operator, "/a/cancelled")
    until(client.server_is_ready, "the action is ready", step=0.002)
    goal = Goal(client, 40, period_ms=500)
    assert goal.handle.accepted
    with client.still():
        goal._result = goal.handle.get_result_async()
    time.sleep(0.5)
    pair.client.process.send_signal(signal.SIGSTOP)
    try:
        pair.server.wait_for("asks to cancel a goal of", 20)
        time.sleep(1)
    finally:
        pair.client.process.send_signal(signal.SIGCONT)
    assert goal.result(30).status == GoalStatus.STATUS_CANCELED
    assert server.goals == 1
    client.destroy()
    server.stop()
    robot.close()
