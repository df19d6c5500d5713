// Offers to the peer of a link, and offers of the peer.
#pragma once

#include <cstdint>

#include "core/graph/side_view.hpp"
#include "core/mirrors/peer_topics.hpp"
#include "core/services/local_services.hpp"
#include "core/services/peer_services.hpp"
#include "core/topics/local_topics.hpp"

namespace connect_bridge {

// Offers the interfaces that the peer may have and that were not offered yet. Interfaces whose type
// cannot be taken here are logged, once for each type.
void offer_to(Link& link, const SideView& side, LocalTopics& topics, LocalServices& services,
              const Now& now);

// Takes channels that the peer offers. Errors: kIllegal for a number that is in use, kTooLarge
// beyond `channels_max`.
Result<Nothing> take_offer(Link& link, const Offer& offer, std::uint32_t channels_max,
                           PeerTopics& topics, PeerServices& services, const Now& now);

}  // namespace connect_bridge
