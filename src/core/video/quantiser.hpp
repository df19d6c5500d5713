// The quantiser for the next picture, by the sizes of those before.
#pragma once

#include <cstdint>
#include <optional>

namespace connect_bridge::video {

// Bytes are those of the frame. The product of a picture's bytes and a power of its quantiser's
// step hardly depends on the quantiser: its logarithm is the picture's complexity.
class QuantiserControl {
 public:
  // Better pictures cost twice the bytes for nothing that is seen; worse ones show less than fewer
  // or smaller ones.
  static constexpr std::uint8_t kBest = 28;
  static constexpr std::uint8_t kWorst = 52;

  explicit QuantiserControl(std::uint64_t pixels);

  // The finest that makes the next picture no larger, between kBest and kWorst. `difference` is
  // that of the picture to the one before, in any unit; 0: not known.
  [[nodiscard]] std::uint8_t quantiser(bool base, double bytes, double difference) const;
  // A picture has been made.
  void made(bool base, std::uint8_t quantiser, double bytes, double difference);

  // The pictures have another size from now on, and so many times the bytes.
  void scale(double times);

  // Bytes of a picture with an ordinary difference.
  [[nodiscard]] double bytes_at(bool base, std::uint8_t quantiser) const;

 private:
  [[nodiscard]] double cost_of(bool base, std::uint8_t quantiser) const;
  [[nodiscard]] double raised(bool base, double difference) const;

  double base_;
  double delta_;
  bool delta_known_ = false;
  double ordinary_ = 0;   // difference; 0: not known
  double last_step_ = 0;  // of the picture before, its logarithm; 0: there is none
};

}  // namespace connect_bridge::video
