#!/usr/bin/env python3
"""Uses the parameter services of a node with rclpy's own client, as `ros2 param` does."""

import json
import sys

import rclpy
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient


def wait(node, future):
    rclpy.spin_until_future_complete(node, future, timeout_sec=10.0)
    if not future.done():
        raise RuntimeError("no answer")
    return future.result()


def plain(value):
    fields = ["", "bool", "integer", "double", "string", "byte_array", "bool_array",
              "integer_array", "double_array", "string_array"]
    if value.type == 0:
        return None
    held = getattr(value, fields[value.type] + "_value")
    return list(held) if "array" in fields[value.type] else held


def results(answer):
    return [[result.successful, result.reason] for result in answer.results]


def main():
    rclpy.init()
    node = rclpy.create_node("parameter_client")
    client = AsyncParameterClient(node, sys.argv[1])
    if not client.wait_for_services(timeout_sec=10.0):
        raise RuntimeError("no services")
    report = {}
    listed = wait(node, client.list_parameters())
    report["names"] = list(listed.result.names)
    listed = wait(node, client.list_parameters(prefixes=["listen"], depth=0))
    report["listen"] = list(listed.result.names)
    report["prefixes"] = list(listed.result.prefixes)
    names = ["listen.port", "rules", "rate", "verbose", "no_such"]
    report["values"] = [plain(v) for v in wait(node, client.get_parameters(names)).values]
    report["types"] = list(wait(node, client.get_parameter_types(names)).types)
    port = wait(node, client.describe_parameters(["listen.port"])).descriptors[0]
    report["port"] = [port.name, port.type, port.description, port.read_only,
                      port.additional_constraints, port.integer_range[0].from_value,
                      port.integer_range[0].to_value]

    def set_to(*parameters):
        return results(wait(node, client.set_parameters(list(parameters))))

    report["set"] = set_to(Parameter("rate", value=7), Parameter("rate", value="fast"),
                           Parameter("rate", value=5000.0), Parameter("listen.port", value=1),
                           Parameter("no_such", value=1), Parameter("rate", value=13.0))
    report["added"] = set_to(Parameter("rule.a.deny", value=["/x"]))
    request = SetParametersAtomically.Request()
    request.parameters = [Parameter("rate", value=3.0).to_parameter_msg(),
                          Parameter("verbose", value="no").to_parameter_msg()]
    service = node.create_client(SetParametersAtomically,
                                 sys.argv[1] + "/set_parameters_atomically")
    service.wait_for_service(10.0)
    result = wait(node, service.call_async(request)).result
    report["atomically"] = [result.successful, result.reason]
    report["after"] = [plain(v) for v in
                       wait(node, client.get_parameters(["rate", "verbose", "rule.a.deny"])).values]
    report["deleted"] = results(wait(node, client.delete_parameters(["rule.a.deny", "rate"])))
    report["sim"] = set_to(Parameter("use_sim_time", value=True))
    print(json.dumps(report))
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
