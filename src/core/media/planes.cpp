#include "core/media/planes.hpp"

#include <array>
#include <charconv>
#include <string_view>

#include "core/media/layouts.hpp"

namespace connect_bridge::media {
namespace {

enum class Arrangement : std::uint8_t {
  kPixels,  // channels side by side
  kGreen,   // the same, red green blue and perhaps alpha: red and blue resemble green
  kBayer,   // squares of four
  kYuyv,    // 4:2:2
  kUyvy,
  kHalfChroma,  // rows of luma, then half as many rows of u and v side by side
  kFullChroma,  // rows of luma, then twice as many bytes of u and v
};

struct Form {
  Arrangement arrangement = Arrangement::kPixels;
  std::uint8_t width = 1;  // bytes of an element
  std::uint8_t channels = 1;
  bool is_float = false;
};

// sensor_msgs/image_encodings.hpp
struct Named {
  std::string_view encoding;
  Form form;
};
constexpr std::array kNamed{
    Named{"rgb8", {Arrangement::kGreen, 1, 3}},
    Named{"bgr8", {Arrangement::kGreen, 1, 3}},
    Named{"rgba8", {Arrangement::kGreen, 1, 4}},
    Named{"bgra8", {Arrangement::kGreen, 1, 4}},
    Named{"rgb16", {Arrangement::kPixels, 2, 3}},
    Named{"bgr16", {Arrangement::kPixels, 2, 3}},
    Named{"rgba16", {Arrangement::kPixels, 2, 4}},
    Named{"bgra16", {Arrangement::kPixels, 2, 4}},
    Named{"mono8", {Arrangement::kPixels, 1, 1}},
    Named{"mono16", {Arrangement::kPixels, 2, 1}},
    Named{"bayer_rggb8", {Arrangement::kBayer, 1, 1}},
    Named{"bayer_bggr8", {Arrangement::kBayer, 1, 1}},
    Named{"bayer_gbrg8", {Arrangement::kBayer, 1, 1}},
    Named{"bayer_grbg8", {Arrangement::kBayer, 1, 1}},
    Named{"bayer_rggb16", {Arrangement::kBayer, 2, 1}},
    Named{"bayer_bggr16", {Arrangement::kBayer, 2, 1}},
    Named{"bayer_gbrg16", {Arrangement::kBayer, 2, 1}},
    Named{"bayer_grbg16", {Arrangement::kBayer, 2, 1}},
    Named{"yuv422", {Arrangement::kUyvy, 1, 2}},
    Named{"uyvy", {Arrangement::kUyvy, 1, 2}},
    Named{"yuv422_yuy2", {Arrangement::kYuyv, 1, 2}},
    Named{"yuyv", {Arrangement::kYuyv, 1, 2}},
    Named{"nv12", {Arrangement::kHalfChroma, 1, 1}},
    Named{"nv21", {Arrangement::kHalfChroma, 1, 1}},
    Named{"nv24", {Arrangement::kFullChroma, 1, 1}},
};

// OpenCV's names: "16UC1", "32FC3".
std::optional<Form> cv_form(std::string_view encoding) {
  constexpr std::uint8_t kChannelsMax = 64;
  unsigned bits = 0;
  const char* const end = encoding.data() + encoding.size();
  const auto [letter, error] = std::from_chars(encoding.data(), end, bits);
  if (error != std::errc() || end - letter < 3 || letter[1] != 'C') return std::nullopt;
  if (bits != 8 && bits != 16 && bits != 32 && bits != 64) return std::nullopt;
  if (*letter != 'U' && *letter != 'S' && *letter != 'F') return std::nullopt;
  Form form{Arrangement::kPixels, static_cast<std::uint8_t>(bits / 8), 0, *letter == 'F'};
  const auto [rest, wrong] = std::from_chars(letter + 2, end, form.channels);
  if (wrong != std::errc() || rest != end || form.channels == 0 || form.channels > kChannelsMax)
    return std::nullopt;
  return form;
}

std::optional<Form> form_of(std::string_view encoding) {
  for (const Named& named : kNamed)
    if (named.encoding == encoding) return named.form;
  return cv_form(encoding);
}

class ImageColumns {
 public:
  explicit ImageColumns(const ImageLayout& image) : image_(image) {}

  // Bytes as they are, before and behind the data.
  void add_bytes(std::uint32_t begin, std::size_t end) {
    if (end <= begin) return;
    Column bytes;
    bytes.begin = begin;
    bytes.count = static_cast<std::uint32_t>(end - begin);
    columns_.push_back(bytes);
  }
  // `count` elements of each of these rows, from this byte of the row on.
  Column* add(std::uint32_t first_row, std::uint32_t rows, std::uint32_t begin, std::uint32_t count,
              std::uint32_t stride, std::uint8_t width, std::uint32_t row_distance = 1) {
    if (rows == 0 || count == 0) return nullptr;
    Column column;
    column.begin = image_.data.begin + first_row * image_.step + begin;
    column.rows = rows;
    column.row_stride = row_distance * image_.step;
    column.count = count;
    column.stride = static_cast<std::uint16_t>(stride);
    column.width = width;
    column.lag = 1;
    column.big_endian = image_.big_endian && width > 1;
    columns_.push_back(column);
    return &columns_.back();
  }
  void add_padding(std::uint32_t first_row, std::uint32_t rows, std::uint64_t payload) {
    const auto used = static_cast<std::uint32_t>(payload);
    if (auto* padding = add(first_row, rows, used, image_.step - used, 1, 1)) padding->lag = 0;
  }
  Columns take() { return std::move(columns_); }

 private:
  const ImageLayout& image_;
  Columns columns_;
};

void add_pixels(ImageColumns& to, const ImageLayout& image, const Form& form) {
  const std::uint32_t pixel = std::uint32_t{form.width} * form.channels;
  const auto channel = [&](std::uint32_t index) {
    return to.add(0, image.height, index * form.width, image.width, pixel, form.width);
  };
  if (form.arrangement == Arrangement::kGreen) {
    if (form.channels == 4) channel(3);
    channel(1);
    channel(0)->minus = true;
    channel(2)->minus = true;
    return;
  }
  // A camera's distances are few values, as float32, too.
  const bool ranked = form.is_float && form.width == 4;
  for (std::uint32_t i = 0; i < form.channels; ++i)
    if (Column* column = channel(i); ranked) column->kind = ColumnKind::kRanks;
}

void add_bayer(ImageColumns& to, const ImageLayout& image, const Form& form) {
  for (std::uint32_t y = 0; y < 2; ++y)
    for (std::uint32_t x = 0; x < 2; ++x)
      to.add(y, (image.height + 1 - y) / 2, x * form.width, (image.width + 1 - x) / 2,
             2U * form.width, form.width, 2);
}

// A row has two bytes for each pixel, and half a group at its end if the width is odd.
void add_422(ImageColumns& to, const ImageLayout& image, std::uint32_t luma) {
  const std::uint32_t chroma = 1 - luma;
  to.add(0, image.height, luma, image.width, 2, 1);
  to.add(0, image.height, chroma, (image.width + 1) / 2, 4, 1);
  to.add(0, image.height, chroma + 2, image.width / 2, 4, 1);
}

void add_chroma(ImageColumns& to, std::uint32_t first_row, std::uint32_t rows,
                std::uint64_t payload) {
  const auto bytes = static_cast<std::uint32_t>(payload);
  to.add(first_row, rows, 0, (bytes + 1) / 2, 2, 1);
  to.add(first_row, rows, 1, bytes / 2, 2, 1);
}

}  // namespace

std::optional<Columns> image_columns(ByteView raw) {
  const auto image = image_layout(raw);
  if (!image) return std::nullopt;
  const auto form = form_of(image->encoding);
  if (!form) return std::nullopt;
  const std::uint64_t payload = std::uint64_t{image->width} * form->width * form->channels;
  const std::uint32_t rows = image->data.bytes / image->step;
  std::uint64_t chroma_rows = 0;
  if (form->arrangement == Arrangement::kHalfChroma)
    chroma_rows = (std::uint64_t{image->height} + 1) / 2;
  if (form->arrangement == Arrangement::kFullChroma) chroma_rows = 2 * std::uint64_t{image->height};
  if (payload > image->step || image->height + chroma_rows != rows) return std::nullopt;

  ImageColumns columns(*image);
  columns.add_bytes(0, image->data.begin);
  switch (form->arrangement) {
    case Arrangement::kPixels:
    case Arrangement::kGreen: add_pixels(columns, *image, *form); break;
    case Arrangement::kBayer: add_bayer(columns, *image, *form); break;
    case Arrangement::kYuyv: add_422(columns, *image, 0); break;
    case Arrangement::kUyvy: add_422(columns, *image, 1); break;
    case Arrangement::kHalfChroma:
    case Arrangement::kFullChroma:
      columns.add(0, image->height, 0, image->width, 1, 1);
      add_chroma(columns, image->height, static_cast<std::uint32_t>(chroma_rows), payload);
  }
  columns.add_padding(0, rows, payload);
  columns.add_bytes(image->data.end(), raw.size());
  return columns.take();
}

}  // namespace connect_bridge::media
