"""What depends on the middleware, with one of its own on each side: robot's graph and server,
client and operator's graph. The whole suite runs under one RMW by CONNECT_BRIDGE_RMW, or with one
for each side (tools/harness/middleware.py)."""

import collections
import json
import pathlib
import sys
import time

import pytest

from graph import until
from lacking import TEST_PACKAGE, take_away
from harness.domains import free_port
from harness.middleware import rmw_environment
from harness.programs import Bridge, Program, ros_environment

PARTS = 2
RMWS = ("rmw_fastrtps_cpp", "rmw_cyclonedds_cpp", "rmw_zenoh_cpp")
NODES = pathlib.Path(__file__).with_name("rmw_nodes.py")
RULES = {
    "rules": ["all"],
    "rule": {
        "all": {
            "export_topics": ["/t/**"],
            "import_topics": ["/o/**"],
            "export_services": ["/s/**"],
            "export_actions": ["/a/**"],
            "parameters": ["/open"],
        }
    },
}


def told(program):
    """What a process of rmw_nodes.py has printed, by kind."""
    heard = collections.defaultdict(list)
    for line in program.text().splitlines():
        if line.startswith("{"):
            (what, value), *_ = json.loads(line).items()
            heard[what].append(value)
    return heard


class World:
    """Both graphs, a bridge, and a second bridge on request."""

    def __init__(self, folder, domains, rmws, second=False, lacking=(), members=0):
        """members: so many processes that join at once and a listener, not robot and operator."""
        self.bridges = []
        environments = [rmw_environment(rmw) for rmw in rmws]
        for number in range(2 if second else 1):
            within = folder / str(number)
            within.mkdir()
            bridge = Bridge(*domains, free_port(), RULES, folder=within)
            for side, environment in zip(bridge.sides, environments):
                side.env.update(environment)
                if lacking:
                    take_away(lacking, side)
            self.bridges.append(bridge)

        def program(at, *role):
            env = ros_environment(domains[at], **environments[at])
            return Program("_".join(role), [sys.executable, "-B", NODES, *role], env, folder)

        self.members = [program(0, "member", str(number)) for number in range(members)]
        if members:
            self.operator = program(1, "listener", str(members))
            self.programs = [self.operator]
        else:
            self.programs = [program(0, "robot"), program(1, "operator")]
            self.robot, self.operator = self.programs

    def start(self):
        for bridge in self.bridges:
            bridge.start()
        for program in self.programs:
            program.start().wait_for('"uses"', 60)
        for program in self.members:
            program.start()
        return self

    def stop(self):
        for program in [*self.programs, *self.members]:
            program.kill()
        return [problem for bridge in self.bridges for problem in bridge.stop()]


@pytest.fixture
def make_world(tmp_path, domains):
    made = []

    def make(rmws, **options):
        for rmw in rmws:
            if rmw_environment(rmw) is None:
                pytest.skip(f"NOT TESTED: there is no {rmw}")
        made.append(World(tmp_path, domains(2), rmws, **options))
        return made[-1].start()

    yield make
    for world in made:
        problems = world.stop()
        for program in [*world.programs, *(s for b in world.bridges for s in b.sides)]:
            print(f"---- {program.name} ----\n{program.text(whole=True)[-6000:]}", file=sys.stderr)
        assert not problems


PAIRS = [(robot, operator) for robot in RMWS for operator in RMWS]


def short(rmw):
    return rmw.split("_")[1]


@pytest.mark.slow
@pytest.mark.parametrize("rmws", PAIRS, ids=lambda pair: "_".join(map(short, pair)))
def test_all_kinds_cross(make_world, rmws):
    found = all_kinds_cross(make_world(rmws, second=False), rmws)
    assert sorted(found["static"]) == ["camera", "imu", "lidar"], "latched samples, each once"
    assert found["feedback"] == [[1, 2, 3]], "the first feedback included"


@pytest.mark.slow
@pytest.mark.parametrize("rmw", RMWS, ids=short)
def test_topics_of_types_that_are_not_installed(make_world, rmw):
    """Both ways, volatile and latched. An action crosses as well, or the exporter's log says what
    to install."""
    world = make_world((rmw, rmw), lacking=("std_msgs", TEST_PACKAGE))
    heard = lambda: told(world.operator)  # noqa: E731
    until(lambda: len(heard()["static"]) == 3, lambda: f"latched; heard {dict(heard())}", 40)
    until(lambda: heard()["chat"] and heard()["answer"], lambda: f"all; heard {dict(heard())}", 20)
    until(lambda: told(world.robot)["robot heard"], "a message of the operator", 20)
    missing = f"the type {TEST_PACKAGE}/action/Fibonacci is not known here: install the package"
    bridge = world.bridges[0]
    crosses = rmw == "rmw_fastrtps_cpp"
    if crosses:
        until(lambda: heard()["result"], lambda: f"a result; heard {dict(heard())}", 40)
    else:
        until(lambda: missing in bridge.server.text(), "what to install", 20)
    assert sorted(heard()["static"]) == ["camera", "imu", "lidar"], "each once"
    for side in bridge.sides:
        assert "type std_msgs/msg/String is not installed here" in side.text()
        if rmw != "rmw_zenoh_cpp":  # where the action's messages could be had
            made = 1 + 5 if crosses else 1
            until(lambda: side.status()["types_not_installed"] == made, side.text)  # noqa: B023


# Two bridges decide by timing which of them feeds a mirror: on a busy machine both may for a
# moment, or none.
@pytest.mark.slow
@pytest.mark.alone
@pytest.mark.parametrize("rmws", PAIRS, ids=lambda pair: "_".join(map(short, pair)))
def test_all_kinds_cross_beside_another_bridge(make_world, rmws):
    found = all_kinds_cross(make_world(rmws, second=True), rmws)
    assert set(found["static"]) == {"camera", "imu", "lidar"}
    (feedback,) = found["feedback"]
    assert feedback == [1, 2, 3][3 - len(feedback) :]


@pytest.mark.slow
@pytest.mark.parametrize("rmw", RMWS, ids=short)
def test_many_nodes_that_join_at_once(make_world, rmw):
    """13 processes: the latched sample and the topic of each arrive."""
    begin = time.monotonic()
    world = make_world((rmw, rmw), members=13)
    names = {str(number) for number in range(13)}
    heard = lambda: told(world.operator)  # noqa: E731
    what = lambda: f"all; heard { {k: sorted(set(v)) for k, v in heard().items()} }"  # noqa: E731
    until(lambda: names == set(heard()["own"]) == set(heard()["static"]), what, 60, step=0.1)
    print(f"{rmw}: all are heard {time.monotonic() - begin:.1f} s after the bridge's start")
    time.sleep(1)  # in which a duplicate would have come
    assert sorted(heard()["static"]) == sorted(names), "latched samples, each once"
    # Before its readers are killed: each of Cyclone's writers would wait 1 s for a dead one.
    assert not world.bridges[0].stop()


def all_kinds_cross(world, rmws):
    heard = lambda: told(world.operator)  # noqa: E731
    until(lambda: heard()["result"], lambda: f"a result; heard {dict(heard())}", 40)
    until(lambda: heard()["chat"] and heard()["answer"], lambda: f"all; heard {dict(heard())}", 20)
    until(lambda: told(world.robot)["robot heard"], "a message of the operator", 20)
    until(lambda: "/open" in heard()["event"], "an event of the node that a rule opens", 20)
    time.sleep(1)  # in which a duplicate would have come
    found = heard()
    assert [told(p)["uses"] for p in world.programs] == [[rmw] for rmw in rmws]
    assert found["answer"] == ["robot"]
    assert found["result"] == [[3]]
    assert set(found["event"]) == {"/open"}, "no event of a node that no rule opens"
    return found
