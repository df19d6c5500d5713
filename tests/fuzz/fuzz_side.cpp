// Sequences of inputs against a whole side: connections, logins, packets of any content before and
// after login, graph changes, samples, time. Nothing may crash, what it holds stays bounded, and no
// step takes long.
// Input: one byte of operation, its arguments, and so on.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "core/base/check.hpp"
#include "core/side/side.hpp"
#include "core/wire/control.hpp"
#include "core/wire/frame.hpp"
#include "core/wire/login.hpp"
#include "fuzz/slow.hpp"

using namespace connect_bridge;

namespace {

constexpr std::uint64_t kMemoryMax = 64 << 20;

class Script {
 public:
  Script(const std::uint8_t* data, std::size_t size) : rest_(data, size) {}
  [[nodiscard]] bool done() const { return rest_.empty(); }
  std::uint8_t byte() {
    if (rest_.empty()) return 0;
    const std::uint8_t b = rest_[0];
    rest_ = rest_.subspan(1);
    return b;
  }
  Payload bytes() {
    const std::size_t size = std::min<std::size_t>(byte() * 4U + byte(), rest_.size());
    const auto view = rest_.subspan(0, size);
    rest_ = rest_.subspan(size);
    return Payload::copy_of(view);
  }

 private:
  ByteView rest_;
};

SideOptions options() {
  SideOptions o;
  Rule rule;
  rule.name = "all";
  rule.opens[Direction::kExport][OpenedBy::kTopics] = {Pattern::parse("/**").value()};
  rule.opens[Direction::kImport][OpenedBy::kTopics] = {Pattern::parse("/**").value()};
  rule.opens[Direction::kExport][OpenedBy::kServices] =
      rule.opens[Direction::kImport][OpenedBy::kServices] = {Pattern::parse("/**").value()};
  rule.opens[Direction::kExport][OpenedBy::kActions] =
      rule.opens[Direction::kImport][OpenedBy::kActions] = {Pattern::parse("/**").value()};
  rule.opens[Direction::kExport][OpenedBy::kParameters] =
      rule.opens[Direction::kImport][OpenedBy::kParameters] = {Pattern::parse("/**").value()};
  rule.treatment.calls_max = 3;
  rule.treatment.call_timeout = std::chrono::seconds(1);
  o.policy = Policy({rule});
  o.reassembly.message_bytes_max = 1 << 20;
  o.reassembly.open_bytes_max = 2 << 20;
  o.links_max = 4;
  o.calls_waiting_max = 8;
  o.call_bytes_max = 1 << 20;
  o.compress_job_bytes = 64;
  return o;
}

TopicState topic(std::uint8_t shape) {
  TopicState t;
  t.name = "/topic" + std::to_string(shape % 4);
  t.type = "std_msgs/msg/String";
  for (int i = 0; i < shape % 3; ++i) {
    Endpoint e;
    e.gid.bytes[0] = static_cast<std::uint8_t>(1 + i + shape % 4 * 4);
    e.node_name = "node" + std::to_string(i);
    if (shape & 16) e.qos.durability = Durability::kTransientLocal;
    t.publishers.push_back(e);
  }
  if (shape & 32) t.subscribers.push_back({Gid{{200}}, "/", "listener", {}});
  return t;
}

// Services and one action, one bit each.
std::vector<ServiceState> services(std::uint8_t shape) {
  constexpr std::array<std::pair<const char*, const char*>, 6> kAll = {
      {{"/service0", "p/srv/S"},
       {"/service1", "p/srv/S"},
       {"/act/_action/send_goal", "p/action/A_SendGoal"},
       {"/act/_action/cancel_goal", "action_msgs/srv/CancelGoal"},
       {"/act/_action/get_result", "p/action/A_GetResult"},
       {"/node0/get_parameters", "rcl_interfaces/srv/GetParameters"}}};
  std::vector<ServiceState> result;
  for (std::size_t i = 0; i < kAll.size(); ++i) {
    if ((shape >> i & 1) == 0) continue;
    Server server{Gid{{static_cast<std::uint8_t>(shape & 64 ? 80 + i : 90 + i)}}, "/", "node0"};
    result.push_back({kAll[i].first, kAll[i].second, {server}});
  }
  return result;
}

// The operator's side of it: carries out actions at once.
class World {
 public:
  World() : side_(options(), 1, 0) { drain(); }

  // Of the one that took longest.
  [[nodiscard]] double step_seconds() const { return longest_; }

  void step(Script& script) {
    const std::uint8_t op = script.byte();
    const ConnectionId connection{1U + op / 16U % 4U};
    switch (op % 12) {
      case 0: return give(ConnectionOpened{connection, "peer"});
      case 1: return give(ConnectionClosed{connection, std::nullopt, "gone"});
      case 2: return give(PacketReceived{connection, true, script.bytes()});
      case 3: return give(PacketReceived{connection, false, script.bytes()});
      case 4: return login(connection, script.byte());
      case 5: return give(Authenticated{connection, Identity{"fuzz", {}, 0}, ""});
      case 6: return change_graph(script.byte());
      case 7: return give(taken(script));
      case 8:
        now_.steady += std::chrono::milliseconds(script.byte() * 20);
        now_.system = now_.steady.time_since_epoch().count();
        return give(TimePassed{});
      case 9: return give(PacketReceived{connection, true, offer(script.byte())});
      case 10: return job_or_call(connection, script.byte(), script);
      default: return give(PacketReceived{connection, true, demand(script.byte())});
    }
  }

 private:
  void login(ConnectionId connection, std::uint8_t who) {
    Hello hello;
    hello.side.bytes[0] = static_cast<std::uint8_t>(1 + who % 4);
    hello.node = "/fuzz";
    give(ConnectionOpened{connection, "peer"});
    give(PacketReceived{connection, false, Payload::adopt(encode(hello))});
    give(PacketReceived{connection, false, Payload::adopt(encode(Login{"token", {1, 2, 3}}))});
    give(Authenticated{connection, Identity{"fuzz", {}, 0}, ""});
    const AcceptedNames all{{"/**"}, {}, {"/**"}, {"/**"}, {"/**"}};
    const std::string accepts = encode(Control{Accepts{{all}, {}}});
    give(PacketReceived{connection, true, Payload::adopt({accepts.begin(), accepts.end()})});
  }

  static Payload text(const Control& control) {
    const std::string json = encode(control);
    return Payload::adopt({json.begin(), json.end()});
  }

  static Payload offer(std::uint8_t shape) {
    ChannelOffer channel;
    channel.channel = {1U + shape % 8U};
    channel.name = "/topic" + std::to_string(shape / 8 % 4);
    channel.type = "std_msgs/msg/String";
    OriginOffer origin;
    origin.origin = {1};
    origin.gid.bytes[0] = static_cast<std::uint8_t>(100 + shape % 4);
    origin.node = "/remote";
    if (shape & 64) origin.qos.durability = Durability::kTransientLocal;
    channel.origins = {origin};
    return text(Offer{{channel}, (shape & 128) != 0});
  }

  // From 128 on: what belongs to services.
  void job_or_call(ConnectionId connection, std::uint8_t op, Script& script) {
    if (op < 128) return give(JobDone{JobId{op}, script.bytes()});
    const auto say = [&](const Control& control) {
      give(PacketReceived{connection, true, text(control)});
    };
    const std::uint8_t shape = script.byte();
    const ChannelId channel{1U + shape % 8U};
    const std::uint32_t number = 1U + shape / 8U;
    switch (op % 16) {
      case 0: return say(Attach{channel, {20U + number}});
      case 1: return say(Attached{channel, {number}, {script.byte()}, {{script.byte() + 1U}}});
      case 2: return say(Refuse{channel, {{number}}, "limit", "reason"});
      case 3: return say(Forget{channel, {{number}}});
      case 4: return say(Withdraw{{{20U + number}}});
      case 5: return say(Offer{{service_offer(shape)}, (shape & 1) != 0});
      case 6: return give(RequestTaken{{1U + shape % 4U}, {++last_request_}, script.bytes()});
      case 7: return give(CallersGone{{1U + shape % 4U}, {{number}, {number + 1}}});
      case 8: return give(ServiceReady{{1U + shape % 4U}, (shape & 4) != 0, "hash"});
      case 9: return give(ResponseTaken{{1U + shape % 4U}, {number}, script.bytes()});
      case 10: return give(InvocationFailed{{1U + shape % 4U}, {number}, "reason"});
      case 11: return give(ServiceMirrorFailed{{1U + shape % 4U}, "failed", "reason"});
      case 12: return give(ServiceClientFailed{{1U + shape % 4U}, "failed", "reason"});
      case 13: {
        GraphChanged graph;
        graph.topics = {topic(shape)};
        graph.services = services(shape);
        return give(std::move(graph));
      }
      default: return give(PacketReceived{connection, false, request(shape, script)});
    }
  }

  static ChannelOffer service_offer(std::uint8_t shape) {
    ChannelOffer offer;
    offer.channel = {1U + shape % 8U};
    offer.kind = InterfaceKind::kService;
    const auto all = services(63);
    const auto& service = all[shape / 8 % all.size()];
    offer.name = service.name;
    offer.type = service.type;
    offer.action_type = "p/action/A";
    offer.epoch = 1U + shape / 64U;
    return offer;
  }

  // A request to, or an answer from, a service.
  Payload request(std::uint8_t shape, Script& script) {
    const Payload body = script.bytes();
    MessageFrame frame;
    frame.channel = {shape & 1 ? 20U + shape / 8U : 1U + shape % 8U};
    frame.subject = {1U + script.byte()};
    frame.sequence = ++last_sequence_;
    frame.demand = 1;
    frame.raw_bytes = frame.body_bytes = static_cast<std::uint32_t>(body.size());
    frame.part = body.view();
    Bytes packet;
    append_header(frame, packet);
    packet.insert(packet.end(), body.view().begin(), body.view().end());
    return Payload::adopt(std::move(packet));
  }

  static Payload demand(std::uint8_t shape) {
    if (shape & 64) return text(Withdraw{{{1U + shape % 8U}}});
    return text(
        Demand{{{{1U + shape % 8U}, static_cast<std::uint16_t>((shape & 32) == 0 ? 1 : 0)}}});
  }

  void change_graph(std::uint8_t shape) {
    GraphChanged graph;
    graph.topics = {topic(shape)};
    graph.topics.push_back(topic(static_cast<std::uint8_t>(shape + 1)));
    give(std::move(graph));
  }

  MessageTaken taken(Script& script) {
    MessageTaken m;
    m.subscription = {script.byte()};
    m.origin.bytes[0] = script.byte();
    m.stamp = now_.system;
    m.number = script.byte();
    m.payload = script.bytes();
    return m;
  }

  void give(Input input) {
    const double seconds = seconds_for([&] {
      side_.handle(std::move(input), now_);
      drain();
    });
    longest_ = std::max(longest_, seconds);
  }

  void drain() {
    while (side_.next_action()) {
    }
    for (std::uint32_t c = 1; c <= 4; ++c)
      for (int i = 0; i < 8 && side_.next_packet({c}, now_); ++i) {
      }
    (void)side_.next_deadline();
    CONNECT_CHECK(side_.status(now_).memory_bytes <= kMemoryMax);
  }

  double longest_ = 0;
  std::uint32_t last_request_ = 0;
  std::uint32_t last_sequence_ = 0;
  Now now_{TimePoint(std::chrono::seconds(1)), 1'000'000'000, 1'000'000'000};
  Side side_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  check_quick("a step of the loop", [=] {
    Script script(data, size);
    World world;
    for (int i = 0; i < 400 && !script.done(); ++i) world.step(script);
    return world.step_seconds();
  });
  return 0;
}
