// A server that answers a call each millisecond, and one identity that calls it with many links:
// how long the calls of another identity take. The time is that of the script, so it is the same
// everywhere.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "bench/side_step.hpp"
#include "core/wire/control.hpp"
#include "core/wire/frame.hpp"
#include "core/wire/login.hpp"

namespace bench {

using namespace connect_bridge;

class BusyServer {
 public:
  // So many links of the one identity, each of which waits for kCalls answers all the time.
  explicit BusyServer(std::uint32_t links) : side_(options(), 1, 0), peers_(links + 1) {
    GraphChanged graph;
    graph.services.push_back({"/service", "p/srv/S", {{gid(1, 4), "/", "node"}}});
    give(std::move(graph));
    for (std::uint32_t link = 0; link < peers_.size(); ++link) come(link);
    for (std::uint32_t link = 0; link < links; ++link)
      for (std::uint32_t call = 0; call < kCalls; ++call) request(link);
    for (int i = 0; i < 500; ++i) serve();
  }

  // How long so many calls of the other identity take, one after the other, in ms; sorted.
  std::vector<std::uint32_t> waits(std::uint32_t calls) {
    std::vector<std::uint32_t> waits;
    const auto other = static_cast<std::uint32_t>(peers_.size() - 1);
    for (std::uint32_t i = 0; i < calls; ++i) {
      const std::uint32_t before = peers_[other].answers;
      std::uint32_t wait = 0;
      request(other);
      for (; peers_[other].answers == before && wait < kWaitMax; ++wait) serve();
      waits.push_back(wait);
      for (std::uint32_t rest = 0; rest < 3 + i % 5; ++rest) serve();
    }
    std::sort(waits.begin(), waits.end());
    return waits;
  }
  static constexpr std::uint32_t kCalls = 64;
  static constexpr std::uint32_t kWaitMax = 10'000;

 private:
  struct Peer {
    std::uint64_t received = 0;
    bool welcomed = false;
    bool heard = false;  // something that it has not acknowledged
    std::uint32_t requests = 0;
    std::uint32_t answers = 0;
  };

  static SideOptions options() {
    SideOptions options;
    options.outbox.compressed_texts_min = kPacketBytesMax;  // they are read here
    options.links_max = options.identity_links_max = 64;
    options.dead_after = std::chrono::hours(1);
    Rule rule;
    rule.opens[Direction::kExport][OpenedBy::kServices] = {Pattern::parse("/**").value()};
    options.policy = Policy({rule});
    return options;
  }

  static ConnectionId connection_of(std::uint32_t link) { return {link + 1}; }
  void come(std::uint32_t link) {
    give(ConnectionOpened{connection_of(link), "10.0.0.1:1"});
    Hello hello;
    hello.side.bytes.fill(9);
    hello.side.bytes[0] = static_cast<std::uint8_t>(link);
    hello.node = "/peer";
    send(link, false, encode(hello));
    send(link, false, encode(Login{"none", {}}));
    Identity who;
    who.name = link + 1 < peers_.size() ? "many" : "other";
    give(Authenticated{connection_of(link), who, ""});
    say(link, Accepts{{{{"/**"}, {}, {"/**"}, {"/**"}, {"/**"}}}, {}});
    say(link, Attach{{1}, {1}});
  }
  void say(std::uint32_t link, const Control& control) {
    const std::string text = encode(control);
    send(link, true, Bytes(text.begin(), text.end()));
  }
  void send(std::uint32_t link, bool text, const Bytes& packet) {
    give(PacketReceived{connection_of(link), text, Payload::copy_of(packet)});
  }
  void request(std::uint32_t link) {
    const Bytes body{0, 1, 0, 0, 1, 0, 0, 0};
    MessageFrame frame;
    frame.channel = {1};
    frame.sequence = ++peers_[link].requests;
    frame.subject = {frame.sequence};
    frame.raw_bytes = frame.body_bytes = static_cast<std::uint32_t>(body.size());
    frame.part = body;
    Bytes bytes;
    append_header(frame, bytes);
    bytes.insert(bytes.end(), body.begin(), body.end());
    send(link, false, bytes);
  }

  // A millisecond passes, and the server answers what it got first.
  void serve() {
    now_.steady += std::chrono::milliseconds(1);
    now_.system += 1'000'000;
    if (const auto due = side_.next_deadline(); due && *due <= now_.steady) give(TimePassed{});
    for (std::uint32_t link = 0; link < peers_.size(); ++link) {
      Bytes bytes;
      append_header(AckFrame{peers_[link].received, now_.steady.time_since_epoch().count()}, bytes);
      if (std::exchange(peers_[link].heard, false)) send(link, false, bytes);
    }
    if (requests_.empty()) return;
    const SendRequest next = std::move(requests_.front());
    requests_.pop_front();
    give(ResponseTaken{next.client, next.invocation, Payload::copy_of(Bytes{0, 1, 0, 0, 1})});
    for (const std::uint32_t link : std::exchange(again_, {})) request(link);
  }

  void give(Input&& input) {
    const SideStep step = step_of(side_, std::move(input), now_);
    std::vector<ServiceClientId> made;
    for (const Action& action : step.actions) {
      if (const auto* request = std::get_if<SendRequest>(&action)) requests_.push_back(*request);
      if (const auto* client = std::get_if<CreateServiceClient>(&action))
        made.push_back(client->id);
    }
    for (const auto& [to, packet] : step.packets)
      look_at(static_cast<std::uint32_t>(to.value - 1), packet);
    for (const ServiceClientId client : made) give(ServiceReady{client, true, ""});
  }
  void look_at(std::uint32_t link, const Packet& packet) {
    Peer& peer = peers_[link];
    if (packet.text) return;
    if (!std::exchange(peer.welcomed, true)) return;  // the record does not count
    peer.received += packet.size();
    peer.heard = true;
    const std::string bytes = text_of(packet);
    FrameReader frames({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
    for (auto frame = frames.next(); frame && frame.value(); frame = frames.next()) {
      if (!std::holds_alternative<MessageFrame>(*frame.value())) continue;
      ++peer.answers;
      if (link + 1 < peers_.size()) again_.push_back(link);
    }
  }

  Side side_;
  Now now_{TimePoint(std::chrono::seconds(1)), 1'700'000'000LL * kStampSecond, 0};
  std::vector<Peer> peers_;
  std::deque<SendRequest> requests_;  // that the server has, in their order
  std::vector<std::uint32_t> again_;  // links that have got an answer
};

}  // namespace bench
