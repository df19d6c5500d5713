// What must be true of services once a world has been quiet for a while: which mirrors exist, which
// calls have been answered, and that no call is kept without an owner.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "sim/checker.hpp"
#include "sim/host.hpp"
#include "sim/service_crowd.hpp"

namespace connect_bridge::sim {

class ServiceExpectation {
 public:
  ServiceExpectation(const Middleware& middleware, const Services& services, Checker& checker,
                     const ServiceCrowd& crowd, const std::vector<std::unique_ptr<Host>>& hosts)
      : middleware_(middleware),
        services_(services),
        checker_(checker),
        crowd_(crowd),
        hosts_(hosts) {}

  // A service has one mirror in a graph that can reach a real server of it and has none itself.
  void check_mirrors() const;
  // The topics of an action are mirrored where its services are.
  void check_action_topics() const;
  // Calls under way are those that a living server still works on.
  void check_nothing_pending() const;

  // Around a round of calls.
  void begin_calls();
  void check_calls() const;

 private:
  using Key = std::pair<int, std::pair<std::string, std::string>>;  // graph, (name there, type)
  [[nodiscard]] std::map<Key, int> expected() const;
  void expect(const EndpointSpec& spec, bool service, const Host& importer,
              std::map<Key, int>& into) const;
  [[nodiscard]] bool is_local(const Key& key) const;
  // Whether it can be taken where it is; of an action all parts must be.
  [[nodiscard]] bool can_be_taken(const EndpointSpec& spec) const;

  const Middleware& middleware_;
  const Services& services_;
  Checker& checker_;
  const ServiceCrowd& crowd_;
  const std::vector<std::unique_ptr<Host>>& hosts_;
  std::map<int, std::uint32_t> called_before_;  // by caller
};

}  // namespace connect_bridge::sim
