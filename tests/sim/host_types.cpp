// Types that are installed at one side and not at the other, as far as a host decides that: here by
// chance.
#include "core/types/description_service.hpp"
#include "core/types/type_description.hpp"
#include "sim/checker.hpp"
#include "sim/host.hpp"
#include "sim/types.hpp"

namespace connect_bridge::sim {

using namespace std::chrono_literals;

std::string text_of_type(const std::string& type) {
  const DescribedField data{"data", FieldKind::kUint8, FieldShape::kSequence};
  return canonical_text({{type, {data}}, {}});
}

std::string hash_of_type(const std::string& type) {
  return type_hash_of(text_of_type(type));
}

// A mirror has been made: its type may be another one here, or none.
void Host::compare_types(const CreateMirror& made) {
  if (!rng_.chance(400)) return;
  const std::string here = rng_.chance(700) ? "" : "RIHS01_other";
  later(rng_.between(1us, 2ms), [id = made.id, here]() -> Input { return TypeDiffers{id, here}; });
}

// The same of a service. Another definition is used only where the rules allow that.
void Host::compare_types(const CreateServiceMirror& made) {
  if (made.type_hash.empty() || !rng_.chance(400)) return;
  const std::string here = !made.any_definition || rng_.chance(700) ? "" : "RIHS01_other";
  later(rng_.between(1us, 2ms), [id = made.id, here]() -> Input {
    return ServiceTypeDiffers{id, here};
  });
}

void Host::act(const LookUpType& action) {
  const bool known = action.hash == hash_of_type(action.type) && rng_.chance(800);
  const std::string text = known ? text_of_type(action.type) : "";
  later(rng_.between(1us, 5ms), [id = action.id, text]() -> Input {
    return TypeLookedUp{id, text};
  });
}

void Host::act(const DescribeType& action) {
  world_.checker.on_description(*this, action);
  tell("knows what " + action.type + " is made of");
}

// A node that is asked about its type. False: the client is for something else.
bool Host::asks_node(const CreateServiceClient& action) {
  if (action.type != kDescriptionServiceType) return false;
  failed_service_clients_.insert(action.id);
  if (rng_.chance(500)) return true;  // it never answers
  later(rng_.between(1us, 2ms), [id = action.id]() -> Input {
    return ServiceClientFailed{id, "type_unknown", "the type is not installed"};
  });
  return true;
}

}  // namespace connect_bridge::sim
