#include "core/video/jpeg.hpp"

#ifdef CONNECT_VIDEO
#include <turbojpeg.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <string_view>
#endif

namespace connect_bridge::video {

#ifdef CONNECT_VIDEO
bool has_jpeg() {
  return true;
}

namespace {

constexpr int kQuality = 90;
// A progressive JPEG has some ten; each takes as long as the whole picture.
constexpr int kScansMax = 20;

// Scans of the picture and its thumbnails (ITU-T T.81, marker SOS).
int scans(ByteView jpeg) {
  constexpr std::array<std::uint8_t, 2> kScan = {0xff, 0xda};
  int found = 0;
  for (auto at = jpeg.begin(); found <= kScansMax; ++found) {
    at = std::search(at, jpeg.end(), kScan.begin(), kScan.end());
    if (at == jpeg.end()) break;
    at += kScan.size();
  }
  return found;
}

// A part of a picture that lies elsewhere.
struct PlaneView {
  const std::uint8_t* bytes = nullptr;
  std::size_t step = 0;
};

void copy_plane(PlaneView from, Size size, std::uint8_t* to, std::size_t to_step) {
  for (std::uint32_t y = 0; y < size.height; ++y)
    std::memcpy(to + y * to_step, from.bytes + y * from.step, size.width);
}

// So many columns and rows of luma share one value of chroma.
struct Sampling {
  std::uint32_t columns = 1;
  std::uint32_t rows = 1;
};

// The mean of four pixels, of which those behind an odd side are the last ones again.
void halve_chroma(PlaneView from, Sampling sampling, Size luma, std::uint8_t* to) {
  const Size chroma{(luma.width + 1) / 2, (luma.height + 1) / 2};
  if (sampling.columns == 2 && sampling.rows == 2)
    return copy_plane(from, chroma, to, chroma.width);
  for (std::uint32_t y = 0; y < chroma.height; ++y) {
    const auto row = [&](std::uint32_t of) {
      return from.bytes + std::min(of, luma.height - 1) / sampling.rows * from.step;
    };
    const std::uint8_t* const upper = row(2 * y);
    const std::uint8_t* const lower = row(2 * y + 1);
    std::uint8_t* const out = to + std::size_t{y} * chroma.width;
    for (std::uint32_t x = 0; x < chroma.width; ++x) {
      const std::uint32_t left = 2 * x / sampling.columns;
      const std::uint32_t right = std::min(2 * x + 1, luma.width - 1) / sampling.columns;
      out[x] = static_cast<std::uint8_t>(
          (upper[left] + upper[right] + lower[left] + lower[right] + 2) / 4);
    }
  }
}

}  // namespace

struct JpegReader::Context {
  std::unique_ptr<void, int (*)(void*)> codec{tjInitDecompress(), tjDestroy};
  std::array<Bytes, 3> planes;

  struct Kind {
    int subsampling = 0;
    bool is_grey = false;
  };
  [[nodiscard]] std::optional<Kind> kind_of(ByteView jpeg, const Shape& shape) const {
    int width = 0, height = 0, subsampling = -1, colours = -1;
    if (tjDecompressHeader3(codec.get(), jpeg.data(), jpeg.size(), &width, &height, &subsampling,
                            &colours) != 0)
      return std::nullopt;
    const bool is_grey = colours == TJCS_GRAY;
    if ((!is_grey && colours != TJCS_YCbCr) || is_grey != shape.is_grey_jpeg()) return std::nullopt;
    if (subsampling < 0 || subsampling >= TJ_NUMSAMP) return std::nullopt;
    if (Size{static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height)} != shape.size)
      return std::nullopt;
    return Kind{subsampling, is_grey};
  }

  // The faults with which a camera's JPEG still shows its picture. The code alone would not do: it
  // stays that of a warning where an error follows one.
  [[nodiscard]] bool is_only_damaged() const {
    const std::string_view why = tjGetErrorStr2(codec.get());
    return tjGetErrorCode(codec.get()) == TJERR_WARNING &&
           (why.find("remature end") != why.npos || why.find("Corrupt JPEG data") != why.npos);
  }

  [[nodiscard]] bool read(ByteView jpeg, const Shape& shape, Yuv& to) {
    if (scans(jpeg) > kScansMax) return false;
    const auto kind = codec ? kind_of(jpeg, shape) : std::nullopt;
    if (!kind) return false;
    const auto [width, height] = shape.size;
    std::array<unsigned char*, 3> at{};
    std::array<int, 3> steps{};
    for (int i = 0; i < (kind->is_grey ? 1 : 3); ++i) {
      const auto place = static_cast<std::size_t>(i);
      steps[place] = tjPlaneWidth(i, static_cast<int>(width), kind->subsampling);
      const int rows = tjPlaneHeight(i, static_cast<int>(height), kind->subsampling);
      if (steps[place] <= 0 || rows <= 0) return false;
      planes[place].resize(static_cast<std::size_t>(steps[place]) * static_cast<std::size_t>(rows));
      at[place] = planes[place].data();
    }
    if (tjDecompressToYUVPlanes(codec.get(), jpeg.data(), jpeg.size(), at.data(), 0, steps.data(),
                                0, TJFLAG_LIMITSCANS) != 0 &&
        !is_only_damaged())
      return false;
    const auto plane = [&](std::size_t i) {
      return PlaneView{at[i], static_cast<std::size_t>(steps[i])};
    };
    to.resize(shape.size);
    copy_plane(plane(0), shape.size, to.y(), width);
    if (kind->is_grey) {
      const Size chroma = to.chroma();
      std::memset(to.u(), 128, std::size_t{2} * chroma.width * chroma.height);
      return true;
    }
    const Sampling sampling{static_cast<std::uint32_t>(tjMCUWidth[kind->subsampling]) / 8,
                            static_cast<std::uint32_t>(tjMCUHeight[kind->subsampling]) / 8};
    halve_chroma(plane(1), sampling, shape.size, to.u());
    halve_chroma(plane(2), sampling, shape.size, to.v());
    return true;
  }
};

JpegReader::JpegReader() : context_(std::make_unique<Context>()) {}

bool JpegReader::read(ByteView jpeg, const Shape& shape, Yuv& to) {
  if (context_->read(jpeg, shape, to)) return true;
  // After a damaged head libturbojpeg 2.1 refuses the next JPEG, too.
  context_ = std::make_unique<Context>();
  return false;
}

struct JpegWriter::Context {
  std::unique_ptr<void, int (*)(void*)> codec{tjInitCompress(), tjDestroy};
  Bytes even;
  Bytes written;

  // libturbojpeg reads planes of even sides, where chroma is halved.
  [[nodiscard]] PlaneView even_luma(const YuvView& picture) {
    const auto [width, height] = picture.size;
    const std::size_t step = width + width % 2, rows = height + height % 2;
    if (step == width && rows == height) return {picture.y, picture.y_step};
    even.resize(step * rows);
    copy_plane({picture.y, picture.y_step}, picture.size, even.data(), step);
    if (step > width)
      for (std::size_t y = 0; y < height; ++y) even[y * step + width] = even[y * step + width - 1];
    if (rows > height) std::memcpy(even.data() + height * step, &even[(height - 1) * step], step);
    return {even.data(), step};
  }

  [[nodiscard]] ByteView write(const YuvView& picture, bool is_grey) {
    if (!codec) return {};
    const int sampling = is_grey ? TJSAMP_GRAY : TJSAMP_420;
    const int width = static_cast<int>(picture.size.width);
    const int height = static_cast<int>(picture.size.height);
    const PlaneView luma = is_grey ? PlaneView{picture.y, picture.y_step} : even_luma(picture);
    const unsigned char* planes[] = {luma.bytes, picture.u, picture.v};
    const int chroma_step = static_cast<int>(picture.uv_step);
    const int steps[] = {static_cast<int>(luma.step), chroma_step, chroma_step};
    written.resize(tjBufSize(width, height, sampling));
    unsigned char* at = written.data();
    unsigned long bytes = written.size();
    if (tjCompressFromYUVPlanes(codec.get(), planes, width, steps, height, sampling, &at, &bytes,
                                kQuality, TJFLAG_NOREALLOC | TJFLAG_ACCURATEDCT) != 0)
      return {};
    return ByteView(written).first(bytes);
  }
};

JpegWriter::JpegWriter() : context_(std::make_unique<Context>()) {}

ByteView JpegWriter::write(const YuvView& picture, bool is_grey) {
  return context_->write(picture, is_grey);
}

#else

bool has_jpeg() {
  return false;
}
struct JpegReader::Context {};
struct JpegWriter::Context {};
JpegReader::JpegReader() = default;
bool JpegReader::read(ByteView, const Shape&, Yuv&) {
  return false;
}
JpegWriter::JpegWriter() = default;
ByteView JpegWriter::write(const YuvView&, bool) {
  return {};
}

#endif

JpegReader::~JpegReader() = default;
JpegReader::JpegReader(JpegReader&&) noexcept = default;
JpegReader& JpegReader::operator=(JpegReader&&) noexcept = default;
JpegWriter::~JpegWriter() = default;
JpegWriter::JpegWriter(JpegWriter&&) noexcept = default;
JpegWriter& JpegWriter::operator=(JpegWriter&&) noexcept = default;

}  // namespace connect_bridge::video
