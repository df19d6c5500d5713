#include "core/video/encoder.hpp"

#include <cstdlib>

#include "core/video/body.hpp"
#include "core/video/jpeg.hpp"
#include "core/video/quantiser.hpp"
#include "core/video/vp8.hpp"
#include "core/video/yuv.hpp"

namespace connect_bridge::video {
namespace {

// Half size begins where so many pictures in a row would be too large at the worst quantiser, and
// ends where so many whole ones would have the wanted size.
constexpr int kTightMax = 3;
constexpr int kRoomyMax = 60;
// Half the width and height take half the bytes at the same quantiser.
constexpr double kHalfBytes = 0.5;

constexpr std::uint32_t kPointDistance = 4;

bool same(const Shape& a, const Shape& b) {
  return a.encoding == b.encoding && a.size == b.size;
}

}  // namespace

struct PictureEncoder::Stream {
  // The mean difference of luma to the picture before, at every fourth point of every fourth row.
  class Difference {
   public:
    // 0: nothing to compare with.
    double to_last(const YuvView& picture) {
      const std::size_t columns = (picture.size.width + kPointDistance - 1) / kPointDistance;
      const std::size_t rows = (picture.size.height + kPointDistance - 1) / kPointDistance;
      const bool known = last_.size() == columns * rows;
      last_.resize(columns * rows);
      std::uint64_t sum = 0;
      for (std::size_t y = 0; y < rows; ++y) {
        const std::uint8_t* const row = picture.y + kPointDistance * y * picture.y_step;
        std::uint8_t* const last = last_.data() + y * columns;
        for (std::size_t x = 0; x < columns; ++x) {
          const std::uint8_t point = row[kPointDistance * x];
          sum += static_cast<std::uint64_t>(std::abs(point - last[x]));
          last[x] = point;
        }
      }
      return known ? static_cast<double>(sum) / static_cast<double>(columns * rows) : 0;
    }
    void forget() { last_.clear(); }

   private:
    Bytes last_;
  };

  std::optional<Shape> shape;
  bool half = false;
  std::optional<Vp8Encoder> vp8;  // none: the next picture is a base
  QuantiserControl control{1};
  Difference difference;
  int tight = 0;
  int roomy = 0;
  JpegReader jpeg;
  Yuv whole;
  Yuv halved;

  void begin(const Shape& with) {
    shape = with;
    half = false;
    vp8.reset();
    control = QuantiserControl(std::uint64_t{with.size.width} * with.size.height);
    difference.forget();
    tight = kTightMax;  // nothing is lost by half size at the beginning
    roomy = 0;
  }

  // `wanted` is what a frame should have, `most` what it may have.
  void choose_size(double wanted, double most) {
    const double needed = control.bytes_at(false, QuantiserControl::kWorst);
    tight = !half && needed > most ? tight + 1 : 0;
    roomy = half && needed / kHalfBytes <= wanted ? roomy + 1 : 0;
    if (tight < kTightMax && roomy < kRoomyMax) return;
    half = !half;
    control.scale(half ? kHalfBytes : 1 / kHalfBytes);
    vp8.reset();
    difference.forget();
    tight = roomy = 0;
  }

  // nullopt: the JPEG cannot be decoded.
  std::optional<YuvView> convert(const PictureSample& sample) {
    if (sample.shape.is_jpeg()) {
      if (!jpeg.read(sample.data, sample.shape, whole)) return std::nullopt;
    } else {
      to_yuv(sample.data.data(), sample.shape, whole);
    }
    if (!half) return whole.view();
    halve(whole.view(), sample.shape, halved);
    return halved.view();
  }

  std::optional<Bytes> encode(const PictureSample& sample, const PictureWish& wish);
};

std::optional<Bytes> PictureEncoder::Stream::encode(const PictureSample& sample,
                                                    const PictureWish& wish) {
  if (!shape || !same(*shape, sample.shape)) begin(sample.shape);
  const auto around = static_cast<double>(kBodyHeadBytes + sample.prefix.size());
  choose_size(wish.bytes - around, wish.bytes_max - around);
  const auto picture = convert(sample);
  if (!picture) return std::nullopt;
  const bool base = wish.base || !vp8;
  if (!vp8) vp8.emplace(picture->size);
  const double differs = difference.to_last(*picture);
  const std::uint8_t quantiser = control.quantiser(base, wish.bytes - around, differs);
  const ByteView frame = vp8->encode(*picture, quantiser, base);
  if (frame.empty()) return std::nullopt;
  control.made(base, quantiser, static_cast<double>(frame.size()), differs);
  return write_body({base, half, quantiser, sample.prefix, frame, sample.shape});
}

PictureEncoder::PictureEncoder() : stream_(std::make_unique<Stream>()) {}
PictureEncoder::~PictureEncoder() = default;
PictureEncoder::PictureEncoder(PictureEncoder&&) noexcept = default;
PictureEncoder& PictureEncoder::operator=(PictureEncoder&&) noexcept = default;

std::optional<Bytes> PictureEncoder::encode(ByteView raw, const PictureWish& wish) {
  const auto sample = read_sample(raw);
  std::optional<Bytes> body;
  if (sample && is_opaque(sample->data.data(), sample->shape))
    body = stream_->encode(*sample, wish);
  if (!body) stream_->vp8.reset();
  return body;
}

}  // namespace connect_bridge::video
