#include "net/tcp/admission.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace connect_bridge {
namespace {

// Four places for an address; `closed`: the numbers of those that gave way.
struct Door {
  Admission admission{{8, 8, 4, {}}};  // open ones, pending ones, those of an address
  std::vector<std::shared_ptr<Admission::Pending>> all;
  std::vector<std::size_t> closed;

  void come(bool silent) {
    auto place = admission.take_pending("10.0.0.2");
    place->silent = silent;
    place->give_way = [this, number = all.size()] { closed.push_back(number); };
    all.push_back(std::move(place));
  }
};

TEST(Admission, SilentOnesGiveWayFirst) {
  Door door;
  for (const bool silent : {false, false, true, true}) door.come(silent);
  door.come(true);
  EXPECT_THAT(door.closed, testing::ElementsAre(2U));
}

// Who stalls after its first byte must not leave a single place to all newcomers.
TEST(Admission, AFewSilentOnesKeepTheirPlacesBesideMoreThatStall) {
  Door door;
  for (const bool silent : {false, false, false, true}) door.come(silent);
  door.come(true);
  EXPECT_THAT(door.closed, testing::ElementsAre(0U));
}

}  // namespace
}  // namespace connect_bridge
