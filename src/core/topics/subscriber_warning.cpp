#include "core/topics/subscriber_warning.hpp"

#include "core/topics/import_context.hpp"
#include "core/topics/mirror.hpp"

namespace connect_bridge {
namespace {

// A graph knows an endpoint before the name of its node, if that ever has one.
constexpr Duration kSubscriberNaming = std::chrono::seconds(2);

}  // namespace

void SubscriberWarning::look(const Qos& qos, const Now& now) {
  const TopicState* topic = context_.graph.find(mirror_.key().first);
  if (!topic || !context_.graph_options.qos_must_fit) return;
  // When the time for names is over, those that still have none are logged without one.
  const bool patient = !unnamed_ || unnamed_.at() > now.steady;
  const auto found = incompatible_subscribers(*topic, qos, mirror_.origin().node, patient);
  for (const auto& line : found.lines) context_.tell_once(mirror_, LogLevel::kWarn, line);
  if (found.unnamed && !unnamed_)
    unnamed_ = context_.timers.set(now.steady + kSubscriberNaming, &mirror_);
  if (!patient) unnamed_.cancel();
}

}  // namespace connect_bridge
