// Finds the publisher that belongs to a handle of Cyclone DDS.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "ros/rcl/publisher_ids.hpp"

namespace connect_bridge::ros {

// Reads the built-in topic in which Cyclone DDS lists all writers ("DCPSPublication", DDS 1.4
// section 2.2.5). The topic's instances have the handles that rmw_cyclonedds_cpp reports with
// samples. The topic's samples contain the ids of the graph. Cyclone DDS is not linked: its
// functions are looked up in the process, where the middleware has loaded it. Thread: one at a
// time.
class CyclonePublishers {
 public:
  // True if Cyclone DDS is in this process, with all needed functions.
  [[nodiscard]] static bool available();

  // `domain`: the node's domain id. The node's context must outlive this object.
  explicit CyclonePublishers(std::size_t domain) : domain_(static_cast<std::uint32_t>(domain)) {}
  CyclonePublishers(const CyclonePublishers&) = delete;
  CyclonePublishers& operator=(const CyclonePublishers&) = delete;
  ~CyclonePublishers();

  // Publishers that came or left since the last call; the first call returns all.
  std::vector<PublisherChange> changes();

 private:
  [[nodiscard]] bool open();
  void close();

  const std::uint32_t domain_;
  std::int32_t reader_ = 0;  // 0: none
};

}  // namespace connect_bridge::ros
