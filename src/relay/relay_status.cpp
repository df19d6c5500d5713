#include "relay/relay_status.hpp"

#include "core/base/json.hpp"
#include "core/base/metrics_text.hpp"

namespace connect_bridge {
namespace {

constexpr int kRelayStatusSchema = 1;

OrderedJson use_of(const RelayUse& use) {
  return {{"pairs", use.pairs},
          {"visitors", use.visitors},
          {"sent_bytes", use.to_robot},
          {"received_bytes", use.to_visitors}};
}

}  // namespace

std::string_view name_of(RelayRefusal refusal) {
  switch (refusal) {
    case RelayRefusal::kNoClientHello: return "no_client_hello";
    case RelayRefusal::kTooLate: return "too_late";
    case RelayRefusal::kGaveWay: return "gave_way";
    case RelayRefusal::kHandshakes: return "handshakes_dropped";
    case RelayRefusal::kNoTls: return "no_tls";
    case RelayRefusal::kWrongLogin: return "wrong_logins";
    case RelayRefusal::kNoSuchRobot: return "no_such_robot";
    case RelayRefusal::kRobotFull: return "robot_full";
    case RelayRefusal::kVisitorsOfSource: return "visitors_of_address";
    case RelayRefusal::kVisitorsOfRobot: return "visitors_of_robot";
    case RelayRefusal::kRobotSilent: return "robot_silent";
    case RelayRefusal::kWrongTicket: return "wrong_ticket";
    case RelayRefusal::kTwin: return "token_in_use";
  }
  return "unknown";
}

std::string to_json(const RelayStatus& status, bool in_lines, bool with_peers) {
  OrderedJson refused = OrderedJson::object();
  for (std::size_t i = 0; i < kRelayRefusals; ++i)
    refused[std::string(name_of(static_cast<RelayRefusal>(i)))] = status.refused[i];
  OrderedJson json = {{"schema", kRelayStatusSchema},
                      {"time", status.time},
                      {"running", true},
                      {"started", status.started},
                      {"version", status.version},
                      {"node", "relay"},
                      {"role", "relay"},
                      {"strangers", {{"accepted", status.accepted}, {"waiting", status.waiting}}},
                      {"refused", std::move(refused)},
                      {"all", use_of(status.all)},
                      {"robots", OrderedJson::array()}};
  if (!status.certificate_valid_until.empty())
    json["certificate_valid_until"] = status.certificate_valid_until;
  for (const RelayStatus::Robot& robot : status.robots) {
    OrderedJson one = {{"robot", robot.name}};
    if (with_peers) one["peer"] = robot.peer;  // mutant: robots_addresses
    one["open"] = !robot.peer.empty();
    one["open_seconds"] = std::chrono::floor<std::chrono::seconds>(robot.here_for).count();
    one["token_in_use"] = robot.twin;
    one.update(use_of(robot.use));
    json["robots"].push_back(std::move(one));
  }
  return json.dump(in_lines ? 1 : -1, ' ', false, OrderedJson::error_handler_t::replace);
}

std::string to_metrics(const RelayStatus& status, bool open) {
  MetricsText text(open);
  text.family("build", false, "The program that runs");
  text.sample(1, metric_label("version", status.version) + "," + metric_label("role", "relay") +
                     "," + metric_label("node", "relay"));
  text.one("sent_bytes", true, "Bytes passed on to robots", status.all.to_robot);
  text.one("received_bytes", true, "Bytes passed on from robots", status.all.to_visitors);
  text.one("pairs", false, "Visitors that are joined with a robot", status.all.pairs);
  text.one("visitors", true, "Visitors that were joined with a robot", status.all.visitors);
  text.one("connections", true, "Connections taken", status.accepted);
  text.one("connections_waiting", false, "Connections in no pair and without a login",
           status.waiting);
  text.family("connections_refused", true, "Connections refused, by reason");
  for (std::size_t i = 0; i < kRelayRefusals; ++i)
    text.sample(status.refused[i], metric_label("reason", name_of(static_cast<RelayRefusal>(i))));
  std::size_t here = 0;
  for (const auto& robot : status.robots) here += robot.peer.empty() ? 0 : 1;
  text.one("robots", false, "Robots that are here", here);
  text.family("robot_open", false, "Whether a robot is here, of those that are or have pairs");
  for (const auto& robot : status.robots)
    text.sample(robot.peer.empty() ? 0 : 1, metric_label("robot", robot.name));
  text.family("robot_pairs", false, "Visitors that are joined with it");
  for (const auto& robot : status.robots)
    text.sample(robot.use.pairs, metric_label("robot", robot.name));
  return text.take();
}

}  // namespace connect_bridge
