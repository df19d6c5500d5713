// A side with many links, and the peers at their other ends as far as its work needs them: each
// sends a topic of its own, and is sent one. Its time is not that of the clock.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "bench/processor_time.hpp"
#include "bench/side_step.hpp"
#include "core/side/side.hpp"
#include "core/wire/control.hpp"
#include "core/wire/frame.hpp"
#include "core/wire/login.hpp"

namespace bench {

using namespace connect_bridge;

class Crowd {
 public:
  static constexpr Duration kPeriod = std::chrono::milliseconds(20);  // of each topic

  explicit Crowd(std::uint32_t links) : side_(options_for(links), 1, 0), peers_(links) {
    GraphChanged graph;
    for (std::uint32_t i = 0; i < links; ++i) {
      graph.topics.push_back({up(i), kType, "", {}, {endpoint(i, 1)}});
      graph.topics.push_back({down(i), kType, "", {endpoint(i, 2)}, {}});
    }
    give(std::move(graph));
    for (std::uint32_t i = 0; i < links; ++i) open(i);
    for (int i = 0; i < 500; ++i) rest(kPeriod);
  }

  // How many topics flow in both directions now: all of them, if all is well.
  [[nodiscard]] std::size_t flowing() const {
    std::size_t count = 0;
    for (const Peer& peer : peers_) count += (peer.demand != 0) + (peer.taken != 0);
    return count;
  }
  // Each peer sends its message once in this time, and one arrives for each here.
  void send_up() {
    for (std::uint32_t i = 0; i < peers_.size(); ++i) {
      if (peers_[i].demand != 0) receive(i, message(peers_[i]));
      rest(kPeriod / peers_.size());
    }
  }
  // The same, all at once: they wait to be read.
  void send_up_at_once() {
    const double began = processor_seconds();
    for (std::uint32_t i = 0; i < peers_.size(); ++i)
      side_.on_arrival({connection(i), false, {}}, now_);
    seconds_ += processor_seconds() - began;
    for (;;) {
      const double asked = processor_seconds();
      const auto next = side_.take_turn(now_);
      seconds_ += processor_seconds() - asked;
      if (!next) break;
      const auto i = static_cast<std::uint32_t>(next->connection.value - 1);
      if (peers_[i].demand != 0) receive(i, message(peers_[i]));
      side_.spent(std::chrono::microseconds(10), now_.steady);
    }
    rest(kPeriod);
  }
  void send_down() {
    for (std::uint32_t i = 0; i < peers_.size(); ++i) {
      MessageTaken taken{
          {peers_[i].subscription}, endpoint(i, 2).gid, now_.system, body_, ++number_};
      if (peers_[i].taken != 0) give(std::move(taken));
      rest(kPeriod / peers_.size());
    }
  }
  // The connection of each is lost.
  void lose() {
    for (std::uint32_t i = 0; i < peers_.size(); ++i) give(ConnectionClosed{connection(i), {}, {}});
  }
  // The processor time of the side since this was last asked, in seconds.
  double take_seconds() { return std::exchange(seconds_, 0); }
  // Messages that the side has published, and sent.
  std::uint64_t published = 0;
  std::uint64_t sent = 0;

 private:
  static constexpr char kType[] = "p/msg/Kilobyte";
  static constexpr Duration kAckPeriod = std::chrono::milliseconds(100);

  struct Peer {
    bool welcomed = false;
    std::uint16_t demand = 0;        // of the side, for this peer's topic
    std::uint32_t sequence = 0;      // of this peer's messages
    std::uint64_t subscription = 0;  // of the side, for what it sends to this peer
    std::uint32_t taken = 0;         // the channel of that, if this peer has demanded it
    std::uint64_t received = 0;      // bytes
    std::uint64_t acknowledged = 0;
    TimePoint acknowledged_at{};
  };

  static std::string up(std::uint32_t i) { return "/up" + std::to_string(i); }
  static std::string down(std::uint32_t i) { return "/down" + std::to_string(i); }
  static Endpoint endpoint(std::uint32_t i, std::uint8_t kind) {
    return {gid(i, kind), "/", "node" + std::to_string(i), {}};
  }
  static ConnectionId connection(std::uint32_t i) { return {i + 1}; }

  static SideOptions options_for(std::uint32_t links) {
    SideOptions options;
    options.outbox.compressed_texts_min = kPacketBytesMax;  // they are read here
    options.links_max = options.identity_links_max = links;
    Rule rule;
    rule.opens[Direction::kExport][OpenedBy::kTopics].push_back(Pattern::parse("/**").value());
    rule.opens[Direction::kImport][OpenedBy::kTopics].push_back(Pattern::parse("/**").value());
    options.policy = Policy({rule});
    return options;
  }

  void open(std::uint32_t i) {
    give(ConnectionOpened{connection(i), "10.0.0.1"});
    Hello hello;
    hello.side.bytes.fill(9);
    for (std::size_t byte = 0; byte < 4; ++byte)
      hello.side.bytes[byte] = static_cast<std::uint8_t>(i >> (8 * byte));
    hello.node = "/peer";
    receive(i, encode(hello));
    receive(i, encode(Login{"none", {}}));
    Identity who;
    who.name = "robot" + std::to_string(i);
    give(Authenticated{connection(i), who, ""});
    hear(i, Accepts{{{{down(i)}, {}}}, {}});
    ChannelOffer offer;
    offer.channel = {1};
    offer.name = up(i);
    offer.type = kType;
    offer.origins.push_back({{1}, gid(i, 3), "/peer", {}});
    hear(i, Offer{{offer}, true});
  }

  [[nodiscard]] Bytes message(Peer& peer) const {
    MessageFrame frame;
    frame.channel = {1};
    frame.subject = {1};
    frame.sequence = ++peer.sequence;
    frame.demand = peer.demand;
    frame.stamp = now_.system;
    frame.raw_bytes = frame.body_bytes = static_cast<std::uint32_t>(body_.size());
    frame.part = body_.view();
    Bytes bytes;
    append_header(frame, bytes);
    bytes.insert(bytes.end(), body_.view().begin(), body_.view().end());
    return bytes;
  }

  // Time passes, and what is due in it is done.
  void rest(Duration duration) {
    const TimePoint until = now_.steady + duration;
    for (auto next = deadline(); next && *next <= until; next = deadline()) {
      pass_to(*next);
      give(TimePassed{});
    }
    pass_to(until);
    for (std::uint32_t i = 0; i < peers_.size(); ++i) {
      Peer& peer = peers_[i];
      // Also where there is nothing new: as a sign of life.
      const Duration period = peer.acknowledged == peer.received ? 10 * kAckPeriod : kAckPeriod;
      if (peer.acknowledged_at + period > until) continue;
      peer.acknowledged_at = until;
      peer.acknowledged = peer.received;
      Bytes bytes;
      append_header(AckFrame{peer.received, now_.steady.time_since_epoch().count()}, bytes);
      receive(i, bytes);
    }
  }
  std::optional<TimePoint> deadline() {
    const double began = processor_seconds();
    const auto next = side_.next_deadline();
    seconds_ += processor_seconds() - began;
    return next;
  }
  void pass_to(TimePoint at) {
    if (at <= now_.steady) return;
    now_.system += (at - now_.steady).count();
    now_.steady = at;
  }

  void hear(std::uint32_t i, const Control& control) {
    const std::string text = encode(control);
    give(PacketReceived{connection(i), true, Payload::copy_of(Bytes(text.begin(), text.end()))});
  }
  void receive(std::uint32_t i, const Bytes& bytes) {
    give(PacketReceived{connection(i), false, Payload::copy_of(bytes)});
  }

  // One step of the loop.
  void give(Input&& input) {
    const SideStep step = step_of(side_, std::move(input), now_);
    seconds_ += step.seconds;
    for (const Action& action : step.actions) look_at(action);
    for (const auto& [to, packet] : step.packets) look_at(to.value - 1, packet);
  }

  void look_at(const Action& action) {
    const auto* publish = std::get_if<Publish>(&action);  // claims are, too
    if (publish && publish->payload.size() == body_.size()) ++published;
    const auto* subscription = std::get_if<CreateSubscription>(&action);
    if (!subscription || !subscription->topic.starts_with("/down")) return;
    peers_[std::stoul(subscription->topic.substr(5))].subscription = subscription->id.value;
  }

  void look_at(std::uint32_t i, const Packet& packet) {
    if (!packet.text) {
      if (!std::exchange(peers_[i].welcomed, true)) return;  // the record is not acknowledged
      peers_[i].received += packet.size();
      sent += packet.size() > body_.size();
      return;
    }
    const auto control = decode_control(text_of(packet));
    if (!control) return;
    if (const auto* demand = std::get_if<Demand>(&control.value()))
      for (const auto& of_channel : demand->channels) peers_[i].demand = of_channel.number;
    const auto* offer = std::get_if<Offer>(&control.value());
    if (!offer || offer->channels.empty()) return;
    peers_[i].taken = offer->channels.front().channel.value;
    hear(i, Demand{{{offer->channels.front().channel, 1}}});
  }

  Side side_;
  Now now_{TimePoint(std::chrono::seconds(1)), 1'700'000'000LL * kStampSecond, 0};
  std::vector<Peer> peers_;
  const Payload body_ = Payload::adopt([] {
    Bytes bytes(1024);
    bytes[1] = 1;
    return bytes;
  }());
  std::uint64_t number_ = 0;
  double seconds_ = 0;
};

}  // namespace bench
