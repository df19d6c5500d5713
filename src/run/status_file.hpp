// The status file (docs/config.md, `status_file`).
#pragma once

#include <string>

#include "ros/node/node.hpp"

namespace connect_bridge {

// Replaces the file in one step; returns what went wrong, or nothing. `lasting`: what was written
// is on the disk before the file is replaced, so a loss of power leaves the old or the new text.
std::string write_atomically(const std::string& file, const std::string& text,
                             bool lasting = false);

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
