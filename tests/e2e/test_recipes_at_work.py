"""Recipes of docs/recipes.md that are more than rules, at work: stand-ins for twist_mux,
foxglove_bridge and rosbag2 do what the page says of them, with the page's own files."""

import collections
import contextlib
import itertools
import re
import ssl
import threading
import time

import pytest
from geometry_msgs.msg import Twist
from std_msgs.msg import Bool, String
from std_srvs.srv import Trigger
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect as open_websocket
from websockets.sync.server import serve

from calls import Caller
from graph import until
from harness.domains import free_port
from proxies import Nginx
from recipes import PAGE, recipes
from relay import Relay
from twist_mux import TwistMux

PARTS = 2
RECIPES = recipes()


def shown(mark):
    """The block of the page below this mark."""
    text = PAGE.read_text(encoding="utf-8")
    return re.search(rf"<!-- {mark} -->\n```\w+\n(.*?)^```$", text, re.M | re.S)[1]


def twist(speed):
    message = Twist()
    message.linear.x = speed
    return message


@pytest.fixture
def repeating():
    """repeating(publisher, message, period): publishes what `message()` returns, unless it is None,
    until the test ends."""
    done = threading.Event()
    threads = []

    def start(publisher, message, period=0.05):
        def run():
            while not done.wait(period):
                if (said := message()) is not None:
                    publisher.publish(said)

        threads.append(threading.Thread(target=run, daemon=True))
        threads[-1].start()

    yield start
    done.set()
    for thread in threads:
        thread.join()


class Base:
    """What reaches the robot's base."""

    def __init__(self, graph):
        self.commands = graph.collector(Twist, "/cmd_vel")

    def moves(self, speed=None):
        self.commands.clear()
        self.commands.wait_for(
            lambda m: m.linear.x == speed if speed else m.linear.x != 0, "a command that moves"
        )

    def stands_still(self, seconds=1.0):
        time.sleep(0.2)  # what is on its way
        self.commands.clear()
        time.sleep(seconds)
        assert not self.commands.messages


def test_supervision_of_autonomy(relayed, repeating):
    """The robot drives while somebody far away agrees: not before, and not after anything that
    lies between them has ended."""
    pair, relay = relayed(server=RECIPES["supervision"].at_a_pair())
    mux = TwistMux(pair.robot, shown("twist_mux: supervision"))
    base = Base(pair.robot)
    repeating(pair.robot.publisher(Twist, "/cmd_vel_nav"), lambda: twist(0.3))
    base.stands_still()
    word = {"stop": False}
    agrees = pair.operator.publisher(Bool, "/supervisor/stop")
    repeating(
        agrees, lambda: None if word["stop"] is None else Bool(data=word["stop"]), period=0.1
    )
    base.moves()
    word["stop"] = True
    until(lambda: mux.is_locked("supervisor"), "the lock")
    base.stands_still()
    word["stop"] = False
    base.moves()
    relay.stall()
    until(lambda: mux.is_locked("supervisor"), "the lock of a link that is silent", 5)
    base.stands_still()
    word["stop"] = None  # nothing of before the break moves the robot after it
    time.sleep(1)
    relay.heal(keep=True)
    base.stands_still()
    word["stop"] = False
    base.moves()
    pair.server.kill()
    until(lambda: mux.is_locked("supervisor"), "the lock without a bridge", 5)
    base.stands_still()
    pair.server.start().wait_listening()


def test_nav2_on_the_robot_drives_too(relayed, repeating):
    pair, relay = relayed(server=RECIPES["mux"].at_a_pair())
    TwistMux(pair.robot, shown("twist_mux: mux"))
    base = Base(pair.robot)
    held = {"speed": None}
    repeating(pair.robot.publisher(Twist, "/cmd_vel_nav"), lambda: twist(0.1))
    stick = pair.operator.publisher(Twist, "/cmd_vel_remote", 1)
    repeating(stick, lambda: held["speed"] and twist(held["speed"]))
    base.moves(0.1)
    held["speed"] = 0.5
    base.moves(0.5)
    held["speed"] = None
    base.moves(0.1)
    held["speed"] = 0.6
    base.moves(0.6)
    relay.stall()
    base.moves(0.1)
    held["speed"] = None
    time.sleep(1)
    relay.heal(keep=True)
    base.commands.clear()
    time.sleep(1)
    assert {m.linear.x for m in base.commands.messages} == {0.1}, "an old command drives"


class FoxgloveBridge:
    """A stand-in for foxglove_bridge, without its protocol: it subscribes to the topic that a
    viewer names, while a viewer has it open, and gives each viewer all that arrives."""

    def __init__(self, graph):
        self._graph = graph
        self._lock = threading.Lock()
        self._open = collections.Counter()
        self._collectors = {}
        self.port = free_port()
        self._server = serve(self._serve, "127.0.0.1", self.port)
        threading.Thread(target=self._server.serve_forever, daemon=True).start()

    def _serve(self, viewer):
        topic = viewer.recv()
        with self._lock:
            self._open[topic] += 1
            if topic not in self._collectors:
                self._collectors[topic] = self._graph.collector(String, topic, 1000)
            collector = self._collectors[topic]
        given = len(collector.messages)
        viewer.send("open")
        with contextlib.suppress(Exception):  # the viewer is gone
            while True:
                for message in collector.messages[given:]:
                    viewer.send(message.data)
                    given += 1
                with contextlib.suppress(TimeoutError):
                    viewer.recv(0.02)
        with self._lock:
            self._open[topic] -= 1
            if not self._open[topic]:
                self._collectors.pop(topic).close()

    def close(self):
        self._server.shutdown()


class NginxAtTheDesk(Nginx):
    block = "nginx_at_the_desk"

    def shown(self):
        text = shown("proxy: viewers")
        changes = {
            "443": self.changes["443"],
            "8765": self.changes["9090"],
            "desk.example": "localhost",
            "/etc/ssl/desk.crt": self.changes["/etc/ssl/robot.crt"],
            "/etc/ssl/desk.key": self.changes["/etc/ssl/robot.key"],
        }
        for old, new in changes.items():
            assert old in text, old
            text = re.sub(rf"(?<![\w.]){re.escape(old)}(?!\w)", new, text)
        return text


def test_several_viewers_by_one_upload(make_pair, authority, tmp_path, repeating):
    pair = make_pair(server=RECIPES["nav2"].at_a_pair())
    bridge = FoxgloveBridge(pair.operator)
    proxy = NginxAtTheDesk.made(tmp_path, free_port(), bridge.port, authority)
    proxy.start()
    context = ssl.create_default_context(cafile=str(authority / "ca.pem"))
    path = re.search(r"location = (/\S+) ", shown("proxy: viewers"))[1]

    def viewer(path=path):
        return open_websocket(f"wss://localhost:{proxy.port}{path}", ssl=context)

    numbers = itertools.count(1)
    published = []

    def scan():
        published.append(str(next(numbers)))
        return String(data=published[-1])

    viewers = []
    try:
        with pytest.raises(InvalidStatus):
            viewer("/viewers-guessed")
        scans = pair.robot.publisher(String, "/scan", 1000)
        repeating(pair.robot.publisher(String, "/plan", 1000), scan)
        for _ in range(5):
            viewers.append(viewer())
            viewers[-1].send("/scan")
            assert viewers[-1].recv(20) == "open"
        until(scans.get_subscription_count, "the demand")
        until(lambda: pair.server.topic("/scan", "export"), "the status")
        for number in range(20):
            scans.publish(String(data=f"scan {number}"))
        seen = [[one.recv(20) for _ in range(20)] for one in viewers]
        assert seen == [[f"scan {number}" for number in range(20)]] * 5
        until(lambda: pair.server.topic("/scan", "export")["messages"] >= 20, "the count")
        assert pair.server.topic("/scan", "export")["messages"] == 20, "one upload for all"
        assert pair.server.topic("/plan", "export")["messages"] == 0 and published
        assert len(pair.server.status()["links"]) == 1
        for one in viewers:
            one.close()
        until(lambda: not scans.get_subscription_count(), "nobody views, nothing is sent")
    finally:
        for one in viewers:
            one.close()
        proxy.stop()
        bridge.close()


class Modem:
    """A client of the robot by a way of its own."""

    def __init__(self, pair, client, port):
        self.client = client
        self.way = Relay(port)
        shown = RECIPES["modems at the client"].nodes()[f"/{client.name}"]["ros__parameters"]
        own = {"url": f"ws://127.0.0.1:{self.way.port}", "auth": pair.client.parameters["auth"]}
        parameters = {**client.parameters, **shown, **own}
        del parameters["tls"]
        client.set_parameters(parameters)

    def fed(self, topic, direction):
        return self.client.topic(topic, direction).get("messages", 0)


@pytest.mark.alone
def test_two_modems(make_pair, make_side, repeating):
    """The robot's way that feeds falls silent: the other one goes on, in both directions."""
    pair = make_pair(server=RECIPES["modems"].at_a_pair(), start=False)
    server, robot, operator = pair.server, pair.operator, pair.robot
    server.start().wait_listening()
    names = ("modem_a", "modem_b")
    modems = []
    for name in names:
        words = ["--ros-args", "-r", f"__node:={name}", "--"]
        side = make_side("client", robot.domain, {}, name=name, node=name, arguments=words)
        modems.append(Modem(pair, side, pair.bridge.port))
    numbers = itertools.count()
    repeating(robot.publisher(String, "/scan", 100), lambda: String(data=str(next(numbers))), 0.02)
    stick = operator.publisher(Twist, "/cmd_vel", 1)
    scans = operator.collector(String, "/scan", 1000)
    commands = robot.collector(Twist, "/cmd_vel", 1000)
    try:
        for modem in modems:
            modem.client.start().wait_linked()
        repeating(stick, lambda: twist(0.5), 0.02)
        scans.wait(50)
        commands.wait(50)
        time.sleep(3)  # until they know each other
        before = [modem.fed("/scan", "export") for modem in modems]
        until(lambda: sum(m.fed("/scan", "export") for m in modems) > sum(before) + 50, "a feeder")
        gained = [m.fed("/scan", "export") - had for m, had in zip(modems, before)]
        feeder = modems[gained.index(max(gained))]
        scans.clear()
        commands.clear()
        scans.wait(20)
        commands.wait(20)
        feeder.way.stall()
        cut = time.monotonic()
        for collector, what in ((scans, "/scan"), (commands, "/cmd_vel")):
            until(lambda c=collector: c.times[-1] > cut + 2, f"{what} goes on", 20)
            until(lambda c=collector: time.monotonic() - c.times[-1] < 0.2, f"{what} is steady", 20)
            gap = max(b - a for a, b in itertools.pairwise(collector.times))
            print(f"{what}: {gap:.2f} s without a message")
            assert gap < 5
        assert len([m.data for m in scans.messages]) == len({m.data for m in scans.messages})
    finally:
        for modem in modems:
            modem.client.stop()
            modem.way.close()
        server.stop()


class Recorder:
    """A stand-in for rosbag2 in its snapshot mode; its service has another type."""

    def __init__(self, graph, topic):
        self.kept = collections.deque(maxlen=1000)
        self.bags = []
        graph.tester.create_subscription(String, topic, lambda m: self.kept.append(m.data), 100)
        graph.tester.create_service(Trigger, "/rosbag2_recorder/snapshot", self._snapshot)

    def _snapshot(self, _, response):
        self.bags.append(list(self.kept))
        self.kept.clear()
        response.success = True
        return response


def test_record_a_drive(make_pair):
    """What was seen at the robot alone is in the bag, from before the call on."""
    pair = make_pair(server=RECIPES["record"].at_a_pair())
    recorder = Recorder(pair.robot, "/camera/image_raw")
    camera = pair.robot.publisher(String, "/camera/image_raw", 100)
    trigger = Caller(pair.operator, "/rosbag2_recorder/snapshot", Trigger).wait_ready()
    until(camera.get_subscription_count, "the recorder")
    for number in range(10):
        camera.publish(String(data=f"picture {number}"))
    until(lambda: len(recorder.kept) == 10, "what it keeps")
    assert trigger.call(Trigger.Request()).success
    assert recorder.bags == [[f"picture {number}" for number in range(10)]]
    assert "/camera/image_raw" not in pair.operator.topics()
