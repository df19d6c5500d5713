// What one step does beside 32 links, counted: offers, origins, listeners, channels that end,
// mirrors. Longer steps hold up all others; how long a step takes is measured by core_bench.
#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bench/loaded_side.hpp"

namespace connect_bridge::side_test {
namespace {

using namespace std::chrono_literals;
using bench::LoadedSide;

constexpr std::size_t kLinks = 32;
constexpr std::uint32_t kOffered = 32, kExported = 48;

// Of GraphOptions and LinkOptions. The last entry of a step may be of all links.
constexpr std::size_t kOffers = 128, kOrigins = 128, kListeners = 1024;
constexpr std::size_t kEnds = 256 + kLinks * kActionParts.size(), kEndpoints = 512;

struct Beside {
  explicit Beside(InterfaceKind kind = InterfaceKind::kTopic,
                  Durability durability = Durability::kVolatile)
      : side(kOffered, kExported, 32, std::vector<std::string>(kLinks, "driver"), kind,
             durability) {}
  // What all steps that follow have done; each does no more than it may.
  template <class Event>
  LoadedSide::Work work_of(Event event) {
    static_cast<void>(side.seconds_of([&] {
      event();
      side.rest(10s);
    }));
    const LoadedSide::Work& most = side.most();
    EXPECT_LE(most.offers, kOffers);
    EXPECT_LE(most.origins, kOrigins);
    EXPECT_LE(most.listeners, kListeners);
    EXPECT_LE(most.withdrawn, kEnds);
    EXPECT_LE(most.endpoints, kEndpoints);
    return side.work_in_all();
  }

  LoadedSide side;
};

TEST(StepWork, ANodeThatStartsAndEnds) {
  for (const auto durability : {Durability::kVolatile, Durability::kTransientLocal}) {
    Beside s(InterfaceKind::kTopic, durability);
    const auto starts = s.work_of([&] { s.side.run_node(LoadedSide::Node{40, 10, 2}); });
    EXPECT_EQ(starts.offers, kLinks * (40 + 10 + 2 * kActionParts.size()));
    EXPECT_EQ(starts.listeners, kLinks * kOffered);
    const auto ends = s.work_of([&] { s.side.run_node(std::nullopt); });
    EXPECT_EQ(ends.withdrawn, starts.offers);
    EXPECT_EQ(ends.listeners, starts.listeners);
  }
}

TEST(StepWork, ANodeThatSubscribesToMuch) {
  Beside s;
  const auto starts = s.work_of([&] { s.side.run_node(LoadedSide::Node{0, 0, 0, 100}); });
  EXPECT_EQ(starts.listeners, kLinks * 100);
  const auto ends = s.work_of([&] { s.side.run_node(std::nullopt); });
  EXPECT_EQ(ends.listeners, kLinks * 100);
}

TEST(StepWork, ARecorderOfAllThatIsHere) {
  Beside s;
  const auto starts = s.work_of([&] { s.side.run_node(LoadedSide::Node{0, 0, 0, 0, kExported}); });
  EXPECT_EQ(starts.listeners, kLinks * kExported);
}

TEST(StepWork, AnotherPublisherOfAllThatIsHere) {
  Beside s;
  const auto starts = s.work_of([&] {
    s.side.run_node(LoadedSide::Node{0, 0, 0, 0, 0, kExported});
  });
  EXPECT_EQ(starts.origins, kLinks * kExported);
  EXPECT_EQ(starts.offers, 0U);
}

TEST(StepWork, LinksThatEndOneByOneAndTogether) {
  for (const auto kind : {InterfaceKind::kTopic, InterfaceKind::kService}) {
    Beside s(kind);
    static_cast<void>(s.work_of([&] { s.side.run_node(true); }));
    static_cast<void>(s.work_of([&] { s.side.lose(0); }));
    static_cast<void>(s.work_of([&] {
      for (std::size_t link = 1; link < kLinks; ++link) s.side.lose(link);
    }));
    static_cast<void>(s.work_of([&] { s.side.come_back(0); }));
  }
}

}  // namespace
}  // namespace connect_bridge::side_test
