// Finds the publisher that a handle of Cyclone DDS means.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "ros/rcl/publisher_ids.hpp"

namespace connect_bridge::ros {

// Reads the built-in topic in which Cyclone DDS lists all writers ("DCPSPublication", DDS 1.4
// section 2.2.5): its instances have the handles that rmw_cyclonedds_cpp gives with samples, and
// its samples contain the ids of the graph. Cyclone DDS is found in the process, where the
// middleware has loaded it; it is not linked. Thread: one at a time.
class CyclonePublishers {
 public:
  // Whether Cyclone DDS is in this process, with all functions that are needed.
  [[nodiscard]] static bool available();

  // `domain` is the node's domain id; its context lives longer than this.
  explicit CyclonePublishers(std::size_t domain) : domain_(static_cast<std::uint32_t>(domain)) {}
  CyclonePublishers(const CyclonePublishers&) = delete;
  CyclonePublishers& operator=(const CyclonePublishers&) = delete;
  ~CyclonePublishers();

  // Publishers that came or went since the last call; the first call returns all.
  std::vector<PublisherChange> changes();

 private:
  [[nodiscard]] bool open();
  void close();

  const std::uint32_t domain_;
  std::int32_t reader_ = 0;  // 0: none
};

}  // namespace connect_bridge::ros
