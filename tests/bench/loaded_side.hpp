// A side with as much in it as one peer and a large graph may give it, and how long the loop has to
// do with one more packet of that peer. Its time is not that of the clock.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bench/side_step.hpp"
#include "core/side/side.hpp"
#include "core/wire/control.hpp"
#include "core/wire/frame.hpp"
#include "core/wire/login.hpp"

namespace bench {

using namespace connect_bridge;

class LoadedSide {
 public:
  // So many topics that the peer offers, with an origin each (channels 1, 2, ...), and so many of
  // nodes here, which the peer accepts and demands; it listens to `listeners` that nobody
  // publishes.
  LoadedSide(std::uint32_t offered, std::uint32_t exported, std::uint32_t listeners)
      : side_(options(), 1, 0) {
    GraphChanged graph;
    for (std::uint32_t i = 0; i < exported; ++i)
      graph.topics.push_back({"/down" + std::to_string(i), kType, "", {endpoint(i)}, {}});
    graph.services.push_back({"/service", "p/srv/S", {{gid(1, 4), "/", "node"}}});
    give(std::move(graph));
    log_in();
    hear(Accepts{{{{"/**"}, {}, {"/**"}, {"/**"}, {"/**"}}}, {}});
    for (std::uint32_t first = 1; first <= offered; first += kOfferChannelsMax) {
      Offer offer;
      for (std::uint32_t n = first; n < first + kOfferChannelsMax && n <= offered; ++n)
        offer.channels.push_back(channel(n));
      hear(offer);
    }
    for (std::uint32_t first = 1; first <= listeners; first += kAddedMax) {
      Listeners told;
      for (std::uint32_t n = first; n < first + kAddedMax && n <= listeners; ++n)
        told.added.push_back({{n}, "/heard" + std::to_string(n), kType, {}});
      hear(told);
    }
    rest(std::chrono::seconds(30));
    for (std::uint32_t first = 1; first <= told_; first += kDemandChannelsMax) {
      Demand demand;
      for (std::uint32_t n = first; n < first + kDemandChannelsMax && n <= told_; ++n)
        demand.channels.push_back({.channel = {n}, .number = 1});
      hear(demand);
    }
    rest(std::chrono::seconds(1));
  }

  // Processor time of the longest step that comes of it within a second.
  double seconds_for(bool text, ByteView packet) {
    longest_ = 0;
    give(PacketReceived{kConnection, text, Payload::copy_of(packet)});
    rest(std::chrono::seconds(1));
    return longest_;
  }
  // The same for the end of the connection, and of the link that then does not come back.
  double seconds_to_end() {
    longest_ = 0;
    give(ConnectionClosed{kConnection, std::nullopt, "gone"});
    rest(std::chrono::seconds(120));
    return longest_;
  }
  // Whether the peer has done nothing that ends its connection.
  [[nodiscard]] bool open() const { return !closed_; }
  // Channels that this side offers it.
  [[nodiscard]] std::uint32_t offers() const { return told_; }

  // An offer of the peer.
  static ChannelOffer channel(std::uint32_t n) {
    ChannelOffer offer;
    offer.channel = {n};
    offer.name = "/up" + std::to_string(n);
    offer.type = kType;
    offer.origins.push_back({{1}, gid(n, 3), "/peer", {}});
    return offer;
  }

 private:
  static constexpr ConnectionId kConnection{1};
  static constexpr char kType[] = "p/msg/T";

  static Endpoint endpoint(std::uint32_t i) {
    return {gid(i, 2), "/", "node" + std::to_string(i % 100), {}};
  }

  static SideOptions options() {
    SideOptions options;
    options.outbox.compressed_texts_min = kPacketBytesMax;  // they are read here
    Rule rule;
    const std::vector<Pattern> all{Pattern::parse("/**").value()};
    rule.opens[Direction::kExport][OpenedBy::kTopics] =
        rule.opens[Direction::kImport][OpenedBy::kTopics] = all;
    rule.opens[Direction::kExport][OpenedBy::kServices] =
        rule.opens[Direction::kImport][OpenedBy::kServices] = all;
    rule.opens[Direction::kExport][OpenedBy::kActions] =
        rule.opens[Direction::kImport][OpenedBy::kActions] = all;
    rule.opens[Direction::kExport][OpenedBy::kParameters] =
        rule.opens[Direction::kImport][OpenedBy::kParameters] = all;
    options.policy = Policy({rule});
    options.audits = true;
    return options;
  }

  void log_in() {
    give(ConnectionOpened{kConnection, "10.0.0.1:1"});
    Hello hello;
    hello.side.bytes.fill(9);
    hello.node = "/peer";
    receive(encode(hello));
    receive(encode(Login{"none", {}}));
    Identity who;
    who.name = "peer";
    give(Authenticated{kConnection, who, ""});
  }

  void hear(const Control& control) {
    const std::string text = encode(control);
    give(PacketReceived{kConnection, true, Payload::copy_of(Bytes(text.begin(), text.end()))});
  }
  void receive(const Bytes& bytes) {
    give(PacketReceived{kConnection, false, Payload::copy_of(bytes)});
  }

  // Time passes: what is due in it is done, and the peer lives.
  void rest(Duration duration) {
    const TimePoint until = now_.steady + duration;
    for (auto next = side_.next_deadline(); next && *next <= until; next = side_.next_deadline()) {
      pass_to(std::min(until, std::max(*next, now_.steady + std::chrono::microseconds(100))));
      if (!closed_ && now_.steady >= acknowledged_at_ + std::chrono::milliseconds(200)) {
        acknowledged_at_ = now_.steady;
        Bytes bytes;
        append_header(AckFrame{received_, now_.steady.time_since_epoch().count()}, bytes);
        receive(bytes);
      }
      give(TimePassed{});
    }
    pass_to(until);
  }
  void pass_to(TimePoint at) {
    if (at <= now_.steady) return;
    now_.system += (at - now_.steady).count();
    now_.steady = at;
  }

  // One step of the loop.
  void give(Input&& input) {
    const SideStep step = step_of(side_, std::move(input), now_);
    longest_ = std::max(longest_, step.seconds);
    for (const Action& action : step.actions)
      closed_ = closed_ || std::holds_alternative<CloseConnection>(action);
    for (const auto& [to, packet] : step.packets) look_at(packet);
  }

  void look_at(const Packet& packet) {
    if (!packet.text) {
      if (std::exchange(welcomed_, true)) received_ += packet.size();  // the record does not count
      return;
    }
    const auto control = decode_control(text_of(packet));
    if (!control) return;
    if (const auto* offer = std::get_if<Offer>(&control.value()))
      told_ += static_cast<std::uint32_t>(offer->channels.size());
  }

  Side side_;
  Now now_{TimePoint(std::chrono::seconds(1)), 1'700'000'000LL * kStampSecond, 0};
  TimePoint acknowledged_at_{};
  std::uint64_t received_ = 0;
  std::uint32_t told_ = 0;
  bool welcomed_ = false;
  bool closed_ = false;
  double longest_ = 0;
};

}  // namespace bench
