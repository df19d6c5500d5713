// A corridor as a driving robot's camera sees it, drawn from the number of the picture: who knows
// the number has the original again. Textures, turns, vibration and the sensor's noise make it hard
// to compress.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace bench {

inline constexpr double kPicturesPerSecond = 30;

// rgb8, without padding. One thread.
class Scene {
 public:
  Scene(std::uint32_t width, std::uint32_t height) : width_(width), height_(height) {
    std::mt19937 random{7};
    std::normal_distribution<double> noise{0, 2};
    for (auto& one : noise_) one = static_cast<std::int8_t>(std::lround(noise(random)));
    for (std::uint32_t octave = 0; octave < 5; ++octave)
      add_octave(random, 8U << octave, 44.0 - 4.75 * octave);
  }

  [[nodiscard]] std::uint32_t width() const { return width_; }
  [[nodiscard]] std::uint32_t height() const { return height_; }

  // data: 3 * width * height bytes.
  void draw(std::uint64_t number, std::uint8_t* data) const {
    const Camera camera = at(static_cast<double>(number % 1800) / kPicturesPerSecond);
    for (std::uint32_t x = 0; x < width_; ++x) {
      const double across = 1.2 * (x + 0.5) / width_ - 0.6;
      column(camera, x, camera.dx - across * camera.dy, camera.dy + across * camera.dx, data);
    }
    add_noise(number, data);
    write_number(number, data);
  }

  // The number that is written into the picture, modulo 65,536. luma: a plane with this step.
  [[nodiscard]] std::uint16_t number_in(const std::uint8_t* luma, std::size_t step) const {
    std::uint16_t number = 0;
    for (std::uint32_t bit = 0; bit < 16; ++bit) {
      const std::uint8_t middle = luma[(height_ - 8) * step + bit * 16 + 8];
      number = static_cast<std::uint16_t>(number | (middle > 127) << bit);
    }
    return number;
  }

 private:
  static constexpr std::uint32_t kSide = 256;  // of the texture
  static constexpr double kWide = 5;           // the corridor
  struct Camera {
    double x, y, dx, dy, horizon;
  };

  void add_octave(std::mt19937& random, std::uint32_t cells, double weight) {
    std::vector<double> grid(std::size_t{cells} * cells);
    for (auto& one : grid) one = std::uniform_real_distribution<double>(-1, 1)(random);
    for (std::uint32_t i = 0; i < kSide * kSide; ++i) {
      const double u = static_cast<double>(i % kSide) * cells / kSide;
      const double v = static_cast<double>(i / kSide) * cells / kSide;
      const auto a = static_cast<std::uint32_t>(u), b = static_cast<std::uint32_t>(v);
      const double p = u - a, q = v - b;
      const auto of = [&](std::uint32_t s, std::uint32_t t) {
        return grid[(t % cells) * cells + s % cells];
      };
      texture_[i] += weight * ((1 - q) * ((1 - p) * of(a, b) + p * of(a + 1, b)) +
                               q * ((1 - p) * of(a, b + 1) + p * of(a + 1, b + 1)));
    }
  }
  [[nodiscard]] double texture(double u, double v) const {
    const auto wrapped = [](double at) {
      return static_cast<std::uint32_t>(static_cast<std::int32_t>(at * kSide)) % kSide;
    };
    return texture_[wrapped(v) * kSide + wrapped(u)];
  }

  // 1.2 m/s between the walls, looking around, on wheels that shake. All begins anew each minute,
  // without a cut.
  [[nodiscard]] Camera at(double time) const {
    const auto swing = [time](int in_a_minute) { return std::sin(time * in_a_minute * M_PI / 30); };
    const double turn = 0.55 * swing(9) + 0.2 * swing(22);
    const double shaking = 2.0 * swing(449) + 3.0 * swing(105);
    return {1.2 * time + 1000, kWide / 2 + 0.9 * swing(5), std::cos(turn), std::sin(turn),
            height_ * (0.48 + shaking / 480)};
  }

  static bool is_pillar(int x, int y) {
    return x % 3 == 0 && (y == 0 || y == static_cast<int>(kWide) - 1);
  }

  void column(const Camera& camera, std::uint32_t x, double rx, double ry,
              std::uint8_t* data) const {
    // The nearest of the walls and of the pillars before them.
    double far = ry > 0 ? (kWide - camera.y) / ry : ry < 0 ? -camera.y / ry : 60;
    double u = camera.x + far * rx;
    int what = ry > 0 ? 0 : 1;
    int cx = static_cast<int>(camera.x), cy = static_cast<int>(camera.y);
    const int sx = rx > 0 ? 1 : -1, sy = ry > 0 ? 1 : -1;
    for (double gone = 0; gone < far;) {
      const double tx = (cx + (rx > 0) - camera.x) / rx, ty = (cy + (ry > 0) - camera.y) / ry;
      gone = std::min(tx, ty);
      (tx < ty ? cx : cy) += tx < ty ? sx : sy;
      if (gone < far && is_pillar(cx, cy)) {
        u = tx < ty ? camera.y + gone * ry : camera.x + gone * rx;
        far = gone;
        what = 2 + (cx / 3) % 3;
      }
    }
    static constexpr std::array<std::array<int, 3>, 5> kPaint{
        {{150, 120, 95}, {100, 125, 150}, {170, 165, 140}, {140, 75, 60}, {70, 110, 80}}};
    const double scale = height_ * 0.9;  // pixels of a metre at a metre
    const double top = camera.horizon - 1.4 * scale / far, bottom = camera.horizon + scale / far;
    const double fog = std::max(0.25, 1 - far / 25);
    for (std::uint32_t y = 0; y < height_; ++y) {
      std::uint8_t* const pixel = data + 3 * (std::size_t{y} * width_ + x);
      if (y >= top && y < bottom) {
        const double v = (y - top) / (bottom - top);
        const double grain = texture(u / 1.5, 1.6 * v) + (what < 2 && v > 0.72 ? -35 : 0);
        paint(pixel, kPaint[static_cast<std::size_t>(what)], fog, grain);
      } else {
        const bool floor = y >= bottom;
        const double away =
            (floor ? 1.0 : 1.4) * scale / std::max(std::abs(y - camera.horizon), 1.0);
        const double px = camera.x + away * rx, py = camera.y + away * ry;
        const bool tile = (static_cast<int>(px * 2) + static_cast<int>(py * 2)) % 2 == 0;
        const double grain =
            texture(px / 1.5, py / 1.5) * (floor ? 0.9 : 0.5) + (floor && tile ? 25 : 0);
        static constexpr std::array<int, 3> kFloor{105, 100, 95}, kCeiling{190, 190, 200};
        paint(pixel, floor ? kFloor : kCeiling, std::max(0.25, 1 - away / 25), grain);
      }
    }
  }
  static void paint(std::uint8_t* pixel, const std::array<int, 3>& colour, double fog,
                    double grain) {
    for (std::size_t i = 0; i < 3; ++i)
      pixel[i] = static_cast<std::uint8_t>(std::clamp(fog * (colour[i] + grain), 8.0, 247.0));
  }

  void add_noise(std::uint64_t number, std::uint8_t* data) const {
    std::mt19937 random{static_cast<std::uint32_t>(number)};
    const std::size_t row = std::size_t{3} * width_;
    for (std::uint32_t y = 0; y < height_; ++y, data += row) {
      const std::int8_t* const noise = noise_.data() + random() % (noise_.size() - row);
      for (std::size_t i = 0; i < row; ++i) data[i] = static_cast<std::uint8_t>(data[i] + noise[i]);
    }
  }

  // As 16 squares for machines, and the seconds for people.
  void write_number(std::uint64_t number, std::uint8_t* data) const {
    for (std::uint32_t bit = 0; bit < 16; ++bit)
      square(data, bit * 16, height_ - 16, 16, (number >> bit & 1) != 0 ? 235 : 20);
    static constexpr std::array<std::uint16_t, 10> kDigits{
        // 3 x 5 points from the top left
        0x7b6f, 0x2492, 0x73e7, 0x73cf, 0x5bc9, 0x79cf, 0x79ef, 0x7249, 0x7bef, 0x7bcf};
    auto hundredths = static_cast<std::uint64_t>(number * 100 / kPicturesPerSecond) % 6000;
    for (std::uint32_t place = 0; place < 4; ++place, hundredths /= 10)
      for (std::uint32_t i = 0; i < 15; ++i)
        square(data, 16 + (3 - place) * 40 + (place < 2 ? 16 : 0) + i % 3 * 10, 16 + i / 3 * 10, 10,
               (kDigits[hundredths % 10] >> (14 - i) & 1) != 0 ? 240 : 15);
  }
  void square(std::uint8_t* data, std::uint32_t left, std::uint32_t top, std::uint32_t side,
              std::uint8_t grey) const {
    for (std::uint32_t y = top; y < top + side; ++y)
      std::fill_n(data + 3 * (std::size_t{y} * width_ + left), 3 * side, grey);
  }

  std::uint32_t width_, height_;
  std::array<double, kSide * kSide> texture_{};
  std::array<std::int8_t, 65'536> noise_{};
};

// Mean of the structural similarity of two planes in blocks of 8 x 8, one every 4 points.
inline double ssim(const std::vector<std::uint8_t>& one, const std::vector<std::uint8_t>& other,
                   std::uint32_t width, std::uint32_t height) {
  constexpr double kC1 = 6.5025, kC2 = 58.5225, kPoints = 64;
  double sum = 0;
  std::size_t blocks = 0;
  for (std::uint32_t top = 0; top + 8 <= height; top += 4) {
    for (std::uint32_t left = 0; left + 8 <= width; left += 4, ++blocks) {
      std::uint32_t a = 0, b = 0, aa = 0, bb = 0, ab = 0;
      for (std::uint32_t y = 0; y < 8; ++y) {
        for (std::uint32_t x = 0; x < 8; ++x) {
          const std::size_t i = std::size_t{top + y} * width + left + x;
          const std::uint32_t p = one[i], q = other[i];
          a += p, b += q, aa += p * p, bb += q * q, ab += p * q;
        }
      }
      const double ma = a / kPoints, mb = b / kPoints;
      const double va = aa / kPoints - ma * ma, vb = bb / kPoints - mb * mb;
      const double cov = ab / kPoints - ma * mb;
      sum += (2 * ma * mb + kC1) * (2 * cov + kC2) / ((ma * ma + mb * mb + kC1) * (va + vb + kC2));
    }
  }
  return blocks > 0 ? sum / static_cast<double>(blocks) : 0;
}

}  // namespace bench
