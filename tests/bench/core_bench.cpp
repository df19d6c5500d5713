// What the core's work costs in processor time, without sockets and ROS:
//
//   core_bench control          how long control messages of the worst shapes take to be read
//   core_bench steps            the longest step of the loop after packets that take a side long
//   core_bench shared           the same where one identity's links offer the same publishers
//   core_bench graph            the longest step of the loop when a node starts beside many links
//   core_bench calls            calls of another identity beside those of one identity's links
//   core_bench media            size and time of pictures, distances and clouds, drawn ones
//   core_bench driving          a command that drives a robot, with a wheel and without
//   core_bench links [N ...]    messages of 1 kB, 50 a second in both directions on each of N links
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bench/busy_server.hpp"
#include "bench/control_shapes.hpp"
#include "bench/crowd.hpp"
#include "bench/driven_robot.hpp"
#include "bench/many_links.hpp"
#include "bench/media_samples.hpp"
#include "bench/processor_time.hpp"
#include "bench/step_shapes.hpp"
#include "core/media/columns.hpp"
#include "core/media/sample_codec.hpp"
#include "core/video/decoder.hpp"
#include "core/video/encoder.hpp"
#include "core/video/picture.hpp"
#include "core/wire/control.hpp"
#include "unit/video/moving_scene.hpp"
#include "unit/video/seen.hpp"

namespace {

using namespace connect_bridge;

// The shortest of some times: the first one also waits for memory.
double milliseconds_for(std::string_view text) {
  double shortest = 1e9;
  for (int i = 0; i < 5; ++i) {
    const double began = bench::processor_seconds();
    static_cast<void>(decode_control(text));
    shortest = std::min(shortest, 1e3 * (bench::processor_seconds() - began));
  }
  return shortest;
}

int measure_control() {
  std::puts("         ms     bytes  shape                         outcome");
  for (const auto& [name, text] : bench::control_shapes()) {
    const auto message = decode_control(text);
    std::printf("%11.2f %9zu  %-29s %s\n", milliseconds_for(text), text.size(), name.c_str(),
                message.ok() ? "read" : message.error().message.c_str());
  }
  return 0;
}

template <class Work>
double shortest_of(Work work) {
  double shortest = 1e9;
  for (int i = 0; i < 9; ++i) {
    const double began = bench::processor_seconds();
    work();
    shortest = std::min(shortest, 1e3 * (bench::processor_seconds() - began));
  }
  return shortest;
}

// Pictures of a camera that moves, 30 a second on a link of so many Mbit/s.
void measure_pictures(std::uint32_t width, std::uint32_t height) {
  constexpr std::uint32_t kPictures = 30;
  std::vector<Bytes> samples;
  for (std::uint32_t number = 0; number < kPictures; ++number)
    samples.push_back(video::picture_of({width, height, "rgb8", 0, 9, 0, 3, 6}, number));
  for (const double megabits : {1.0, 2.0, 4.0}) {
    const auto wanted = static_cast<std::uint32_t>(megabits * 1e6 / 8 / 30);
    video::PictureEncoder encoder;
    video::PictureDecoder decoder;
    double encode = 0, decode = 0, bytes = 0, quantisers = 0, alike = 0;
    for (const Bytes& sample : samples) {
      const double began = bench::processor_seconds();
      const auto body = encoder.encode(sample, {wanted, 5 * wanted});
      const double encoded = bench::processor_seconds();
      const auto back = decoder.decode(body.value_or(Bytes{}), sample.size());
      decode += 1e3 * (bench::processor_seconds() - encoded) / kPictures;
      if (!back) return;
      encode += 1e3 * (encoded - began) / kPictures;
      bytes += static_cast<double>(body->size()) / kPictures;
      quantisers += static_cast<double>(video::facts_of(*body)->quantiser) / kPictures;
      alike += video::ssim(video::luma_of(sample), video::luma_of(back.value())) / kPictures;
    }
    std::printf("%4u x %-4u %7.0f %7u %7.0f %10.1f %6.3f %10.2f %10.2f\n", width, height, megabits,
                wanted, bytes, quantisers, alike, encode, decode);
  }
}

void measure_pictures() {
  if (!video::available()) return;
  std::puts("\nrgb8 as VP8  Mbit/s  wanted   bytes  quantiser   SSIM  encode ms  decode ms");
  measure_pictures(640, 480);
  measure_pictures(1280, 720);
}

int measure_media() {
  struct Case {
    const char* name;
    Bytes sample;
    std::vector<std::pair<const char*, Compression>> ways;
  };
  const auto planes = [](int level) { return Compression{Codec::kPlanes, level}; };
  const auto cloud = [](std::uint32_t step_um, std::uint32_t grid_um = 0) {
    return Compression{Codec::kCloud, 1, false, step_um, grid_um};
  };
  const std::pair zstd1{"zstd 1", Compression{Codec::kZstd, 1}};
  const std::pair zstd3{"zstd 3", Compression{Codec::kZstd, 3}};
  const std::vector<Case> cases{{"rgb8 640x480",
                                 bench::drawn_picture(),
                                 {zstd1, zstd3, {"planes 1", planes(1)}, {"planes 3", planes(3)}}},
                                {"16UC1 640x480",
                                 bench::drawn_depth(),
                                 {zstd1, zstd3, {"planes 1", planes(1)}, {"planes 3", planes(3)}}},
                                {"sweep",
                                 bench::drawn_sweep(),
                                 {zstd1,
                                  zstd3,
                                  {"cloud exact", cloud(0)},
                                  {"cloud 1 mm", cloud(1000)},
                                  {"cloud 5 mm", cloud(5000)},
                                  {"cloud 1 cm", cloud(10'000)},
                                  {"cloud 1 cm, grid 10 cm", cloud(10'000, 100'000)}}}};
  std::puts(
      "sample            bytes  way                        bytes  ratio  encode ms  decode ms");
  for (const Case& of : cases)
    for (const auto& way : of.ways) {
      const auto& name = way.first;
      const auto& how = way.second;
      const auto body = media::encode_sample(of.sample, how);
      if (!body) {
        std::printf("%-13s %9zu  %-22s does not shrink\n", of.name, of.sample.size(), name);
        continue;
      }
      const auto facts = how.codec == Codec::kZstd ? std::nullopt : media::facts_of(*body);
      const std::size_t raw_bytes = facts ? facts->raw_bytes : of.sample.size();
      const double encode =
          shortest_of([&] { static_cast<void>(media::encode_sample(of.sample, how)); });
      const double decode = shortest_of(
          [&] { static_cast<void>(media::decode_sample(*body, how.codec, raw_bytes)); });
      std::printf("%-13s %9zu  %-22s %9zu %6.2f %10.2f %10.2f\n", of.name, of.sample.size(), name,
                  body->size(), static_cast<double>(of.sample.size()) / body->size(), encode,
                  decode);
    }
  measure_pictures();
  return 0;
}

// A packet may be taken in less than kStepMax by a side on which the peer and the graph have all
// that they may have.
int measure_steps() {
  constexpr std::uint32_t kOffered = 3800, kExported = 2000, kListeners = 1024;
  constexpr double kStepMax = 5;  // ms
  bool all_short = true;
  const auto tell = [&](const char* name, double seconds, const char* outcome) {
    const bool is_short = 1e3 * seconds <= kStepMax;
    all_short = all_short && is_short;
    std::printf("%11.2f  %-37s %s%s\n", 1e3 * seconds, name, outcome, is_short ? "" : ", long");
  };
  std::puts("         ms  packet                                outcome");
  for (const auto& [name, text, packet] : bench::step_shapes(kOffered, kListeners)) {
    double shortest = 1e9;
    bool open = true;
    for (int i = 0; i < 3; ++i) {
      bench::LoadedSide side(kOffered, kExported, kListeners);
      if (!side.open() || side.offers() < kExported) {
        std::fprintf(stderr, "the peer has %u topics\n", side.offers());
        return 1;
      }
      shortest = std::min(shortest, side.seconds_for(text, packet));
      open = side.open();
    }
    tell(name.c_str(), shortest, open ? "goes on" : "ends the link");
  }
  double shortest = 1e9;  // of three: the first touches memory for the first time
  for (int i = 0; i < 3; ++i) {
    bench::LoadedSide ends(kOffered, kExported, kListeners);
    shortest = std::min(shortest, ends.seconds_to_end());
  }
  tell("the link's end", shortest, "over");
  return all_short ? 0 : 1;
}

// Nor does a message that is kept for links that are lost, however many are kept.
bool measure_kept(double held_up_max) {
  constexpr std::uint32_t kKept = 20'000, kMore = 100;
  bench::ManyLinks side({31, 1, 1, false, false});
  if (side.watched() != 31) {
    std::fprintf(stderr, "%u links are sent the topic\n", side.watched());
    return false;
  }
  side.lose(0, 31);
  side.publish(kKept);
  const bench::Stall stall = side.publish(kMore);
  const bool is_short = 1e3 * stall.longest <= held_up_max;
  std::printf("   31 lost links with %u messages each %15.2f %10.2f  a message%s\n", kKept,
              1e3 * stall.longest, 1e3 * stall.all / kMore, is_short ? "" : ", long");
  return is_short;
}

// Nor do messages that links have not acknowledged when they are lost, or when they come back no
// more.
bool measure_unread(std::uint32_t links, double held_up_max) {
  constexpr std::uint32_t kUnread = 50'000;
  bench::ManyLinks side({links, 1, 1, false, false});
  side.publish(kUnread);
  bool all_short = side.watched() == links;
  const auto tell = [&](const char* event, const bench::Stall& stall) {
    const bool is_short = 1e3 * stall.longest <= held_up_max;
    all_short = all_short && is_short;
    std::printf("%5u links with %u unread messages each %16.2f %10.2f  %s%s\n", links, kUnread,
                1e3 * stall.longest, 1e3 * stall.all, event, is_short ? "" : ", long");
  };
  tell(links == 1 ? "it is lost" : "all are lost together", side.lose(0, links));
  tell("50,000 more are kept", side.publish(kUnread));
  tell("none comes back", side.give_up());
  return all_short;
}

// Nor does a node that starts beside many topics or services, of which most have no place.
bool measure_unplaced(InterfaceKind kind, double held_up_max) {
  constexpr std::uint32_t kOffered = 3750;
  std::vector<std::string> identities;
  for (int link = 0; link < 24; ++link) identities.push_back("driver" + std::to_string(link / 4));
  bench::LoadedSide side(kOffered, 0, 0, identities, kind);
  bool all_short = side.open();
  const auto tell = [&](const char* event, const auto& happen) {
    double longest = 0, all = 0;
    for (const bool begins : {true, false}) {
      longest = std::max(longest, side.seconds_of([&] {
        happen(begins);
        side.rest(std::chrono::seconds(2));
      }));
      all += side.seconds_in_all();
    }
    const bool is_short = 1e3 * longest <= held_up_max;
    all_short = all_short && is_short;
    std::printf("   24 links with %u %-8s each %20.2f %10.2f  %s starts and ends%s\n", kOffered,
                kind == InterfaceKind::kTopic ? "topics" : "services", 1e3 * longest, 1e3 * all,
                event, is_short ? "" : ", long");
  };
  tell("a node", [&](bool runs) { side.run_node(runs); });
  tell("another bridge", [&](bool runs) { side.run_bridge(runs); });
  return all_short;
}

// A link that ends and a node that starts hold up all others for less than kHeldUpMax, however many
// links offer the same.
int measure_shared() {
  constexpr double kHeldUpMax = 10;  // ms
  bool all_short = true;
  std::puts("links topics publishers                          longest ms     all ms  event");
  const auto measure = [&](const bench::ManyLinksShape& shape) {
    bench::ManyLinks side(shape);
    const auto tell = [&](const char* event, const bench::Stall& stall) {
      const bool is_short = 1e3 * stall.longest <= kHeldUpMax;
      all_short = all_short && is_short;
      std::printf("%5u %6u %10u %-15s %-12s %11.2f %10.2f  %s%s\n", shape.links, shape.topics,
                  shape.publishers, shape.transient_local ? "transient_local" : "volatile",
                  shape.listened ? "listened to" : "", 1e3 * stall.longest, 1e3 * stall.all, event,
                  is_short ? "" : ", long");
    };
    if (side.open() != shape.links || side.mirrors() != shape.topics * shape.publishers) {
      std::fprintf(stderr, "%u links are open, %u mirrors exist\n", side.open(), side.mirrors());
      return false;
    }
    tell("a node starts", side.start_node());
    tell(shape.listened ? "nobody listens" : "a node listens", side.listen(!shape.listened));
    tell(shape.listened ? "a node listens" : "nobody listens", side.listen(shape.listened));
    tell("a link is lost", side.lose(0, 1));
    tell("half of them are lost, one by one", [&] {
      bench::Stall most;
      for (std::uint32_t link = 1; link < shape.links / 2; ++link) {
        const bench::Stall one = side.lose(link, 1);
        most = {std::max(most.longest, one.longest), most.all + one.all};
      }
      return most;
    }());
    const std::uint32_t lost = std::max(1U, shape.links / 2);
    tell("the others are lost together", side.lose(lost, shape.links - lost));
    return true;
  };
  for (const bool listened : {false, true})
    for (const bool transient_local : {true, false})
      for (const auto& [links, topics] : {std::pair{20U, 8U}, std::pair{31U, 1U}})
        if (!measure({links, topics, 256, transient_local, listened})) return 1;
  all_short = measure_kept(kHeldUpMax) && all_short;
  for (const std::uint32_t links : {1U, 31U})
    all_short = measure_unread(links, kHeldUpMax) && all_short;
  for (const auto kind : {InterfaceKind::kTopic, InterfaceKind::kService})
    all_short = measure_unplaced(kind, kHeldUpMax) && all_short;
  return all_short ? 0 : 1;
}

// A node that starts or ends takes less than kStepMax of each step, however many links are offered
// what it brings.
int measure_graph() {
  constexpr double kStepMax = 5;  // ms
  constexpr std::uint32_t kLinks = 32;
  struct Case {
    std::uint32_t offered, exported;
    InterfaceKind kind;
    bench::LoadedSide::Node node;
  };
  // The links of one identity may offer 16,384 names.
  const std::vector<Case> cases{{256, 0, InterfaceKind::kTopic, {100, 0, 0}},
                                {256, 0, InterfaceKind::kTopic, {10, 100, 0}},
                                {256, 0, InterfaceKind::kTopic, {10, 0, 20}},
                                {3750, 0, InterfaceKind::kTopic, {100, 0, 0}},
                                {3750, 0, InterfaceKind::kService, {10, 100, 0}},
                                {256, 500, InterfaceKind::kTopic, {1000, 0, 0}},
                                {256, 500, InterfaceKind::kTopic, {0, 1000, 0}},
                                {256, 500, InterfaceKind::kTopic, {0, 0, 0, 1000}},
                                {256, 500, InterfaceKind::kTopic, {0, 0, 0, 0, 500}},
                                {256, 500, InterfaceKind::kTopic, {0, 0, 0, 0, 0, 500}}};
  bool all_short = true;
  std::puts(
      "each of 32 links offers, is offered  the node: topics services actions listens records joins"
      "  starts, ms  all ms  ends, ms  all ms");
  for (const auto& [offered, exported, kind, node] : cases) {
    bench::LoadedSide side(offered, exported, 0, std::vector<std::string>(kLinks, "peer"), kind);
    const auto run = [&](std::optional<bench::LoadedSide::Node> runs) {
      const double longest = side.seconds_of([&] {
        side.run_node(runs);
        side.rest(std::chrono::seconds(5));
      });
      return std::pair{1e3 * longest, 1e3 * side.seconds_in_all()};
    };
    const std::uint32_t before = side.all_offers();
    const auto starts = run(node);
    const std::uint32_t told = side.all_offers() - before;
    const auto ends = run(std::nullopt);
    const bool is_short = std::max(starts.first, ends.first) <= kStepMax;
    all_short = all_short && is_short;
    std::printf("%10u %-8s %16u  %16u %8u %7u %7u %7u %5u %11.2f %7.1f %9.2f %7.1f%s\n", offered,
                kind == InterfaceKind::kTopic ? "topics" : "services", exported, node.topics,
                node.services, node.actions, node.listens, node.records, node.joins, starts.first,
                starts.second, ends.first, ends.second, is_short ? "" : ", long");
    if (told != kLinks * (node.topics + node.services + 5 * node.actions) || !side.open()) {
      std::fprintf(stderr, "%u offers were made\n", told);
      return 1;
    }
  }
  return all_short ? 0 : 1;
}

// Calls of another identity wait no longer beside many links of one than beside one link.
int measure_calls() {
  constexpr std::uint32_t kCalls = 500;
  std::vector<std::uint32_t> p99;
  std::puts("links  a call of another identity: p50 ms  p99 ms  max ms");
  for (const std::uint32_t links : {1U, 8U, 32U}) {
    const auto waits = bench::BusyServer(links).waits(kCalls);
    p99.push_back(waits[kCalls * 99 / 100]);
    std::printf("%5u %34u %7u %7u\n", links, waits[kCalls / 2], p99.back(), waits.back());
  }
  return p99.front() > 0 && p99.back() <= p99.front() + p99.front() / 4 ? 0 : 1;
}

// The shortest of some means: the wheel costs a command at most 1 us.
int measure_driving() {
  constexpr std::uint32_t kCommands = 20'000;
  constexpr double kWheelMax = 1.0;
  double cost[2] = {1e9, 1e9};
  for (int round = 0; round < 5; ++round)
    for (const bool wheel : {false, true}) {
      bench::DrivenRobot robot(wheel);
      const std::uint64_t before = robot.published();
      cost[wheel] = std::min(cost[wheel], robot.microseconds(kCommands));
      if (robot.published() - before < kCommands) {
        std::fprintf(stderr, "of %u commands %llu moved the robot\n", kCommands,
                     static_cast<unsigned long long>(robot.published() - before));
        return 1;
      }
    }
  std::printf("a command: %.2f us, with a wheel %.2f us\n", cost[0], cost[1]);
  return cost[1] - cost[0] <= kWheelMax ? 0 : 1;
}

int measure_links(const std::vector<std::uint32_t>& counts) {
  std::puts(
      "links  us for a message from a peer  where all send at once  for one to a peer  "
      "for the loss of a link");
  for (const std::uint32_t links : counts) {
    bench::Crowd crowd(links);
    if (crowd.flowing() != 2U * links) {
      std::fprintf(stderr, "%zu of %u topics flow\n", crowd.flowing(), 2U * links);
      return 1;
    }
    const std::uint32_t rounds = 20'000 / links + 50;
    const auto measure = [&](void (bench::Crowd::*send)(), std::uint64_t& count) {
      count = 0;
      crowd.take_seconds();
      for (std::uint32_t i = 0; i < rounds; ++i) (crowd.*send)();
      return 1e6 * crowd.take_seconds() / static_cast<double>(count);
    };
    const double up = measure(&bench::Crowd::send_up, crowd.published);
    const double at_once = measure(&bench::Crowd::send_up_at_once, crowd.published);
    const double down = measure(&bench::Crowd::send_down, crowd.sent);
    crowd.take_seconds();
    crowd.lose();
    const double loss = 1e6 * crowd.take_seconds() / links;
    std::printf("%5u %27.2f %24.2f %18.2f %23.2f\n", links, up, at_once, down, loss);
    if (crowd.published != std::uint64_t{rounds} * links ||
        crowd.sent != std::uint64_t{rounds} * links) {
      std::fprintf(stderr, "of %u messages %llu were published, and %llu sent\n", rounds * links,
                   static_cast<unsigned long long>(crowd.published),
                   static_cast<unsigned long long>(crowd.sent));
      return 1;
    }
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view what = argc > 1 ? argv[1] : "";
  if (what == "control" && argc == 2) return measure_control();
  if (what == "steps" && argc == 2) return measure_steps();
  if (what == "media" && argc == 2) return measure_media();
  if (what == "shared" && argc == 2) return measure_shared();
  if (what == "graph" && argc == 2) return measure_graph();
  if (what == "calls" && argc == 2) return measure_calls();
  if (what == "driving" && argc == 2) return measure_driving();
  if (what == "links") {
    std::vector<std::uint32_t> counts;
    for (int i = 2; i < argc; ++i)
      counts.push_back(static_cast<std::uint32_t>(std::strtoul(argv[i], nullptr, 10)));
    return measure_links(counts.empty() ? std::vector<std::uint32_t>{1, 60, 300} : counts);
  }
  std::fputs(
      "usage: core_bench control | steps | media | shared | graph | calls | driving | "
      "links [N ...]\n",
      stderr);
  return 2;
}
