// When long lists of what peers accept are compared with this side's interfaces.
#include "core/link/accepts_review.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "unit/link/quiet_user.hpp"
#include "unit/link/script.hpp"

namespace connect_bridge::link_test {
namespace {

struct Unheard final : QuietUser {};

// To compare one interface with such a list costs 100,000 bytes, so a turn has three of them.
constexpr std::size_t kLongList = 1000;
// One has more than a turn, and two have more than passes at once.
constexpr std::size_t kVeryLongList = 6000;

// Links whose peers' lists are compared. Time in milliseconds.
struct Reviewed {
  // Peer n accepts all but what this list denies, and so many interfaces are to be compared.
  void add(std::uint64_t n, int interfaces, std::size_t patterns = kLongList) {
    Accepts told{{{{"/**"}, {}}}, {}};
    told.deny.assign(patterns, std::string(84, 'a'));
    links.try_emplace({n}, LinkId{n}, user).first->second.accepts.adopt(std::move(told));
    ask(n, interfaces);
  }
  void ask(std::uint64_t n, int interfaces) {
    for (int i = 0; i < interfaces; ++i) {
      asked.emplace_back(n, "/a" + std::to_string(asked.size()));
      EXPECT_FALSE(answer(asked.back()));
    }
  }
  std::optional<bool> answer(const std::pair<std::uint64_t, std::string>& of) {
    return links.at({of.first}).accepts->takes({InterfaceKind::kTopic, of.second, "p/msg/T"});
  }
  // How many interfaces were compared with the list of peer n.
  int compared(std::uint64_t n) {
    int count = 0;
    for (const auto& each : asked)
      if (each.first == n && answer(each)) ++count;
    return count;
  }
  // The links that are done: "2 1".
  std::string done(std::int64_t at) {
    std::string words;
    for (const Link* link : subject.take_done(links, now_ms(at)))
      words += (words.empty() ? "" : " ") + std::to_string(link->id.value);
    return words;
  }
  // In milliseconds; -1: none.
  [[nodiscard]] std::int64_t deadline() const {
    const auto at = subject.deadline(links);
    return at ? (*at - TimePoint{}) / std::chrono::milliseconds(1) : -1;
  }

  Unheard user;
  LinkTable links;
  std::vector<std::pair<std::uint64_t, std::string>> asked;
  AcceptsReview subject;
};

TEST(AcceptsReview, WithoutALongListThereIsNothingToDo) {
  Reviewed s;
  s.add(1, 0);
  s.links.at({1}).accepts.adopt(Accepts{{{{"/**"}, {}}}, {}});
  EXPECT_TRUE(s.answer({1, "/a"}));
  EXPECT_EQ(s.deadline(), -1);
  EXPECT_EQ(s.done(0), "");
}

TEST(AcceptsReview, ALinkIsDoneOnceWhenNothingIsLeft) {
  Reviewed s;
  s.add(1, 2);
  EXPECT_EQ(s.deadline(), 0);
  EXPECT_EQ(s.done(0), "1");
  EXPECT_EQ(s.compared(1), 2);
  EXPECT_EQ(s.deadline(), -1);
  EXPECT_EQ(s.done(1000), "");
}

TEST(AcceptsReview, LinksTakeTurns) {
  Reviewed s;
  s.add(1, 6);
  s.add(2, 1);
  s.add(3, 1);
  EXPECT_EQ(s.done(0), "2 3 1");
}

TEST(AcceptsReview, ThenTheLoopHasTimeForOtherThings) {
  Reviewed s;
  s.add(1, 2, kVeryLongList);
  s.add(2, 1, kVeryLongList);
  s.add(3, 1, kVeryLongList);
  EXPECT_EQ(s.done(0), "2");
  EXPECT_EQ(s.compared(1), 1);
  EXPECT_EQ(s.compared(3), 0);
  EXPECT_EQ(s.deadline(), 40);
  EXPECT_EQ(s.done(39), "");
  EXPECT_EQ(s.compared(3), 0);
  EXPECT_EQ(s.done(40), "3");  // not the first one again
  EXPECT_EQ(s.compared(1), 1);
  EXPECT_EQ(s.deadline(), 80);
  EXPECT_EQ(s.done(80), "1");
}

// Whatever peers tell, the rest of the loop's time is for messages.
TEST(AcceptsReview, ATenthOfTheTimeGoesIntoIt) {
  Reviewed s;
  s.add(1, 2000);
  for (std::int64_t at = s.deadline(); at <= 10'000; at = s.deadline()) EXPECT_EQ(s.done(at), "");
  EXPECT_NEAR(s.compared(1), 1260, 10);  // 12.5 MB a second, and 80 ms of that at once
}

TEST(AcceptsReview, ALinkThatWasDoneRestsAndOthersDoNotRestWithIt) {
  Reviewed s;
  s.add(1, 1);
  EXPECT_EQ(s.done(0), "1");
  s.ask(1, 1);
  EXPECT_EQ(s.deadline(), 250);
  s.add(2, 1);
  EXPECT_LT(s.deadline(), 100);
  EXPECT_EQ(s.done(100), "2");
  EXPECT_EQ(s.deadline(), 250);
  EXPECT_EQ(s.done(249), "");
  EXPECT_EQ(s.done(250), "1");
}

TEST(AcceptsReview, LinksThatAreLostOrGoneHaveNoTurn) {
  Reviewed s;
  for (const std::uint64_t n : {1, 2, 3, 4}) s.add(n, 1, kVeryLongList);
  EXPECT_EQ(s.done(0), "1 2");
  s.asked.clear();
  s.links.erase(LinkId{2});  // which had its turn last
  s.links.at({3}).accepts.lost();
  EXPECT_EQ(s.done(1000), "4");
  EXPECT_EQ(s.deadline(), -1);
}

}  // namespace
}  // namespace connect_bridge::link_test
