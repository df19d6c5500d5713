// Which publisher a handle of Cyclone DDS stands for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "ros/rcl/publisher_ids.hpp"

namespace connect_bridge::ros {

// Reads the topic that Cyclone DDS itself has of all writers ("DCPSPublication", DDS 1.4 section
// 2.2.5): its instances have the handles that rmw_cyclonedds_cpp tells with samples, and its
// samples the ids of the graph. Cyclone DDS is found in the process, where the middleware has
// loaded it; nothing is linked. Thread: one at a time.
class CyclonePublishers {
 public:
  // Whether Cyclone DDS is in this process, with all that is needed of it.
  [[nodiscard]] static bool available();

  // `domain` is the node's domain id; its context lives longer than this.
  explicit CyclonePublishers(std::size_t domain) : domain_(static_cast<std::uint32_t>(domain)) {}
  CyclonePublishers(const CyclonePublishers&) = delete;
  CyclonePublishers& operator=(const CyclonePublishers&) = delete;
  ~CyclonePublishers();

  // What has come and gone since the last call; all there is at the first.
  std::vector<PublisherChange> changes();

 private:
  [[nodiscard]] bool open();
  void close();

  const std::uint32_t domain_;
  std::int32_t reader_ = 0;  // 0: none
};

}  // namespace connect_bridge::ros
