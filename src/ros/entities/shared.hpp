// Objects that the entities of a gateway share.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "core/base/log_limit.hpp"
#include "core/base/logged_once.hpp"
#include "core/ports/ports.hpp"
#include "ros/entities/counters.hpp"
#include "ros/entities/entity.hpp"
#include "ros/entities/ready_list.hpp"
#include "ros/node/node.hpp"
#include "ros/node/proxy_nodes.hpp"
#include "ros/rcl/distro.hpp"
#include "ros/rcl/take_buffer.hpp"
#include "ros/types/type_supports.hpp"

namespace connect_bridge::ros {

// Ended entities, until the middleware has removed them from the graph. Each removal takes some 0.1
// ms, and a lost link may end thousands of entities. So a few are destroyed at a time, and other
// entities get their turns in between. Thread: the loop's.
class Ended {
 public:
  // Time limit of free_some(); a removal that has begun is finished.
  static constexpr auto kTurn = std::chrono::milliseconds(1);

  // Adds an entity, which reports nothing from now on.
  void add(std::unique_ptr<Entity> entity) {
    entity->mute();
    const Duration farewell = entity->farewell();
    if (farewell == Duration::zero()) {
      entities_.push_back(std::move(entity));
    } else {
      leaving_.emplace(std::chrono::steady_clock::now() + farewell, std::move(entity));
    }
  }
  // Destroys the ended entities of one topic or service at once. True if there were any.
  bool free(const std::string& name) {
    const auto leaving =
        std::erase_if(leaving_, [&](const auto& entry) { return entry.second->name() == name; });
    return std::erase_if(entities_, [&](const auto& entity) { return entity->name() == name; }) +
               leaving >
           0;
  }
  // Destroys some entities. True if others are left.
  bool free_some() {
    if (entities_.empty() && leaving_.empty()) return false;
    const auto now = std::chrono::steady_clock::now();
    for (; !leaving_.empty() && leaving_.begin()->first <= now; leaving_.erase(leaving_.begin()))
      entities_.push_back(std::move(leaving_.begin()->second));
    const auto end = now + kTurn;
    while (!entities_.empty() && std::chrono::steady_clock::now() < end) entities_.pop_front();
    return !entities_.empty();
  }

  // When the next farewell is over; nullopt: there is none.
  [[nodiscard]] std::optional<std::chrono::steady_clock::time_point> next_leave() const {
    if (leaving_.empty()) return std::nullopt;
    return leaving_.begin()->first;
  }

 private:
  std::deque<std::unique_ptr<Entity>> entities_;
  // By the end of their farewell.
  std::multimap<std::chrono::steady_clock::time_point, std::unique_ptr<Entity>> leaving_;
};

// Members that all entities of a gateway use. Thread: the loop's.
struct Shared {
  Shared(Node& the_node, std::uint32_t bytes_max, bool types_not_installed,
         std::function<void()> wake, std::function<bool(const std::string& name)> is_node_taken,
         std::function<void(Duration)> look_at_graph)
      : node(the_node),
        message_bytes_max(bytes_max),
        look_again(std::move(look_at_graph)),
        types(types_not_installed),
        ready(std::move(wake)),
        proxies(the_node, std::move(is_node_taken)) {}

  // Queues an input that is not the result of a step.
  void report(Input input) {
    reports.push_back(std::move(input));
    ready.wake();
  }
  // The bytes of the message in `form`, which is reset; or the reason why it cannot be forwarded.
  std::variant<Payload, std::string> bytes_of(MessageForm& form, Batch& batch) {
    auto unwritten = form.write_to(*buffer.prepare());
    form.reset();
    if (unwritten) return *std::move(unwritten);
    Payload payload = buffer.give_away();
    batch.bytes += payload.size();
    if (payload.size() <= message_bytes_max) return payload;
    return "it has " + std::to_string(payload.size()) + " bytes, more than " +
           std::to_string(message_bytes_max);
  }
  // Logs a request or response that cannot be forwarded, at a limited rate.
  void refuse_call(const std::string& why) {
    ++counters.refused_calls;
    node.log(refusals, LogLevel::kWarn, why);
  }
  // Logs a type that is not installed, once per type (once for all parts of an action): a peer with
  // thousands of types cannot fill the log.
  void tell_not_installed(const std::string& type) {
    const auto name = parse_type_name(type);
    logged_types.on_time(Node::steady_now());
    if (!name || !logged_types.first(name->to_install())) return;
    node.log(LogLevel::kInfo, "the type " + name->to_install() +
                                  " is not installed here: its messages are forwarded unchecked");
  }
  // Logs, once, that hashes cannot be compared because one is missing; old distributions have none.
  // `hash_there`: the peer's hash of the type for which an entity is made here.
  void tell_if_unhashed(const std::string& type, const std::string& hash_there) {
    if ((distro::kTypeHashes && !hash_there.empty()) || std::exchange(logged_unhashed, true))
      return;
    const std::string silent = distro::kTypeHashes ? "the peer" : "this side";
    node.log(LogLevel::kInfo,
             "no hash shows whether " + type + " is the same here and at the peer: where " +
                 silent +
                 " knows none (in ROS 2 Humble; of services it lacks), only the names of types are "
                 "compared; said once");
  }
  // Logs, once per service and type, that nodes of this graph have another definition of it.
  void tell_other_definition(const std::string& service, const std::string& type,
                             const std::string& text) {
    logged_definitions.on_time(Node::steady_now());
    if (logged_definitions.first(service + " " + type)) node.log(LogLevel::kWarn, text);
  }
  // Memory limit of a message: many short strings take several times the memory of their bytes.
  [[nodiscard]] std::size_t memory_max() const { return std::size_t{4} * message_bytes_max; }

  Node& node;
  const std::uint32_t message_bytes_max;
  const std::function<void(Duration)> look_again;  // requests a look at servers and callers
  TypeSupports types;
  ReadyList ready;
  ProxyNodes proxies;
  TakeBuffer buffer;
  GatewayCounters counters;
  std::deque<Input> reports;
  LogLimit refusals;        // for requests and responses
  LogLimit unpublished;     // for samples
  LoggedOnce logged_types;  // types that are not installed
  LoggedOnce logged_definitions;
  bool logged_unhashed = false;
  Ended ended;  // last: these entities use the other members
};

}  // namespace connect_bridge::ros
