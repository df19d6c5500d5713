// A side with as much in it as peers and a large graph may give it, and how long the loop has to do
// with one more packet, with links that end and with nodes that start. Its time is not that of the
// clock.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bench/side_step.hpp"
#include "core/policy/interface.hpp"
#include "core/side/side.hpp"
#include "core/wire/control.hpp"
#include "core/wire/frame.hpp"
#include "core/wire/login.hpp"

namespace bench {

using namespace connect_bridge;

class LoadedSide {
 public:
  // Numbers of what a node publishes, serves and offers as actions; of names that it subscribes to
  // and nobody publishes; of the topics here that it subscribes to, and publishes as well.
  struct Node {
    std::uint32_t topics = 10;
    std::uint32_t services = 0;
    std::uint32_t actions = 0;
    std::uint32_t listens = 0;
    std::uint32_t records = 0;
    std::uint32_t joins = 0;
  };
  // What one step has done, as its packets and actions show.
  struct Work {
    std::size_t offers = 0;
    std::size_t origins = 0;    // that have come to open channels
    std::size_t listeners = 0;  // that have come or gone
    std::size_t withdrawn = 0;  // channels
    std::size_t endpoints = 0;  // mirrors that are made or destroyed

    // Each of them becomes that of both.
    template <class Of>
    void join(const Work& other, Of of) {
      for (const auto each :
           {&Work::offers, &Work::origins, &Work::listeners, &Work::withdrawn, &Work::endpoints})
        this->*each = of(this->*each, other.*each);
    }
  };

  // So many topics that each peer offers, with an origin each (channels 1, 2, ...), or as many
  // services; and so many topics of nodes here, which the peers accept and demand. The peers listen
  // to `listeners` that nobody publishes. `identities`: of one link each. `durability`: of what
  // peers and nodes publish.
  LoadedSide(std::uint32_t offered, std::uint32_t exported, std::uint32_t listeners,
             const std::vector<std::string>& identities = {"peer"},
             InterfaceKind kind = InterfaceKind::kTopic,
             Durability durability = Durability::kVolatile)
      : offered_(offered),
        exported_(exported),
        listeners_(listeners),
        kind_(kind),
        durability_(durability),
        side_(options(identities.size()), 1, 0) {
    for (const std::string& identity : identities) peers_.emplace_back().identity = identity;
    give(graph());
    for (std::size_t link = 0; link < peers_.size(); ++link) come(link);
    rest(std::chrono::seconds(30));
    for (std::size_t link = 0; link < peers_.size(); ++link) demand(link);
    rest(std::chrono::seconds(1));
  }

  // Processor time of the longest step that the event causes.
  template <class Event>
  double seconds_of(Event event) {
    longest_ = all_ = 0;
    most_ = sum_ = {};
    event();
    return longest_;
  }
  // The most of each that one of these steps has done, and all of it.
  [[nodiscard]] const Work& most() const { return most_; }
  [[nodiscard]] const Work& work_in_all() const { return sum_; }
  // The same of all steps of that event.
  [[nodiscard]] double seconds_in_all() const { return all_; }
  double seconds_for(bool text, ByteView packet) {
    return seconds_of([&] {
      send(0, text, packet);
      rest(std::chrono::seconds(1));
    });
  }
  // The same for the end of the connection, and of the link that then does not come back.
  double seconds_to_end() {
    return seconds_of([&] {
      lose(0);
      rest(std::chrono::seconds(120));
    });
  }

  // ---- events
  void send(std::size_t link, bool text, ByteView packet) {
    give(PacketReceived{peers_[link].connection, text, Payload::copy_of(packet)});
  }
  void lose(std::size_t link) {
    peers_[link].open = false;
    give(ConnectionClosed{peers_[link].connection, std::nullopt, "gone"});
  }
  // A peer that was lost connects again and continues its session.
  void come_back(std::size_t link) {
    if (peers_[link].open) return;
    come(link);
    rest(std::chrono::milliseconds(1));
    demand(link);
  }
  // A node starts, which also subscribes to as many topics of peers as it publishes; or it ends.
  void run_node(bool runs) { run_node(runs ? std::optional(Node()) : std::nullopt); }
  void run_node(std::optional<Node> node) {
    node_ = node;
    give(graph());
  }
  // Another bridge starts in this graph, or ends.
  void run_bridge(bool runs) {
    bridge_runs_ = runs;
    give(graph());
  }
  // Time passes: what is due in it is done, and the peers live.
  void rest(Duration duration) {
    const TimePoint until = now_.steady + duration;
    for (auto next = side_.next_deadline(); next && *next <= until; next = side_.next_deadline()) {
      pass_to(std::min(until, std::max(*next, now_.steady + std::chrono::microseconds(100))));
      for (std::size_t link = 0; link < peers_.size(); ++link) acknowledge(link);
      give(TimePassed{});
    }
    pass_to(until);
  }

  // Whether the first peer has done nothing that ends its connection.
  [[nodiscard]] bool open() const { return peers_.front().open; }
  // Channels that this side offers it.
  [[nodiscard]] std::uint32_t offers() const { return peers_.front().told; }
  // The same of the peers together.
  [[nodiscard]] std::uint32_t all_offers() const {
    std::uint32_t all = 0;
    for (const Peer& peer : peers_) all += peer.told;
    return all;
  }

  // An offer of a peer.
  static ChannelOffer channel(std::uint32_t n) {
    ChannelOffer offer;
    offer.channel = {n};
    offer.name = up(n);
    offer.type = kType;
    offer.origins.push_back({{1}, gid(n, 3), "/peer", {}});
    return offer;
  }
  static ChannelOffer service(std::uint32_t n) {
    ChannelOffer offer;
    offer.channel = {n};
    offer.kind = InterfaceKind::kService;
    offer.name = up(n);
    offer.type = "p/srv/S";
    offer.node = "/peer";
    offer.epoch = 1;
    return offer;
  }

 private:
  static constexpr char kType[] = "p/msg/T";

  struct Peer {
    std::string identity;
    ConnectionId connection{};
    Token128 session{};
    bool open = false;
    bool welcomed = false;
    std::uint64_t received = 0;
    std::uint32_t told = 0;
    TimePoint acknowledged_at{};
  };

  [[nodiscard]] Endpoint endpoint(std::uint32_t i) const {
    Endpoint endpoint{gid(i, 2), "/", "node" + std::to_string(i % 100), {}};
    endpoint.qos.durability = durability_;
    return endpoint;
  }
  static Endpoint of_node() { return {gid(0, 5), "/", "starts", {}}; }
  static std::string up(std::uint32_t n) { return "/up" + std::to_string(n); }

  static SideOptions options(std::size_t links) {
    SideOptions options;
    options.links_max = options.identity_links_max =
        std::max(options.links_max, static_cast<std::uint32_t>(links));
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

  [[nodiscard]] GraphChanged graph() const {
    GraphChanged graph;
    for (std::uint32_t i = 0; i < exported_; ++i) {
      TopicState topic{"/down" + std::to_string(i), kType, "", {endpoint(i)}, {}};
      if (node_ && i < node_->joins) topic.publishers.push_back(of_node());
      if (node_ && i < node_->records) topic.subscribers.push_back(of_node());
      graph.topics.push_back(std::move(topic));
    }
    graph.services.push_back({"/service", "p/srv/S", {{gid(1, 4), "/", "node"}}});
    if (node_) add(*node_, graph);
    if (bridge_runs_)
      graph.topics.push_back({kClaimsTopic, kClaimsType, "", {{gid(0, 7), "/", "bridge", {}}}, {}});
    return graph;
  }
  void add(const Node& node, GraphChanged& graph) const {
    const Endpoint endpoint = of_node();
    const Server server{gid(0, 6), "/", "starts"};
    const auto publish = [&](const std::string& name, const std::string& type) {
      graph.topics.push_back({name, type, "", {endpoint}, {}});
    };
    for (std::uint32_t n = 1; n <= node.topics; ++n) publish("/more" + std::to_string(n), kType);
    for (std::uint32_t n = 1; n <= std::min(offered_, node.topics); ++n)
      graph.topics.push_back({up(n), kType, "", {}, {endpoint}});
    for (std::uint32_t n = 1; n <= node.listens; ++n)
      graph.topics.push_back({"/wanted" + std::to_string(n), kType, "", {}, {endpoint}});
    for (std::uint32_t n = 1; n <= node.services; ++n)
      graph.services.push_back({"/serves" + std::to_string(n), "p/srv/S", {server}});
    for (std::uint32_t n = 1; n <= node.actions; ++n)
      for (const ActionPart part : kActionParts) {
        const std::string name = name_of_part("/acts" + std::to_string(n), part);
        const std::string type = type_of_part("p/action/A", part);
        if (kind_of(part) == InterfaceKind::kTopic)
          publish(name, type);
        else
          graph.services.push_back({name, type, {server}});
      }
  }

  // Logs in, and says all but the demands.
  void come(std::size_t link) {
    Peer& peer = peers_[link];
    peer.connection = {++last_connection_};
    peer.open = true;
    peer.welcomed = false;
    peer.received = peer.told = 0;
    give(ConnectionOpened{peer.connection, "10.0.0.1:1"});
    Hello hello;
    hello.side.bytes.fill(9);
    hello.side.bytes[0] = static_cast<std::uint8_t>(link);
    hello.session = peer.session;
    hello.node = "/peer" + std::to_string(link);
    send(link, false, encode(hello));
    send(link, false, encode(Login{"none", {}}));
    Identity who;
    who.name = peer.identity;
    give(Authenticated{peer.connection, who, ""});
    hear(link, Accepts{{{{"/**"}, {}, {"/**"}, {"/**"}, {"/**"}}}, {}});
    for (std::uint32_t first = 1; first <= offered_; first += kOfferChannelsMax) {
      Offer offer;
      for (std::uint32_t n = first; n < first + kOfferChannelsMax && n <= offered_; ++n) {
        offer.channels.push_back(kind_ == InterfaceKind::kTopic ? channel(n) : service(n));
        for (OriginOffer& origin : offer.channels.back().origins)
          origin.qos.durability = durability_;
      }
      hear(link, offer);
    }
    for (std::uint32_t first = 1; first <= listeners_; first += kAddedMax) {
      Listeners told;
      for (std::uint32_t n = first; n < first + kAddedMax && n <= listeners_; ++n)
        told.added.push_back({{n}, "/heard" + std::to_string(n), kType, {}});
      hear(link, told);
    }
  }
  void demand(std::size_t link) {
    const std::uint32_t told = peers_[link].told;
    for (std::uint32_t first = 1; first <= told; first += kDemandChannelsMax) {
      Demand demand;
      for (std::uint32_t n = first; n < first + kDemandChannelsMax && n <= told; ++n)
        demand.channels.push_back({.channel = {n}, .number = 1});
      hear(link, demand);
    }
  }

  void hear(std::size_t link, const Control& control) {
    const std::string text = encode(control);
    send(link, true, Bytes(text.begin(), text.end()));
  }
  void acknowledge(std::size_t link) {
    Peer& peer = peers_[link];
    if (!peer.open || now_.steady < peer.acknowledged_at + std::chrono::milliseconds(200)) return;
    peer.acknowledged_at = now_.steady;
    Bytes bytes;
    append_header(AckFrame{peer.received, now_.steady.time_since_epoch().count()}, bytes);
    send(link, false, bytes);
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
    all_ += step.seconds;
    Work work;
    for (const Action& action : step.actions) {
      work.endpoints += std::holds_alternative<CreateMirror>(action) ||
                        std::holds_alternative<DestroyMirror>(action) ||
                        std::holds_alternative<CreateServiceMirror>(action) ||
                        std::holds_alternative<DestroyServiceMirror>(action);
      if (const auto* close = std::get_if<CloseConnection>(&action))
        for (Peer& peer : peers_) peer.open = peer.open && peer.connection != close->connection;
    }
    for (const auto& [to, packet] : step.packets)
      for (Peer& peer : peers_)
        if (peer.connection == to) look_at(peer, packet, work);
    most_.join(work, [](std::size_t a, std::size_t b) { return std::max(a, b); });
    sum_.join(work, [](std::size_t a, std::size_t b) { return a + b; });
  }

  static void look_at(Peer& peer, const Packet& packet, Work& work) {
    if (!packet.text) {
      if (std::exchange(peer.welcomed, true)) {
        peer.received += packet.size();  // the record does not count
      } else if (const auto welcome = decode_welcome(bytes_of(packet))) {
        peer.session = welcome.value().session;
      }
      return;
    }
    const auto control = decode_control(text_of(packet));
    if (!control) return;
    if (const auto* offer = std::get_if<Offer>(&control.value())) {
      peer.told += static_cast<std::uint32_t>(offer->channels.size());
      work.offers += offer->channels.size();
    }
    if (const auto* changed = std::get_if<OriginsChanged>(&control.value()))
      work.origins += changed->added.size();
    if (const auto* told = std::get_if<Listeners>(&control.value()))
      work.listeners += told->added.size() + told->removed.size();
    if (const auto* withdraw = std::get_if<Withdraw>(&control.value()))
      work.withdrawn += withdraw->channels.size();
  }
  static Bytes bytes_of(const Packet& packet) {
    const std::string bytes = text_of(packet);
    return {bytes.begin(), bytes.end()};
  }

  const std::uint32_t offered_, exported_, listeners_;
  const InterfaceKind kind_;
  const Durability durability_;  // of what peers and nodes here publish
  Side side_;
  Now now_{TimePoint(std::chrono::seconds(1)), 1'700'000'000LL * kStampSecond, 0};
  std::vector<Peer> peers_;
  std::uint64_t last_connection_ = 0;
  std::optional<Node> node_;
  bool bridge_runs_ = false;
  double longest_ = 0;
  double all_ = 0;
  Work most_, sum_;
};

}  // namespace bench
