#include "sim/host.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "sim/checker.hpp"

namespace connect_bridge::sim {
namespace {

using namespace std::chrono_literals;

constexpr int kActionsMax = 200'000;  // answers to one input

// Each process has a monotonic clock of its own.
TimePoint steady_of(int host, TimePoint t) {
  return t + 1000s * (host + 1);
}

}  // namespace

Host::Host(int index, HostPlan plan, const World& world, Rng rng)
    : index_(index),
      plan_(std::move(plan)),
      world_(world),
      rng_(rng),
      cost_rng_(static_cast<std::uint64_t>(index) + 0xc057),
      held_bytes_(std::make_shared<std::uint64_t>(0)) {}

Host::~Host() = default;

Now Host::now() const {
  const Stamp system = world_.middleware.stamp(plan_.graph);
  return Now{steady_of(index_, world_.schedule.now()), system, system};
}

const Identity* Host::identity_on(ConnectionId id) const {
  const auto it = identities_.find(id);
  return it == identities_.end() ? nullptr : &it->second;
}

bool Host::has_late_login() const {
  const Stamp latest = now().system + kLoginMax.count();
  return std::any_of(identities_.begin(), identities_.end(),
                     [&](const auto& login) { return login.second.expires > latest; });
}

void Host::start() {
  if (side_ || stopped_) return;
  ++life_;
  tell("starts");
  pictures_ = {};
  side_ = std::make_unique<Side>(plan_.options, rng_.next(), now().system);
  last_packet_ = last_open_ = world_.schedule.now();
  world_.checker.on_start(*this);
  on_graph_change();
  input(TimePassed{});
}

void Host::restart() {
  stopped_ = false;
  start();
}

void Host::crash(bool peers_notice) {
  if (!side_) return;
  tell(stopped_ ? "ends" : "crashes");
  ++life_;
  draining_ = drain_planned_ = turn_planned_ = false;
  unread_.clear();
  side_.reset();
  world_.network.died(*this, peers_notice);
  ready_.clear();
  identities_.clear();
  gates_.clear();
  planned_deadline_.reset();
  snapshot_planned_ = false;
  held_bytes_ = std::make_shared<std::uint64_t>(0);
  blocked_ = false;
  waiting_.clear();
  forget_entities();
  world_.checker.on_end(*this);
}

void Host::forget_entities() {
  drive_switch_ = {};
  open_drive_calls_.clear();
  for (const auto& [id, mirror] : mirrors_) world_.middleware.destroy_writer(mirror.writer);
  for (const auto& [id, made] : subscriptions_) world_.middleware.destroy_reader(made.reader);
  for (const auto& [id, made] : service_mirrors_) world_.services.destroy_servant(made.servant);
  for (const auto& [id, made] : service_clients_) world_.services.destroy_caller(made.caller);
  mirrors_.clear();
  subscriptions_.clear();
  service_mirrors_.clear();
  service_clients_.clear();
}

void Host::request_stop() {
  if (!side_) return;
  input(StopRequested{});
  later(1s, [this]() -> Input {
    if (!stopped_) violated("side " + std::to_string(index_) + " did not stop within 1 s");
    return TimePassed{};
  });
}

void Host::report_trouble() {
  if (!side_ || subscriptions_.empty()) return;
  auto it = subscriptions_.begin();
  std::advance(it, static_cast<std::ptrdiff_t>(rng_.below(subscriptions_.size())));
  if (rng_.chance(500)) {
    input(MessagesLost{it->first, rng_.below(10), rng_.chance(300)});
  } else {
    input(QosIncompatible{it->first, it->second.made.topic, "reliability"});
  }
}

void Host::network_changed() {
  if (!side_) return;
  last_network_change_ = world_.schedule.now();
  input(NetworkChanged{});
}

void Host::set_policy(Policy policy) {
  plan_.options.policy = policy;
  ++policy_number_;
  if (!side_) return;
  tell("gets other rules");
  world_.checker.on_policy(*this);
  input(PolicyChanged{std::move(policy)});
}

void Host::calm() {
  calm_ = true;
  plan_.login_delay_max = std::min<Duration>(plan_.login_delay_max, 20ms);
  plan_.job_delay_max = std::min<Duration>(plan_.job_delay_max, 5ms);
  plan_.graph_delay_max = std::min<Duration>(plan_.graph_delay_max, 20ms);
}

void Host::later(Duration delay, std::function<Input()> make) {
  world_.schedule.after(delay, [this, life = life_, make = std::move(make)] {
    if (life == life_) input(make());
  });
}

// ---- the loop
// -------------------------------------------------------------------------------------

void Host::input(Input input) {
  if (!side_) return;
  if (blocked_) return waiting_.push_back(std::move(input));
  // Now and not when it arrived: a side that stood still could not know of it.
  if (const auto* packet = std::get_if<PacketReceived>(&input); packet)
    world_.checker.on_received(*this, packet->connection, packet->text, packet->payload.view());
  side_->handle(std::move(input), now());
  side_->spent(cost(), now().steady);
  drain();
  world_.checker.after_input(*this);
}

// Most take little.
Duration Host::cost() {
  return cost_rng_.between(Duration{0}, cost_rng_.chance(10) ? Duration{5ms} : Duration{100us});
}

void Host::plan_turn(Duration delay) {
  if (std::exchange(turn_planned_, true)) return;
  world_.schedule.after(delay, [this, life = life_] {
    if (life != life_) return;
    turn_planned_ = false;
    take_turns();
  });
}

// While a step takes its time others' packets come.
void Host::take_turns() {
  if (!side_ || blocked_) return;
  const auto next = side_->take_turn(now());
  if (!next) return;
  read(next->connection);
  plan_turn(cost());
}

// The packet stays in `unread_`, too, until it has its turn: the end of its connection comes behind
// it.
void Host::arrive(ConnectionId id) {
  const FlatPacket& packet = unread_.at(id).front();
  side_->on_arrival({id, packet.text, Payload::copy_of(packet.bytes)}, now());
}

void Host::read(ConnectionId id) {
  auto& unread = unread_[id];
  if (unread.empty()) return;
  FlatPacket packet = std::move(unread.front());
  unread.pop_front();
  Gate& gate = gates_[id];
  gate.bytes += packet.bytes.size();
  if (packet.bytes.size() > gate.packet_bytes_max || gate.bytes > gate.bytes_max) {
    world_.network.close(*this, id, static_cast<std::uint16_t>(CloseCode::kTooLarge));
    return;
  }
  input(PacketReceived{id, packet.text, counted(std::move(packet.bytes))});
  const auto more = unread_.find(id);
  if (side_ && more != unread_.end() && !more->second.empty()) arrive(id);
}

void Host::drain() {
  const std::uint64_t life = life_;
  draining_ = true;
  drain_planned_ = false;
  for (int count = 0; life == life_ && side_ && !blocked_;) {
    auto action = side_->next_action();
    if (!action) {
      pump();
      action = side_->next_action();
      if (!action) break;
    }
    if (++count > kActionsMax) violated("a side answers one input with actions without end");
    world_.digest.add_action(index_, world_.schedule.now(), *action);
    std::visit([this](const auto& a) { act(a); }, *action);
  }
  draining_ = false;
  if (life == life_ && side_ && !blocked_) plan_deadline();
}

// A publisher of a middleware may wait for its readers, and the loop with it.
void Host::block(Duration how_long) {
  blocked_ = true;
  world_.schedule.after(how_long, [this, life = life_] {
    if (life != life_) return;
    blocked_ = false;
    drain();
    // What has arrived is read before it is looked at what is due: a connection is opened, then its
    // packets have their turns. Each may block again, and what is left waits on.
    auto waiting = std::exchange(waiting_, {});
    const auto timers = std::stable_partition(
        waiting.begin(), waiting.end(),
        [](const Input& input) { return !std::holds_alternative<TimePassed>(input); });
    for (auto each = waiting.begin(); each != timers; ++each) input(std::move(*each));
    while (side_ && !blocked_) {
      const auto next = side_->take_turn(now());
      if (!next) break;
      read(next->connection);
    }
    if (life != life_) return;
    for (auto each = timers; each != waiting.end(); ++each) input(std::move(*each));
  });
}

void Host::pump() {
  while (const auto id = side_->take_ready()) ready_.insert(*id);
  const auto ready = ready_;
  for (const ConnectionId id : ready) world_.network.poke(*this, id);
}

void Host::plan_deadline() {
  const auto deadline = side_->next_deadline();
  if (!deadline) return;
  const TimePoint earliest = now().steady;
  if (planned_deadline_ && *planned_deadline_ <= std::max(*deadline, earliest)) return;
  planned_deadline_ = std::max(*deadline, earliest);
  const bool again = *planned_deadline_ == last_deadline_;
  last_deadline_ = *planned_deadline_;
  same_deadlines_ = again ? same_deadlines_ + 1 : 0;
  if (same_deadlines_ > 1000) violated("a side wants to be called again and again at once");
  later(*planned_deadline_ - earliest, [this, at = *planned_deadline_]() -> Input {
    if (planned_deadline_ == at) planned_deadline_.reset();
    return TimePassed{};
  });
}

// ---- from the world
// --------------------------------------------------------------------------------

void Host::on_graph_change() {
  if (!side_ || snapshot_planned_) return;
  snapshot_planned_ = true;
  later(rng_.between(Duration{100us}, plan_.graph_delay_max), [this]() -> Input {
    snapshot_planned_ = false;
    GraphChanged graph = world_.middleware.snapshot(plan_.graph, index_);
    graph.services = world_.services.snapshot(plan_.graph, index_);
    return graph;
  });
}

// A copy whose bytes count as held until nobody refers to them any more.
Payload Host::counted(Bytes bytes) const {
  auto* owned = new Bytes(std::move(bytes));
  *held_bytes_ += owned->size();
  std::shared_ptr<const Bytes> owner(owned, [counter = held_bytes_](const Bytes* b) {
    *counter -= b->size();
    delete b;
  });
  const ByteView view{*owner};
  return Payload::wrap(std::move(owner), view);
}

void Host::on_sample(const Reader& reader, const Writer& writer, const Sample& sample) {
  const SubscriptionId id{reader.spec.handle};
  if (!side_ || !subscriptions_.contains(id)) return;
  world_.checker.on_taken(*this, reader, writer, sample);
  const ByteView view = sample.payload.view();
  const GraphPlan& graph = world_.middleware.graph(plan_.graph);
  const bool tells =
      graph.tells_origins && (!is_claims(reader.spec.topic) || graph.tells_claimants);
  input(MessageTaken{id, tells ? writer.gid : Gid{}, sample.stamp,
                     counted(Bytes{view.begin(), view.end()}),
                     graph.tells_origins ? sample.number : 0});
}

bool Host::listening() const {
  return side_ && !stopped_ && is_server();
}

ConnectionId Host::accept() {
  return ConnectionId{++last_connection_};
}

void Host::on_open(ConnectionId id) {
  gates_[id] = Gate{};
  world_.checker.on_connection(*this, id);
  input(ConnectionOpened{id, "peer " + std::to_string(id.value)});
}

void Host::on_dial_failed(ConnectionId id, const std::string& reason) {
  input(DialFailed{id, {Cause::kNoAnswer, reason}});
}

void Host::on_packet(ConnectionId id, FlatPacket packet) {
  if (!side_) return;
  last_packet_ = world_.schedule.now();
  auto& unread = unread_[id];
  unread.push_back(std::move(packet));
  if (unread.size() == 1) arrive(id);
  plan_turn(0ns);
}

void Host::on_closed(ConnectionId id, std::optional<std::uint16_t> code) {
  for (std::size_t left = unread_[id].size(); left > 0; --left) read(id);  // they came before
  unread_.erase(id);
  identities_.erase(id);
  gates_.erase(id);
  ready_.erase(id);
  world_.checker.on_disconnected(*this, id);
  input(ConnectionClosed{id, code, code ? "closed by the peer" : "connection lost"});
}

std::optional<FlatPacket> Host::pull(ConnectionId id) {
  if (!side_ || blocked_) return {};
  if (!ready_.contains(id)) return {};
  auto packet = side_->next_packet(id, now());
  // Taking a packet may have changed when the side wants to be called, and may have made actions.
  if (!draining_ && !drain_planned_) {
    drain_planned_ = true;
    world_.schedule.after(0ns, [this, life = life_] {
      if (life == life_ && !blocked_) drain();
    });
  }
  // As a socket does, which asks no more until it hears that there is something.
  if (!packet || !packet->more) ready_.erase(id);
  if (!packet) return {};
  FlatPacket flat{packet->text, {}};
  flat.bytes.reserve(packet->size());
  for (const auto& piece : packet->pieces) {
    flat.bytes.insert(flat.bytes.end(), piece.view().begin(), piece.view().end());
  }
  if (flat.bytes.empty()) violated("a side sends an empty packet");
  world_.digest.add_packet(index_, world_.schedule.now(), id, flat.text, flat.bytes);
  world_.checker.on_sent(*this, id, flat);
  return flat;
}

}  // namespace connect_bridge::sim
