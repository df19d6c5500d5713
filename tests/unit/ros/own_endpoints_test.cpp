#include "ros/node/own_endpoints.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <future>

namespace connect_bridge::ros {
namespace {

Gid id_of(std::uint32_t n) {
  Gid result;
  for (std::size_t i = 0; i < 4; ++i) result.bytes[i] = static_cast<std::uint8_t>(n >> (8 * i));
  return result;
}

// As many mirrors as there may be; an id that was forgotten would be taken for another process's.
TEST(OwnEndpoints, WhereIdsHaveNoPrefixThoseOfAllMirrorsAreKnown) {
  OwnEndpoints own(0);
  for (std::uint32_t n = 1; n <= 20'000; ++n) own.add(id_of(n));
  EXPECT_TRUE(own.contains(id_of(1)));
  EXPECT_TRUE(own.contains(id_of(20'000)));
  EXPECT_FALSE(own.contains(id_of(20'001)));
}

// Mirrors that come and go must not make it forget one that stays.
TEST(OwnEndpoints, WhereIdsHaveNoPrefixOnlyThoseThatEndedAreForgotten) {
  OwnEndpoints own(0);
  own.add(id_of(1));
  for (std::uint32_t n = 2; n <= 100'000; ++n) {
    own.add(id_of(n));
    own.remove(id_of(n));
  }
  EXPECT_TRUE(own.contains(id_of(1)));
  EXPECT_TRUE(own.contains(id_of(100'000)));  // its last samples may be under way
  EXPECT_FALSE(own.contains(id_of(2)));
}

// The watcher of the graph may see an endpoint while it is made.
TEST(OwnEndpoints, AnEndpointThatIsBeingMadeIsNotTakenForSomebodyElses) {
  OwnEndpoints own(0);
  auto making = own.making();
  auto seen = std::async(std::launch::async, [&] { return own.contains(id_of(1)); });
  EXPECT_EQ(std::future_status::timeout, seen.wait_for(std::chrono::milliseconds(20)));
  own.add(id_of(1));
  making.unlock();
  EXPECT_TRUE(seen.get());
}

TEST(OwnEndpoints, AnIdThatComesAgainStays) {
  OwnEndpoints own(0);
  own.add(id_of(1));
  own.remove(id_of(1));
  own.add(id_of(1));
  for (std::uint32_t n = 2; n <= 100'000; ++n) {
    own.add(id_of(n));
    own.remove(id_of(n));
  }
  EXPECT_TRUE(own.contains(id_of(1)));
}

}  // namespace
}  // namespace connect_bridge::ros
