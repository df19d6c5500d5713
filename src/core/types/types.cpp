#include "core/types/types.hpp"

#include <variant>

namespace connect_bridge {

// A client of a service belongs to the calls of peers, or asks a node about a type.
void Types::handle(const Input& input, const Now& now) {
  peers.begin(now);
  if (const auto* found = std::get_if<TypeLookedUp>(&input)) {
    peers.on_looked_up(*found);
    answers.on_looked_up(*found, now);
  } else if (const auto* ready = std::get_if<ServiceReady>(&input)) {
    answers.on_ready(*ready);
  } else if (const auto* response = std::get_if<ResponseTaken>(&input)) {
    answers.on_response(*response);
  } else if (const auto* refused = std::get_if<InvocationFailed>(&input)) {
    answers.on_failed(refused->client);
  } else if (const auto* failed = std::get_if<ServiceClientFailed>(&input)) {
    answers.on_failed(failed->id);
  } else if (std::holds_alternative<TimePassed>(input)) {
    peers.on_time(now);
    answers.on_time(now);
  }
}

void Types::on_link_lost(Link& link) {
  answers.on_link_lost(link.id);
  lacks.on_link_lost(link.id);
  peers.on_link_lost(link);
}

}  // namespace connect_bridge
