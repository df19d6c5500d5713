#include "core/link/link_end.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <map>
#include <string>

namespace connect_bridge {
namespace {

TEST(LinkEndParts, EachEndsOnceAndInOrder) {
  LinkEnd end;
  std::string done;
  const auto part = [&](int number, bool over) {
    return end.part(number, [&] {
      done += std::to_string(number);
      return over;
    });
  };
  EXPECT_FALSE(part(0, true) && part(1, false) && part(2, true));
  EXPECT_TRUE(part(0, true) && part(1, true) && part(2, true));
  EXPECT_EQ(done, "0112");
}

TEST(LinkEndParts, ATableGoesOnBehindTheLastEntryWhateverComesBeforeIt) {
  LinkEnd end;
  std::map<LinkEnd::Name, std::string> table{
      {{"/b", "t"}, "b"}, {{"/c", "t"}, "c"}, {{"/d", "t"}, "d"}};
  std::string ended;
  const auto some = [&](std::size_t entries) {
    end.left = entries;
    return end.each(table, [&](const std::string& entry) { ended += entry; });
  };
  EXPECT_FALSE(some(0));
  EXPECT_FALSE(some(2));
  EXPECT_EQ(ended, "bc");
  table[{"/a", "t"}] = "a";
  table.erase({"/c", "t"});
  EXPECT_TRUE(some(2));
  EXPECT_EQ(ended, "bcd");
  EXPECT_EQ(end.left, 1U);
}

}  // namespace
}  // namespace connect_bridge
