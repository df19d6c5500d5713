// A ROS domain for a test.
#pragma once

namespace connect_bridge::ros {

// A domain id that nobody else uses for as long as this object lives: other tests, also those in
// Python, take theirs by the same locks (tools/harness/domains.py).
class Domain {
 public:
  Domain();
  ~Domain();
  Domain(const Domain&) = delete;
  Domain& operator=(const Domain&) = delete;

  [[nodiscard]] int id() const { return id_; }

 private:
  int id_ = 0;
  int lock_ = -1;
};

}  // namespace connect_bridge::ros
