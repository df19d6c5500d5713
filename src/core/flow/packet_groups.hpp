// Packets of videos that refer to each other, of all publishers of a channel.
#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <unordered_map>
#include <utility>

#include "core/base/ids.hpp"
#include "core/flow/out_message.hpp"

namespace connect_bridge {

// A packet that refers to one that did not leave cannot be decoded: neither can those behind it, up
// to the next key frame of its camera. Packets that were lost before they came leave a gap in the
// order of their publisher, and may have been of any of its cameras. Belongs to a channel's queue;
// single-threaded.
class PacketGroups {
 public:
  // A rate left this packet out: that is no gap, and its camera begins again by itself.
  void left_out(OriginId origin, std::uint64_t order) {
    const auto known = publishers_.find(origin);
    if (known == publishers_.end() || order <= known->second.last) return;
    if (known->second.left_out.size() < kLeftOutMax) known->second.left_out.insert(order);
  }
  // The message has come, in its publisher's order.
  void came(OutMessage& message) {
    const auto known = publishers_.find(message.subject.origin());
    const bool is_packet = message.video != VideoPart::kNone;
    if (message.order == 0 || (!is_packet && known == publishers_.end())) return;
    Publisher& publisher = publishers_[message.subject.origin()];
    publisher.skip_left_out();
    if (message.order != publisher.last + 1) publisher.miss();
    publisher.last = message.order;
    if (is_packet)  // else parameters alone, to which no picture refers
      message.refers_to = std::exchange(publisher.of(message.camera).came, message.order);
  }
  // Is the next packet of its camera of no use? Then it is dropped.
  [[nodiscard]] bool misses(const OutMessage& message) {
    if (message.video != VideoPart::kRefers || message.order == 0) return false;
    Camera& camera = publishers_[message.subject.origin()].of(message.camera);
    if (message.refers_to != kLost && message.refers_to == camera.left) return false;
    // Without key frames pictures are renewed in parts, and whole again after some time.
    return ++camera.skipped <= kSkippedMax;  // mutant: packets_of_lost_ones
  }
  void left(const OutMessage& message) {
    if (message.video == VideoPart::kNone || message.order == 0) return;
    Camera& camera = publishers_[message.subject.origin()].of(message.camera);
    camera.left = message.order;
    camera.skipped = 0;
  }
  // The message came and was dropped, perhaps while it left. Parameters may be of any camera.
  void dropped(const OutMessage& message) {
    const auto known = publishers_.find(message.subject.origin());
    if (known == publishers_.end()) return;
    for (auto& [id, camera] : known->second.cameras)
      if (message.video == VideoPart::kNone || camera.left == message.order) camera.left = kLost;
  }
  void forget(OriginId origin) { publishers_.erase(origin); }

  static constexpr std::uint32_t kSkippedMax = 300;  // ten seconds of 30 a second
  static constexpr std::size_t kLeftOutMax = 1024;   // of a publisher; beyond it they are a gap
  static constexpr std::size_t kCamerasMax = 64;     // of a publisher; beyond it all begin again

 private:
  static constexpr std::uint64_t kLost = ~std::uint64_t{0};

  struct Camera {
    std::uint64_t came = 0;  // order of its last packet; kLost: one may have been lost since
    std::uint64_t left = 0;
    std::uint32_t skipped = 0;
  };
  struct Publisher {
    std::uint64_t last = 0;   // order of what came
    std::uint64_t first = 0;  // of a new camera, as `came`
    std::unordered_map<std::uint64_t, Camera> cameras;
    std::set<std::uint64_t> left_out;  // behind `last`

    void skip_left_out() {
      while (left_out.erase(last + 1) > 0) ++last;
      left_out.erase(left_out.begin(), left_out.upper_bound(last));
    }
    void miss() {
      first = kLost;
      for (auto& [id, camera] : cameras) camera.came = kLost;  // mutant: packets_of_any_camera
    }
    Camera& of(std::uint64_t id) {
      if (cameras.size() >= kCamerasMax && !cameras.contains(id)) {
        cameras.clear();
        first = kLost;
      }
      return cameras.try_emplace(id, Camera{first, 0, 0}).first->second;
    }
  };
  std::unordered_map<OriginId, Publisher> publishers_;
};

}  // namespace connect_bridge
