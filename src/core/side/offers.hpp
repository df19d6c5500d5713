// Offers: what the peer of a link is offered, and what it offers.
#pragma once

#include <cstdint>

#include "core/graph/side_view.hpp"
#include "core/services/local_services.hpp"
#include "core/services/peer_services.hpp"
#include "core/topics/local_topics.hpp"
#include "core/topics/peer_topics.hpp"

namespace connect_bridge {

// Offers what the peer may have and has not been offered yet. What it could not get, as its type
// cannot be taken here, is in the log, once for each type.
void offer_to(Link& link, const SideView& side, LocalTopics& topics, LocalServices& services,
              const Now& now);

// The peer offers these channels. Errors: kIllegal for a number that is in use, kTooLarge beyond
// `channels_max`.
Result<Nothing> take_offer(Link& link, const Offer& offer, std::uint32_t channels_max,
                           PeerTopics& topics, PeerServices& services, const Now& now);

}  // namespace connect_bridge
