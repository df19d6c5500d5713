// A codec of pictures for the simulated workers. Its frames have the wanted size, and carry the
// hash of the frame before: a picture that is decoded behind another one than it was made from is a
// Violation.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>

#include "core/ports/actions.hpp"

namespace connect_bridge::sim {

class PictureCodec {
 public:
  [[nodiscard]] std::optional<Bytes> encode(const EncodePicture& job);
  [[nodiscard]] std::optional<Bytes> decode(const DecodePicture& job);
  // A job of this id that is cancelled, and has begun, has no result.
  void end(PictureId picture) {
    last_.erase(picture);
    ended_.insert(picture);
  }

 private:
  std::map<PictureId, std::uint64_t> last_;  // the hash of the last frame
  std::set<PictureId> ended_;
};

}  // namespace connect_bridge::sim
