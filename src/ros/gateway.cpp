#include "ros/gateway.hpp"

#include <bit>
#include <deque>
#include <unordered_map>
#include <utility>

#include "core/base/check.hpp"
#include "ros/entities/ready_list.hpp"
#include "ros/graph/graph_watcher.hpp"
#include "ros/node/own_endpoints.hpp"
#include "ros/node/proxy_nodes.hpp"
#include "ros/rcl/qos.hpp"
#include "ros/services/services.hpp"
#include "ros/topics/mirror.hpp"
#include "ros/topics/subscription.hpp"
#include "ros/topics/time_source.hpp"
#include "ros/types/type_supports.hpp"

namespace connect_bridge::ros {
namespace {

enum SlotKind : std::uint32_t {
  kSubscription,
  kMirror,
  kServiceMirror,
  kServiceClient,
  kGraph,
  kClock
};

// rmw_fastrtps was seen to return empty samples without end after a large one was lost in part.
// That many in a row are more than a queue of real ones would be.
constexpr int kInvalidInRowMax = 32;

template <class Id, class Entity>
using Entities = std::unordered_map<Id, std::unique_ptr<Entity>>;

template <class T, class... Others>
constexpr bool kIsOneOf = (std::is_same_v<T, Others> || ...);

template <class T>
constexpr bool kIsForTopics = kIsOneOf<T, CreateSubscription, DestroySubscription, CreateMirror,
                                       DestroyMirror, Publish, RefreshGraph>;
template <class T>
constexpr bool kIsForServices =
    kIsOneOf<T, CreateServiceMirror, DestroyServiceMirror, SendResponse, DropRequest,
             CreateServiceClient, DestroyServiceClient, SendRequest, DropInvocation>;

std::uint32_t ready_bit(GraphNews news) {
  switch (news) {
    case GraphNews::kTouched: return kReadyChanged;
    case GraphNews::kRead: return kReadyMessage;
    case GraphNews::kLook: break;
  }
  return kReadyLook;
}

}  // namespace

struct Gateway::State {
  State(Node& the_node, const GatewayOptions& the_options, std::function<void()> wake)
      : node(the_node), options(the_options), ready(std::move(wake)) {}

  ServicePorts service_ports() {
    return ServicePorts{node,
                        types,
                        ready,
                        proxies,
                        buffer,
                        options.message_bytes_max,
                        [this](Input input) { report(std::move(input)); },
                        [this](std::set<std::string> names) { graph->watch(std::move(names)); },
                        [this](Duration delay) { graph->look_again(delay); }};
  }

  std::optional<Input> step(ReadyList::Slot& slot);
  std::optional<Input> step_subscription(ReadyList::Slot& slot, Subscription& subscription);
  std::optional<Input> take(ReadyList::Slot& slot, Subscription& subscription);
  std::optional<Input> invalid_sample(ReadyList::Slot& slot, Subscription& subscription);
  std::optional<Input> step_graph(ReadyList::Slot& slot);
  void report(Input input);

  Node& node;
  const GatewayOptions options;
  ReadyList ready;
  TypeSupports types;
  TakeBuffer buffer;
  ProxyNodes proxies{node,
                     [this](const std::string& name) { return graph && graph->has_node(name); }};
  Entities<SubscriptionId, Subscription> subscriptions;
  Entities<MirrorId, Mirror> mirrors;
  Services services{service_ports(), kServiceMirror, kServiceClient};
  std::unique_ptr<TimeSource> time;
  std::unique_ptr<GraphWatcher> graph;  // its thread ends before the list it marks
  std::deque<ReadyList::Slot*> turns;
  std::deque<Input> reports;
  std::unordered_map<MirrorId, std::uint64_t> refused;  // samples, not yet told
  GatewayCounters counters;
  int takes = 0;          // of this drain
  std::size_t bytes = 0;  // of this drain
};

Gateway::Gateway(Node& node, const GatewayOptions& options, std::function<void()> wake)
    : state_(std::make_unique<State>(node, options, std::move(wake))) {
  State& state = *state_;
  auto* clock = state.ready.acquire(&state, kClock);
  state.time = std::make_unique<TimeSource>(node, state.types, clock);
  auto* slot = state.ready.acquire(&state, kGraph);
  state.graph = std::make_unique<GraphWatcher>(node, options.graph_pause, [slot](GraphNews news) {
    ReadyList::mark(slot, ready_bit(news));
  });
}

Gateway::~Gateway() {
  state_->graph.reset();
  state_->subscriptions.clear();
  state_->mirrors.clear();
  state_->services.clear();
}

bool Gateway::drain(const std::function<void(Input&&)>& sink) {
  State& state = *state_;
  state.ready.collect(state.turns);
  for (std::size_t n = state.reports.size(); n > 0; --n) {
    Input input = std::move(state.reports.front());
    state.reports.pop_front();
    sink(std::move(input));
  }
  for (const auto& [mirror, count] : std::exchange(state.refused, {})) {
    sink(PublishFailed{mirror, count});
  }
  state.takes = 0;
  state.bytes = 0;
  while (!state.turns.empty() && state.takes < state.options.takes_per_wake_max &&
         state.bytes < state.options.bytes_per_wake_max) {
    ReadyList::Slot& slot = *state.turns.front();
    state.turns.pop_front();
    slot.in_turn = false;
    if (slot.owner == nullptr || slot.bits_of_turn == 0) continue;
    auto input = state.step(slot);
    if (slot.bits_of_turn != 0) {
      slot.in_turn = true;
      state.turns.push_back(&slot);
    }
    // Last, because the sink may destroy the entity and give its slot to another one.
    if (input) sink(std::move(*input));
  }
  return !state.turns.empty() || !state.reports.empty() || !state.refused.empty();
}

// Does one thing for this slot and clears the bit when that was all of it.
std::optional<Input> Gateway::State::step(ReadyList::Slot& slot) {
  switch (slot.kind) {
    case kSubscription: return step_subscription(slot, *static_cast<Subscription*>(slot.owner));
    case kMirror: {
      slot.bits_of_turn = 0;
      auto& mirror = *static_cast<Mirror*>(slot.owner);
      const auto policy = mirror.take_incompatible_policy();
      if (!policy) return std::nullopt;
      return QosIncompatible{mirror.topic(), *policy, true};
    }
    case kServiceMirror: ++takes; return services.step_mirror(slot, bytes);
    case kServiceClient: ++takes; return services.step_client(slot, bytes);
    case kGraph: return step_graph(slot);
    default:
      slot.bits_of_turn = 0;
      time->drain();
      return std::nullopt;
  }
}

std::optional<Input> Gateway::State::step_graph(ReadyList::Slot& slot) {
  const std::uint32_t bits = std::exchange(slot.bits_of_turn, 0);
  services.look_at_graph((bits & kReadyChanged) != 0);
  auto graph_now = graph->take();
  if (!graph_now) return std::nullopt;
  return std::move(*graph_now);
}

std::optional<Input> Gateway::State::step_subscription(ReadyList::Slot& slot,
                                                       Subscription& subscription) {
  if (slot.bits_of_turn & kReadyIncompatible) {
    slot.bits_of_turn &= ~kReadyIncompatible;
    const auto policy = subscription.take_incompatible_policy();
    if (!policy) return std::nullopt;
    return QosIncompatible{subscription.topic(), *policy, false};
  }
  if (slot.bits_of_turn & kReadyLost) {
    slot.bits_of_turn &= ~kReadyLost;
    const auto lost = subscription.take_lost();
    if (lost == 0) return std::nullopt;
    return MessagesLost{subscription.id(), lost, false};
  }
  return take(slot, subscription);
}

std::optional<Input> Gateway::State::take(ReadyList::Slot& slot, Subscription& subscription) {
  MessageTaken message;
  ++takes;
  switch (subscription.take(buffer, message)) {
    case Subscription::Taken::kNothing:
      slot.bits_of_turn &= ~kReadyMessage;
      --takes;
      return std::nullopt;
    case Subscription::Taken::kInvalid: return invalid_sample(slot, subscription);
    case Subscription::Taken::kSample: break;
  }
  subscription.invalid_in_row = 0;
  bytes += message.payload.size();
  if (node.own().contains(message.origin)) {
    ++counters.own_samples;
    return std::nullopt;
  }
  if (message.payload.size() > options.message_bytes_max) {
    ++counters.too_large;
    return MessagesLost{subscription.id(), 1, true};
  }
  ++counters.taken;
  return Input{std::move(message)};
}

std::optional<Input> Gateway::State::invalid_sample(ReadyList::Slot& slot,
                                                    Subscription& subscription) {
  ++counters.invalid;
  if (++subscription.invalid_in_row < kInvalidInRowMax) return std::nullopt;
  subscription.invalid_in_row = 0;
  ++counters.recreated;
  node.log(LogLevel::kWarn, "the middleware returns empty samples of " + subscription.topic() +
                                " without end: subscribing anew");
  slot.bits_of_turn = 0;
  subscription.close();
  const auto problem = subscription.open();
  if (!problem) return MessagesLost{subscription.id(), 1, false};
  const SubscriptionId id = subscription.id();
  ready.release(&slot);
  subscriptions.erase(id);
  return SubscriptionFailed{id, "failed", *problem};
}

void Gateway::State::report(Input input) {
  reports.push_back(std::move(input));
  ready.wake();
}

bool Gateway::apply(const Action& action) {
  return std::visit(
      [this](const auto& one) {
        using T = std::decay_t<decltype(one)>;
        if constexpr (kIsForTopics<T>) {
          apply(one);
          return true;
        } else if constexpr (kIsForServices<T>) {
          state_->services.apply(one);
          return true;
        } else {
          return false;
        }
      },
      action);
}

void Gateway::apply(const CreateSubscription& action) {
  State& state = *state_;
  const auto type = state.types.message(action.type, action.type_hash);
  if (const auto* refusal = std::get_if<TypeRefusal>(&type)) {
    return state.report(SubscriptionFailed{action.id, refusal->code, refusal->reason});
  }
  auto* slot = state.ready.acquire(nullptr, kSubscription);
  auto made = std::make_unique<Subscription>(
      state.node, action.id,
      Subscription::Setup{action.topic, std::get<0>(type), to_rmw(action.qos), true}, slot);
  slot->owner = made.get();
  if (const auto problem = made->open()) {
    state.ready.release(slot);
    return state.report(SubscriptionFailed{action.id, "failed", *problem});
  }
  const bool inserted = state.subscriptions.emplace(action.id, std::move(made)).second;
  CONNECT_CHECK(inserted);
}

void Gateway::apply(const DestroySubscription& action) {
  const auto found = state_->subscriptions.find(action.id);
  if (found == state_->subscriptions.end()) return;
  ReadyList::Slot* slot = found->second->slot();
  state_->subscriptions.erase(found);
  state_->ready.release(slot);
}

void Gateway::apply(const CreateMirror& action) {
  State& state = *state_;
  const auto type = state.types.message(action.type, action.type_hash);
  if (const auto* refusal = std::get_if<TypeRefusal>(&type)) {
    return state.report(MirrorFailed{action.id, refusal->code, refusal->reason});
  }
  auto* slot = state.ready.acquire(nullptr, kMirror);
  auto made =
      std::make_unique<Mirror>(state.node, state.proxies.get(action.node), action.topic, slot);
  slot->owner = made.get();
  if (const auto problem = made->open(std::get<0>(type), to_rmw(action.qos))) {
    state.ready.release(slot);
    return state.report(MirrorFailed{action.id, "failed", *problem});
  }
  const bool inserted = state.mirrors.emplace(action.id, std::move(made)).second;
  CONNECT_CHECK(inserted);
}

void Gateway::apply(const DestroyMirror& action) {
  const auto found = state_->mirrors.find(action.id);
  if (found == state_->mirrors.end()) return;
  ReadyList::Slot* slot = found->second->slot();
  state_->mirrors.erase(found);
  state_->ready.release(slot);
}

void Gateway::apply(const Publish& action) {
  const auto found = state_->mirrors.find(action.mirror);
  if (found == state_->mirrors.end()) return;
  const auto problem = found->second->publish(action.payload.view());
  if (!problem) {
    ++state_->counters.published;
    return;
  }
  if (state_->refused[action.mirror]++ == 0) state_->ready.wake();
  if (std::has_single_bit(++state_->counters.publish_failures)) {
    state_->node.log(LogLevel::kWarn, *problem + " (failures so far: " +
                                          std::to_string(state_->counters.publish_failures) + ")");
  }
}

void Gateway::apply(const RefreshGraph&) {
  state_->graph->refresh();
}

void Gateway::set_use_sim_time(bool on) {
  state_->time->set(on);
}

GatewayCounters Gateway::counters() const {
  GatewayCounters counters = state_->counters;
  counters.graph_readings = state_->graph->readings();
  counters.graph_reading = state_->graph->reading();
  counters.subscriptions = static_cast<std::uint32_t>(state_->subscriptions.size());
  counters.mirrors = static_cast<std::uint32_t>(state_->mirrors.size());
  const Services& services = state_->services;
  counters.requests = services.counters().requests;
  counters.responses = services.counters().responses;
  counters.refused_calls = services.counters().refused;
  counters.service_mirrors = static_cast<std::uint32_t>(services.mirrors());
  counters.service_clients = static_cast<std::uint32_t>(services.clients());
  counters.pending_calls = static_cast<std::uint32_t>(services.pending());
  counters.proxy_nodes = static_cast<std::uint32_t>(state_->proxies.size());
  return counters;
}

}  // namespace connect_bridge::ros
