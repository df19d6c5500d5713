// The endpoints and nodes of this process in the graph, so that it never bridges its own traffic.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <string>
#include <unordered_set>

#include "core/base/ids.hpp"

namespace connect_bridge::ros {

// All functions may be called on any thread.
class OwnEndpoints {
 public:
  // `participant_bytes`: see Middleware.
  explicit OwnEndpoints(std::size_t participant_bytes) : prefix_size_(participant_bytes) {}

  // Locks the creation of an endpoint, until add(). The graph shows an endpoint before its id is
  // known here, and contains() waits for that.
  [[nodiscard]] std::unique_lock<std::mutex> making() { return std::unique_lock(making_); }
  // Adds the id of an endpoint of ours, or notes its end. An ended id stays known for a while,
  // since its last samples may still arrive.
  void add(const Gid& gid);
  void remove(const Gid& gid);
  [[nodiscard]] bool contains(const Gid& gid) const;
  // Excludes this endpoint of ours: it is shown like anybody's, and not contained.
  void show(const Gid& gid);
  [[nodiscard]] bool shows(const Gid& gid) const;
  // A node of ours with this name: will enter or leave the graph; is in it; has left it.
  void announce_node(const std::string& full_name);
  void settle_node(const std::string& full_name);
  void remove_node(const std::string& full_name);
  // Our nodes, each with a number: kUnsettled while it enters or leaves the graph, otherwise a new
  // number for each creation. A node with the same number before and after a reading of the graph
  // was in the graph during the whole reading.
  static constexpr std::uint64_t kUnsettled = 0;
  [[nodiscard]] std::map<std::string, std::uint64_t> nodes() const;
  // A server of ours: will enter the graph; has left it.
  void announce_server(const std::string& service);
  void remove_server(const std::string& service);
  // The number of our servers that are in the graph, or about to enter or leave it, by service.
  [[nodiscard]] std::map<std::string, std::size_t> servers() const;

 private:
  // More ids than mirrors of several peers can have (core/topics/options.hpp).
  static constexpr std::size_t kEndedMax = 32'768;

  [[nodiscard]] bool is_known(const Gid& gid) const;

  const std::size_t prefix_size_;
  mutable std::mutex making_;  // taken before mutex_
  mutable std::mutex mutex_;
  bool prefix_known_ = false;
  Gid prefix_;
  std::unordered_set<Gid> ids_;
  std::unordered_set<Gid> ended_;
  std::deque<Gid> ended_order_;
  std::unordered_set<Gid> shown_;
  std::map<std::string, std::uint64_t> nodes_;
  std::uint64_t last_settled_ = kUnsettled;
  std::map<std::string, std::size_t> servers_;
};

}  // namespace connect_bridge::ros
