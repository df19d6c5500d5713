"""`ctl ping`, `ctl bench` and /diagnostics: how good a link is, what a side tells of itself."""

import json
import subprocess
import xml.etree.ElementTree as xml

import pytest
import yaml
from std_msgs.msg import String

from conftest import OPEN
from graph import until
from harness.domains import free_port
from harness.programs import build_dir


def ctl(*words, timeout=60):
    return subprocess.run(
        [build_dir() / "ctl", *map(str, words)], capture_output=True, text=True, timeout=timeout
    )


@pytest.fixture
def pair(make_pair):
    return make_pair()


def test_ping_measures_and_leaves_nothing(pair):
    made = ctl("ping", pair.client.parameters_file, "--seconds", 2, "--interval", 0.05)
    assert made.returncode == 0, made.stderr
    assert "TCP segments sent again: " in made.stdout
    assert "the server's clock: " in made.stdout
    answers = int(made.stdout.split(" answers in ")[0].splitlines()[-1])
    assert 20 <= answers <= 60
    as_json = ctl("ping", pair.client.parameters_file, "--seconds", 1, "--json")
    (span,) = json.loads(as_json.stdout)["spans"]
    assert 0 < span["round_trip_ms"]["least"] <= span["round_trip_ms"]["median"] < 1000
    assert abs(span["clock"]["offset_ms"]) < 100  # one machine
    until(
        lambda: [link["node"] for link in pair.server.status()["links"]] == ["/connect_client"],
        "the link of the tool is gone",
    )
    assert pair.client.text().count(": connected to") == 1


def test_bench_sends_and_receives_what_the_login_may(pair, tmp_path):
    publisher = pair.robot.publisher(String, "/t/load")
    timer = pair.robot.tester.create_timer(
        0.02, lambda: publisher.publish(String(data="x" * 5000))
    )
    svg = tmp_path / "bench.svg"
    try:
        made = ctl("bench", pair.client.parameters_file, "--seconds", 2, "--rate", 200_000,
                   "--topic", "/t/load", "--json", "--svg", svg)
    finally:
        timer.cancel()
    assert made.returncode == 0, made.stderr
    spans = {span["span"]: span for span in json.loads(made.stdout)["spans"]}
    assert list(spans) == ["idle", "sending", "receiving", "sending, receiving"]
    assert spans["idle"]["sent_bytes"] == spans["idle"]["received_bytes"] == 0
    for name in ("sending", "sending, receiving"):
        assert 100_000 < spans[name]["sent_bytes"] <= 450_000, spans[name]
    for name in ("receiving", "sending, receiving"):
        assert spans[name]["received_bytes"] > 100_000, spans[name]
    for span in spans.values():
        assert span["answers"] > 5
    texts = [element.text for element in xml.parse(svg).iter() if element.text]
    assert {"idle", "sending", "receiving"} <= set(texts)


def test_bench_receives_nothing_without_a_right(pair):
    pair.robot.publisher(String, "/secret")
    made = ctl("bench", pair.client.parameters_file, "--seconds", 1, "--topic", "/secret")
    assert made.returncode == 0
    assert "offers none of the topics" in made.stderr
    assert "receiving " not in made.stdout.split("Round trips")[0]


@pytest.mark.parametrize("command", ["ping", "bench"])
def test_what_is_wrong_is_said(command, tmp_path):
    file = tmp_path / "client.yaml"
    file.write_text("connect_client: {ros__parameters: {urll: x}}")
    made = ctl(command, file)
    assert made.returncode == 2 and "urll" in made.stderr
    parameters = {"url": f"ws://127.0.0.1:{free_port()}/", "auth": {"token": "a-token-for-one-run"}}
    file.write_text(yaml.safe_dump({"connect_client": {"ros__parameters": parameters}}))
    made = ctl(command, file)
    assert made.returncode == 1 and "refused" in made.stderr
    assert not made.stdout


def test_ping_with_a_wrong_token_says_so(pair, tmp_path):
    parameters = {**pair.client.parameters, "auth": {"token": "the-token-of-somebody-else"}}
    file = tmp_path / "wrong.yaml"
    file.write_text(yaml.safe_dump({"connect_client": {"ros__parameters": parameters}}))
    made = ctl("ping", file)
    assert made.returncode == 1
    assert "login" in made.stderr


def test_a_robot_tells_the_operator_its_diagnostics(make_pair):
    """Its package is not needed: an importer's side knows the type by its name."""
    rule = {**OPEN["rule"]["all"]}
    rule["export_topics"] = [*rule["export_topics"], "/diagnostics"]
    pair = make_pair(server={"rules": ["all"], "rule": {"all": rule}})

    def publish(graph):
        return sorted(info.node_name for info in graph.publishers("/diagnostics"))

    until(lambda: publish(pair.robot) == ["connect_server"], lambda: str(publish(pair.robot)))
    # Its own, and that of the robot.
    until(lambda: len(publish(pair.operator)) == 2, lambda: str(publish(pair.operator)))
    until(
        lambda: "/diagnostics" in [t["topic"] for link in pair.client.status().get("links", ())
                                   for t in link["topics"]],
        "the operator's side has it",
    )
    made = ctl("bench", pair.client.parameters_file, "--seconds", 3, "--topic", "/diagnostics",
               "--json")
    spans = {span["span"]: span for span in json.loads(made.stdout)["spans"]}
    assert spans["idle"]["received_bytes"] == 0
    assert spans["receiving"]["received_bytes"] > 500, "it is told once a second to who listens"
