// Which subscribers here cannot receive from a mirror.
#pragma once

#include "core/base/qos.hpp"
#include "core/base/timers.hpp"

namespace connect_bridge {

struct ImportContext;
class Mirror;

// Logs each once, by the names of their nodes: one that the graph does not tell at first is waited
// for. Owned by the mirror. Single-threaded.
class SubscriberWarning {
 public:
  SubscriberWarning(ImportContext& context, Mirror& mirror) : context_(context), mirror_(mirror) {}

  // The mirror exists with this QoS.
  void look(const Qos& qos, const Now& now);
  [[nodiscard]] bool is_due(const Now& now) const {
    return unnamed_ && unnamed_.at() <= now.steady;
  }
  // It does not exist any longer.
  void end() { unnamed_.cancel(); }

 private:
  ImportContext& context_;
  Mirror& mirror_;
  Timers<Mirror*>::Timer unnamed_;  // then those without a name yet are logged, too
};

}  // namespace connect_bridge
