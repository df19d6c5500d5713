// A camera and who watches it, for tools/bench/wan: the pictures are drawn from their numbers, so
// the watcher has the originals again. Stamps are of the one clock that both ends have.
//
//   pictures camera form=     <name>/image_raw and camera_info, or <name>/image_raw/compressed
//        commands: film seconds=     {"sent":N}
//   pictures watch form=      commands: clear; count, of what came since the last one; save, as
//   count with
//        a picture a file in folder= of a third of the size, for those that came between from= and
//        to= (s of the system's clock): <ns of arrival>.ppm, and <ns>.original.ppm, of that moment
//        {"count":,"at":[s],"age_ms":[],"ssim":[],"exact":,"paired":,"disordered":}
//   pictures frames seconds=  writes its pictures to stdout, for who is no ROS node
//   pictures judge            reads such pictures from stdin, each behind 8 bytes with the ns of
//   its
//        arrival; answers at the end as count does
// Options of all: name= (/camera), width= (640), height= (480), form=image|jpeg (image), quality=
// (80).
#include <turbojpeg.h>

#include <array>
#include <cmath>
#include <fstream>
#include <set>

#include "ros_node.hpp"
#include "scene.hpp"
#include "unit/media/samples.hpp"

namespace bench {
namespace {

using connect_bridge::Bytes;
using connect_bridge::set_le;

std::int64_t wall_ns() {
  timespec t{};
  clock_gettime(CLOCK_REALTIME, &t);
  return t.tv_sec * kSecond + t.tv_nsec;
}

std::int64_t time_of(std::uint64_t number) {
  return std::llround(static_cast<double>(number) * 1e9 / kPicturesPerSecond);
}
std::uint64_t number_at(std::int64_t ns) {
  return static_cast<std::uint64_t>(
      std::llround(static_cast<double>(ns) * kPicturesPerSecond / 1e9));
}

struct Form {
  explicit Form(const Options& options)
      : name(options.text("name", "/camera")),
        width(static_cast<std::uint32_t>(options.count("width", 640))),
        height(static_cast<std::uint32_t>(options.count("height", 480))),
        jpeg(options.text("form", "image") == "jpeg"),
        quality(static_cast<int>(options.count("quality", 80))) {}

  [[nodiscard]] std::size_t bytes() const { return std::size_t{3} * width * height; }
  [[nodiscard]] std::string topic() const {
    return name + (jpeg ? "/image_raw/compressed" : "/image_raw");
  }
  [[nodiscard]] MessageType type() const {
    return {"sensor_msgs", jpeg ? "CompressedImage" : "Image"};
  }

  std::string name;
  std::uint32_t width, height;
  bool jpeg;
  int quality;
};

// A Header begins both kinds of messages.
constexpr std::size_t kStampAt = 4;

void set_stamp(Bytes& sample, std::int64_t ns) {
  set_le(static_cast<std::uint32_t>(ns / kSecond), sample, kStampAt);
  set_le(static_cast<std::uint32_t>(ns % kSecond), sample, kStampAt + 4);
}
std::int64_t stamp_in(const std::uint8_t* sample) {
  std::uint32_t words[2] = {};
  std::memcpy(words, sample + kStampAt, sizeof words);
  return words[0] * kSecond + words[1];
}

Bytes camera_info(const Form& form) {
  connect_bridge::media::SampleWriter out;
  out.u32(0).u32(0).text("camera").u32(form.height).u32(form.width).text("plumb_bob").u32(0);
  while ((out.bytes.size() - 4) % 8 != 0) out.u8(0);
  for (int i = 0; i < 2 * (9 + 9 + 12) + 2 + 4; ++i) out.u32(0);
  return out.u8(0).bytes;
}

void send(Publisher& to, Bytes& sample) {
  auto message = rmw_get_zero_initialized_serialized_message();
  message.buffer = sample.data();
  message.buffer_length = message.buffer_capacity = sample.size();
  message.allocator = rcl_get_default_allocator();
  to.send(&message);
}

// ---- the camera

void run_camera(Node& node, Commands& commands, const Form& form) {
  const Scene scene(form.width, form.height);
  Publisher pictures(node, form.topic(), form.type());
  Publisher infos(node, form.name + "/camera_info", {"sensor_msgs", "CameraInfo"});
  Bytes drawn(form.bytes()), info = camera_info(form);
  auto image = connect_bridge::media::image_sample(
      {form.height, form.width, "rgb8", 3 * form.width, false, Bytes(form.bytes())});
  const auto jpeg = tjInitCompress();
  answer("{\"ready\":true}");
  while (!commands.ended()) {
    const auto command = commands.next(1000);
    if (!command) continue;
    std::size_t sent = 0;
    const auto end = wall_ns() + to_ns(command->number("seconds", 5));
    for (auto number = number_at(wall_ns()) + 1; time_of(number) < end; ++sent) {
      scene.draw(number, drawn.data());
      if (form.jpeg) {
        unsigned char* packed = nullptr;
        unsigned long size = 0;
        tjCompress2(jpeg, drawn.data(), static_cast<int>(form.width), 0,
                    static_cast<int>(form.height), TJPF_RGB, &packed, &size, TJSAMP_420,
                    form.quality, 0);
        connect_bridge::media::SampleWriter out;
        out.u32(0).u32(0).text("camera").text("rgb8; jpeg compressed bgr8").octets({packed, size});
        image = std::move(out.bytes);
        tjFree(packed);
      } else {
        std::copy(drawn.begin(), drawn.end(),
                  image.end() - static_cast<std::ptrdiff_t>(drawn.size()));
      }
      const auto when = time_of(number);
      set_stamp(image, when);
      set_stamp(info, when);
      sleep_until(now_ns() + when - wall_ns());
      send(pictures, image);
      send(infos, info);
      number = std::max(number + 1, number_at(wall_ns()));  // what is too late is left out
    }
    answer("{\"sent\":" + std::to_string(sent) + "}");
  }
  tjDestroy(jpeg);
}

void run_frames(const Form& form, double seconds) {
  const Scene scene(form.width, form.height);
  Bytes drawn(form.bytes());
  const auto end = wall_ns() + to_ns(seconds);
  for (auto number = number_at(wall_ns()) + 1; time_of(number) < end;) {
    scene.draw(number, drawn.data());
    sleep_until(now_ns() + time_of(number) - wall_ns());
    if (std::fwrite(drawn.data(), drawn.size(), 1, stdout) != 1) return;
    std::fflush(stdout);
    number = std::max(number + 1, number_at(wall_ns()));
  }
}

// ---- who watches

// The luma of rgb8.
std::vector<std::uint8_t> luma_of(const std::uint8_t* rgb, std::size_t points) {
  std::vector<std::uint8_t> luma(points);
  for (std::size_t i = 0; i < points; ++i)
    luma[i] = static_cast<std::uint8_t>(
        (77U * rgb[3 * i] + 150U * rgb[3 * i + 1] + 29U * rgb[3 * i + 2]) >> 8);
  return luma;
}

// A third of the width and height, as PPM.
void write_small(const std::string& path, const Bytes& rgb, const Form& form) {
  const auto width = form.width / 3, height = form.height / 3;
  std::ofstream file(path, std::ios::binary);
  file << "P6 " << width << " " << height << " 255\n";
  for (std::uint32_t y = 0; y < height; ++y)
    for (std::uint32_t x = 0; x < 3 * width; ++x) {
      std::uint32_t sum = 0;
      for (std::uint32_t i = 0; i < 9; ++i)
        sum += rgb[3 * (std::size_t{3 * y + i / 3} * form.width + 3 * (x / 3) + i % 3) + x % 3];
      file.put(static_cast<char>(sum / 9));
    }
}

// Pictures that came are judged when somebody asks, so that judging delays nothing.
class Judge {
 public:
  explicit Judge(const Form& form) : form_(form), scene_(form.width, form.height) {}

  // number: as the picture says; 0: it is read from the picture.
  void take(Bytes rgb, std::uint64_t number, std::int64_t came_ns) {
    if (rgb.size() != form_.bytes()) return;
    const auto luma = luma_of(rgb.data(), rgb.size() / 3);
    if (number == 0) {
      const auto near = number_at(came_ns);
      number = near - static_cast<std::uint16_t>(near - scene_.number_in(luma.data(), form_.width));
    }
    Bytes original(form_.bytes());
    scene_.draw(number, original.data());
    exact_ += original == rgb;
    disordered_ += number <= last_;
    last_ = number;
    at_.push_back(static_cast<double>(now_ns() - wall_ns() + came_ns) / 1e9);
    age_ms_.push_back(static_cast<double>(came_ns - time_of(number)) / 1e6);
    ssim_.push_back(
        ssim(luma, luma_of(original.data(), original.size() / 3), form_.width, form_.height));
  }
  // The original as it was at this time, and the picture that came then.
  void save(const std::string& folder, const Bytes& rgb, std::int64_t came_ns) const {
    const auto path = folder + "/" + std::to_string(came_ns);
    write_small(path + ".ppm", rgb, form_);
    Bytes original(form_.bytes());
    scene_.draw(number_at(came_ns), original.data());
    write_small(path + ".original.ppm", original, form_);
  }
  [[nodiscard]] std::string text(std::size_t paired) const {
    return "{\"count\":" + std::to_string(at_.size()) + ",\"exact\":" + std::to_string(exact_) +
           ",\"paired\":" + std::to_string(paired) +
           ",\"disordered\":" + std::to_string(disordered_) + ",\"at\":" + json_array(at_) +
           ",\"age_ms\":" + json_array(age_ms_) + ",\"ssim\":" + json_array(ssim_) + "}";
  }

 private:
  const Form& form_;
  Scene scene_;
  std::uint64_t last_ = 0;
  std::size_t exact_ = 0, disordered_ = 0;
  std::vector<double> at_, age_ms_, ssim_;
};

struct Arrival {
  Bytes sample;
  std::int64_t came_ns = 0;
};

Bytes rgb_of(const Bytes& sample, const Form& form) {
  if (!form.jpeg) {
    if (sample.size() < form.bytes()) return {};
    return {sample.end() - static_cast<std::ptrdiff_t>(form.bytes()), sample.end()};
  }
  static constexpr std::array<std::uint8_t, 3> kBegin{0xff, 0xd8, 0xff};
  const auto begin = std::search(sample.begin(), sample.end(), kBegin.begin(), kBegin.end());
  Bytes rgb(form.bytes());
  const auto jpeg = tjInitDecompress();
  tjDecompress2(jpeg, sample.data() + (begin - sample.begin()),
                static_cast<unsigned long>(sample.end() - begin), rgb.data(),
                static_cast<int>(form.width), 0, static_cast<int>(form.height), TJPF_RGB, 0);
  tjDestroy(jpeg);
  return rgb;
}

std::string judged(const std::vector<Arrival>& arrivals, const std::set<std::int64_t>& infos,
                   const Form& form, const Options& command) {
  Judge judge(form);
  std::size_t paired = 0;
  for (const auto& one : arrivals) {
    const auto stamp = stamp_in(one.sample.data());
    // The CameraInfo of the first and of the last may belong to another count.
    if (&one == &arrivals.front() || &one == &arrivals.back() || infos.count(stamp) > 0) ++paired;
    auto rgb = rgb_of(one.sample, form);
    const double came = static_cast<double>(one.came_ns) / 1e9;
    if (command.verb == "save" && command.number("from", 0) <= came &&
        came < command.number("to", 0))
      judge.save(command.text("folder", "."), rgb, one.came_ns);
    judge.take(std::move(rgb), number_at(stamp), one.came_ns);
  }
  return judge.text(paired);
}

void run_watch(Node& node, Commands& commands, const Form& form) {
  Subscription pictures(node, form.topic(), form.type());
  Subscription infos(node, form.name + "/camera_info", {"sensor_msgs", "CameraInfo"});
  WaitSet waiter(node, {&pictures, &infos});
  Message message(kBodyBytesMin);
  std::vector<Arrival> arrivals;
  std::set<std::int64_t> stamps;
  answer("{\"ready\":true}");
  while (!commands.ended()) {
    if (waiter.wait_until(now_ns() + kSecond / 20)) {
      while (pictures.take(message)) {
        const auto* const begin = message.get()->buffer;
        arrivals.push_back({Bytes(begin, begin + message.get()->buffer_length), wall_ns()});
      }
      while (infos.take(message)) stamps.insert(stamp_in(message.get()->buffer));
    }
    const auto command = commands.next(0);
    if (!command) continue;
    answer(command->verb == "clear" ? "{}" : judged(arrivals, stamps, form, *command));
    arrivals.clear();
    stamps.clear();
  }
}

void run_judge(const Form& form) {
  Judge judge(form);
  Bytes rgb(form.bytes());
  std::int64_t came_ns = 0;
  while (std::fread(&came_ns, sizeof came_ns, 1, stdin) == 1 &&
         std::fread(rgb.data(), rgb.size(), 1, stdin) == 1)
    judge.take(rgb, 0, came_ns);
  answer(judge.text(0));
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Options options;
  for (int i = 1; i < argc; ++i) options.add(argv[i]);
  const bench::Form form(options);
  if (options.verb == "frames") return bench::run_frames(form, options.number("seconds", 10)), 0;
  if (options.verb == "judge") return bench::run_judge(form), 0;
  if (options.verb != "camera" && options.verb != "watch") {
    std::fprintf(stderr, "usage: pictures camera|watch|frames|judge [key=value ...]\n");
    return 2;
  }
  bench::Commands commands;
  bench::Node node("pictures_" + options.verb, 5);
  options.verb == "camera" ? bench::run_camera(node, commands, form)
                           : bench::run_watch(node, commands, form);
  return 0;
}
