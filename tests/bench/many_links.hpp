// A side to which one identity has many links, each of which offers the same publishers, and how
// long the loop has to do when links end and when a node starts. Its time is not that of the clock.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "bench/side_step.hpp"
#include "core/side/side.hpp"
#include "core/wire/control.hpp"
#include "core/wire/frame.hpp"
#include "core/wire/login.hpp"

namespace bench {

using namespace connect_bridge;

struct ManyLinksShape {
  std::uint32_t links = 20;
  std::uint32_t topics = 8;
  std::uint32_t publishers = 256;  // of each topic
  bool transient_local = true;
  bool listened = false;  // by a node here
};

// The steps that something causes: the longest of them, and all of them.
struct Stall {
  double longest = 0;  // seconds of the processor
  double all = 0;
};

class ManyLinks {
 public:
  explicit ManyLinks(const ManyLinksShape& shape)
      : shape_(shape), side_(options_for(shape), 1, 0), peers_(shape.links) {
    give(graph());
    for (std::uint32_t link = 0; link < shape_.links; ++link) {
      log_in(link);
      offer(link);
    }
    rest(std::chrono::seconds(60));
  }

  // Publishers that exist here for those of the peers.
  [[nodiscard]] std::uint32_t mirrors() const { return mirrors_; }
  // Links that are open.
  [[nodiscard]] std::uint32_t open() const {
    return static_cast<std::uint32_t>(
        std::count_if(peers_.begin(), peers_.end(), [](const Peer& p) { return p.open; }));
  }

  Stall lose(std::uint32_t first, std::uint32_t count) {
    return measured([&] {
      for (std::uint32_t link = first; link < first + count; ++link) {
        peers_[link].open = false;
        give(ConnectionClosed{connection(link), {}, {}});
      }
      rest(std::chrono::seconds(10));
    });
  }
  Stall start_node() {
    ++nodes_;
    return measured([&] {
      give(graph());
      rest(std::chrono::milliseconds(100));
    });
  }
  // A node here publishes so many messages, of which each counts, to links that have asked to get
  // what a break loses.
  Stall publish(std::uint32_t messages) {
    return measured([&] {
      for (std::uint32_t n = 0; n < messages; ++n) {
        const Bytes body{0, 1, 0, 0, 1, 2, 3, 4};
        give(MessageTaken{
            {subscription_}, gid(0, 2), now_.system, Payload::copy_of(body), ++number_});
      }
    });
  }
  // Lost links are waited for no longer.
  Stall give_up() {
    return measured([&] { rest(std::chrono::seconds(120)); });
  }
  // Links to which it is sent.
  [[nodiscard]] std::uint32_t watched() const { return watched_; }
  // A node subscribes to the topics, or does so no longer.
  Stall listen(bool on) {
    shape_.listened = on;
    return start_node();
  }

 private:
  static constexpr char kType[] = "p/msg/T";
  static constexpr char kWatched[] = "/of_node_0";

  struct Peer {
    bool open = true;
    bool welcomed = false;
    std::uint64_t received = 0;
    TimePoint acknowledged_at{};
  };

  static ConnectionId connection(std::uint32_t link) { return {link + 1}; }
  static std::string topic(std::uint32_t i) {
    return "/a_topic_of_the_driver_" + std::to_string(i);
  }

  static SideOptions options_for(const ManyLinksShape& shape) {
    SideOptions options;
    options.outbox.compressed_texts_min = kPacketBytesMax;  // they are read here
    options.links_max = options.identity_links_max = shape.links;
    Rule rule;
    rule.opens[Direction::kImport][OpenedBy::kTopics].push_back(Pattern::parse("/**").value());
    rule.opens[Direction::kExport][OpenedBy::kTopics].push_back(Pattern::parse(kWatched).value());
    options.policy = Policy({rule});
    options.audits = true;
    options.resume_for = std::chrono::seconds(60);
    return options;
  }

  // Each node publishes something and has parameters, as real ones do.
  [[nodiscard]] GraphChanged graph() const {
    GraphChanged graph;
    for (std::uint32_t node = 0; node < 20 + nodes_; ++node) {
      const Endpoint own{gid(node, 2), "/", "node" + std::to_string(node), {}};
      graph.topics.push_back({"/of_node_" + std::to_string(node), kType, "", {own}, {}});
    }
    for (std::uint32_t i = 0; shape_.listened && i < shape_.topics; ++i)
      graph.topics.push_back({topic(i), kType, "", {}, {{gid(i, 4), "/", "listener", {}}}});
    return graph;
  }

  void log_in(std::uint32_t link) {
    give(ConnectionOpened{connection(link), "10.0.0.1:1"});
    Hello hello;
    hello.side.bytes.fill(9);
    hello.side.bytes[0] = static_cast<std::uint8_t>(link);
    hello.node = "/peer" + std::to_string(link);
    receive(link, encode(hello));
    receive(link, encode(Login{"none", {}}));
    Identity who;
    who.name = "driver";
    give(Authenticated{connection(link), who, ""});
    hear(link, Accepts{{{{kWatched}, {}}}, {}});
  }

  void offer(std::uint32_t link) {
    for (std::uint32_t i = 0; i < shape_.topics; ++i) {
      ChannelOffer channel;
      channel.channel = {i + 1};
      channel.name = topic(i);
      channel.type = kType;
      hear(link, Offer{{channel}, i + 1 == shape_.topics});
      for (std::uint32_t first = 0; first < shape_.publishers; first += kAddedMax) {
        OriginsChanged origins{{i + 1}, {}, {}};
        const std::uint32_t end = std::min<std::uint32_t>(first + kAddedMax, shape_.publishers);
        for (std::uint32_t n = first; n < end; ++n) {
          OriginOffer origin{{n + 1}, gid(i * shape_.publishers + n, 3), "/peer", {}};
          if (shape_.transient_local) origin.qos.durability = Durability::kTransientLocal;
          origins.added.push_back(std::move(origin));
        }
        hear(link, origins);
      }
    }
  }

  template <class Work>
  Stall measured(Work work) {
    stall_ = {};
    work();
    return stall_;
  }

  void hear(std::uint32_t link, const Control& control) {
    const std::string text = encode(control);
    give(PacketReceived{connection(link), true, Payload::copy_of(Bytes(text.begin(), text.end()))});
  }
  void receive(std::uint32_t link, const Bytes& bytes) {
    give(PacketReceived{connection(link), false, Payload::copy_of(bytes)});
  }

  // Time passes: what is due in it is done, and the peers live.
  void rest(Duration duration) {
    const TimePoint until = now_.steady + duration;
    for (auto next = side_.next_deadline(); next && *next <= until; next = side_.next_deadline()) {
      pass_to(std::min(until, std::max(*next, now_.steady + std::chrono::microseconds(100))));
      for (std::uint32_t link = 0; link < peers_.size(); ++link) acknowledge(link);
      give(TimePassed{});
    }
    pass_to(until);
  }
  void acknowledge(std::uint32_t link) {
    Peer& peer = peers_[link];
    if (!peer.open || now_.steady < peer.acknowledged_at + std::chrono::milliseconds(200)) return;
    peer.acknowledged_at = now_.steady;
    Bytes bytes;
    append_header(AckFrame{peer.received, now_.steady.time_since_epoch().count()}, bytes);
    receive(link, bytes);
  }
  void pass_to(TimePoint at) {
    if (at <= now_.steady) return;
    now_.system += (at - now_.steady).count();
    now_.steady = at;
  }

  // One step of the loop.
  void give(Input&& input) {
    const SideStep step = step_of(side_, std::move(input), now_);
    stall_.longest = std::max(stall_.longest, step.seconds);
    stall_.all += step.seconds;
    for (const Action& action : step.actions) {
      if (const auto* made = std::get_if<CreateMirror>(&action))
        mirrors_ += made->topic.starts_with("/a_topic");
      if (std::holds_alternative<DestroyMirror>(action)) --mirrors_;
      const auto* subscribed = std::get_if<CreateSubscription>(&action);
      if (subscribed && subscribed->topic == kWatched) subscription_ = subscribed->id.value;
      if (const auto* close = std::get_if<CloseConnection>(&action))
        peers_[static_cast<std::size_t>(close->connection.value - 1)].open = false;
    }
    for (const auto& [to, packet] : step.packets)
      look_at(static_cast<std::uint32_t>(to.value - 1), packet);
  }
  void look_at(std::uint32_t link, const Packet& packet) {
    Peer& peer = peers_[link];
    if (!packet.text) {
      if (std::exchange(peer.welcomed, true)) peer.received += packet.size();
      return;
    }
    const auto control = decode_control(text_of(packet));
    const auto* offer = control ? std::get_if<Offer>(&control.value()) : nullptr;
    if (!offer || offer->channels.empty()) return;
    hear(link, Demand{{{.channel = offer->channels.front().channel, .number = 1, .resume = true}}});
    ++watched_;
  }

  ManyLinksShape shape_;
  Side side_;
  Now now_{TimePoint(std::chrono::seconds(1)), 1'700'000'000LL * kStampSecond, 0};
  std::vector<Peer> peers_;
  std::uint32_t nodes_ = 0;
  std::uint32_t watched_ = 0;
  std::uint64_t subscription_ = 0;
  std::uint64_t number_ = 0;
  std::uint32_t mirrors_ = 0;
  Stall stall_;
};

}  // namespace bench
