// The status file (docs/config.md, `status_file`).
#pragma once

#include <string>

#include "ros/node/node.hpp"

namespace connect_bridge {

// Replaces the file in one step; returns what went wrong, or nothing.
std::string write_atomically(const std::string& file, const std::string& text);

class StatusFile {
 public:
  explicit StatusFile(const ros::Node& node) : node_(node) {}

  // A problem is logged when it begins, not each time.
  void write(const std::string& file, const std::string& text);

 private:
  const ros::Node& node_;
  std::string problem_;
};

}  // namespace connect_bridge
