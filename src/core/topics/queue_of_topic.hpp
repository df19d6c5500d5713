// How an exported topic waits in the queue of a link.
#pragma once

#include <cstdint>

#include "core/flow/queue_options.hpp"
#include "core/policy/treatment.hpp"
#include "core/topics/options.hpp"
#include "core/topics/origins.hpp"

namespace connect_bridge {

// The simulated time of the graph: of it only the newest message is worth anything.
[[nodiscard]] bool is_clock(const TopicKey& key);

// The rule's, else by name and type.
[[nodiscard]] Priority priority_of(const TopicKey& key, const Treatment& treatment);

// What the rule leaves open follows from the QoS of the publishers. `history_depth`: how many
// samples of one publisher a late subscriber here would get.
[[nodiscard]] QueueOptions queue_of(const TopicKey& key, const Origins& origins,
                                    std::uint64_t history_depth, const Treatment& treatment,
                                    Keep keep, const TopicOptions& options);

// What is known of a topic's publishers, after the rule's overrides.
[[nodiscard]] TopicTraits traits_of(const Origins& origins, bool has_header,
                                    const Treatment& treatment);

}  // namespace connect_bridge
