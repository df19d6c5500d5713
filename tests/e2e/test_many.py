"""Many clients on one server, many topics on one link."""

import time

import pytest
from connect_bridge_test_interfaces.msg import Blob
from std_msgs.msg import String

from conftest import OPEN
from graph import qos, until
from harness.domains import free_port


@pytest.mark.slow
def test_10_clients(domains, make_graph, make_side):
    """Each gets every message in order; the server takes each once."""
    robot_domain, *operator_domains = domains(11)
    port = free_port()
    login = {"auth": {"token": "a-token-for-many"}}
    server = make_side("server", robot_domain, {"listen": {"port": port}, **login, **OPEN})
    server.start().wait_listening()
    clients = [
        make_side(
            "client", d, {"url": f"ws://127.0.0.1:{port}", **login}, name=f"client{i}"
        ).start()
        for i, d in enumerate(operator_domains)
    ]
    robot = make_graph(robot_domain)
    publisher = robot.publisher(Blob, "/t/shared", qos(100))
    collectors = [make_graph(d).collector(Blob, "/t/shared", qos(100)) for d in operator_domains]
    for client in clients:
        client.wait_linked()

    def all_hear():
        publisher.publish(Blob())
        return all(c.messages for c in collectors)

    until(all_hear, "all ten hear something", 40, 0.1)
    time.sleep(0.5)
    for collector in collectors:
        collector.clear()
    for sequence in range(1, 101):
        publisher.publish(Blob(sequence=sequence, data=bytes(1000)))
        time.sleep(0.01)
    for collector in collectors:
        collector.wait(100)
        assert [m.sequence for m in collector.messages] == list(range(1, 101))
    ours = [s for s in robot.subscriptions("/t/shared") if s.node_name == "connect_server"]
    assert len(ours) == 1, "one subscription serves all clients"
    for side in (*clients, server):
        assert side.stop() == 0


@pytest.mark.slow
def test_300_topics(make_pair):
    """All exist on the far side with their types, and all carry."""
    pair = make_pair()
    kinds = {f"/t/many_{i}": (String, Blob)[i % 2] for i in range(300)}
    begin = time.monotonic()
    publishers = {name: pair.robot.publisher(kind, name) for name, kind in kinds.items()}

    def mirrored():
        return {n: t for n, t in pair.operator.topics().items() if n.startswith("/t/many_")}

    until(
        lambda: len(mirrored()) == 300, lambda: f"300 topics, there are {len(mirrored())}", step=0.1
    )
    print(f"300 topics after {time.monotonic() - begin:.1f} s")
    near = {n: t for n, t in pair.robot.topics().items() if n.startswith("/t/many_")}
    assert mirrored() == near
    collectors = {name: pair.operator.collector(kind, name) for name, kind in kinds.items()}

    def all_heard():
        silent = [name for name, c in collectors.items() if not c.messages]
        for name in silent:
            publishers[name].publish(kinds[name]())
        return not silent

    until(all_heard, "every topic carries", 40, 0.2)
    for publisher in publishers.values():
        pair.robot.tester.destroy_publisher(publisher)
    until(lambda: not mirrored(), lambda: f"all vanish, there are {len(mirrored())}", 40, 0.1)


@pytest.mark.slow
def test_300_nodes(make_pair):
    """The operator's graph lists them all, each with what it has; they go as they came."""
    pair = make_pair()
    publishers = {}
    for i in range(300):
        node = pair.robot.node(f"node_{i}", namespace="/many")
        publishers[node] = pair.robot.publisher(String, f"/t/of_node_{i}", 10, node)

    def listed():
        nodes = pair.operator.tester.get_node_names_and_namespaces()
        return sum(namespace == "/many" for _, namespace in nodes)

    until(lambda: listed() == 300, lambda: f"300 nodes, there are {listed()}", 60, 0.1)
    used, resident = pair.client.cpu_seconds(), pair.client.resident_bytes() / 1e6
    print(f"300 nodes: the client used {used:.1f} s of processor time and has {resident:.0f} MB")
    (mirror,) = pair.operator.wait_publishers("/t/of_node_7", 1)
    assert (mirror.node_namespace, mirror.node_name) == ("/many", "node_7")
    for node in publishers:
        pair.robot.remove(node)
    until(lambda: listed() == 0, lambda: f"all vanish, there are {listed()}", 60, 0.1)
