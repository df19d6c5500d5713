#include "net/tcp/descriptors.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <memory>
#include <vector>

#include "unit/net/websocket/harness.hpp"

namespace connect_bridge::test {
namespace {

using testing::HasSubstr;

class Limit {
 public:
  explicit Limit(rlim_t most) {
    ::getrlimit(RLIMIT_NOFILE, &before_);
    const rlimit fewer{most, before_.rlim_max};
    ::setrlimit(RLIMIT_NOFILE, &fewer);
  }
  ~Limit() { ::setrlimit(RLIMIT_NOFILE, &before_); }
  Limit(const Limit&) = delete;
  Limit& operator=(const Limit&) = delete;
  [[nodiscard]] rlim_t hard() const { return before_.rlim_max; }

 private:
  rlimit before_{};
};

int lowest_free() {
  const int next = ::dup(STDERR_FILENO);
  ::close(next);
  return next;
}

TEST(Descriptors, AreRaisedToWhatTheHostAllows) {
  const Limit few(100);
  EXPECT_EQ(raise_descriptors(), few.hard());
}

TEST(Descriptors, ClientsThatDoNotFitTheLimitAreAProblemWithItsCure) {
  EXPECT_EQ(descriptors_problem(64, 384, 1024), "");
  EXPECT_EQ(descriptors_problem(480, 384, 1024), "");
  EXPECT_EQ(descriptors_problem(481, 384, 1024),
            "connections_max: 481 is wrong, expected at most 480, or a limit of at least 1025 file "
            "descriptors, and it is 1024 (LimitNOFILE of the systemd unit, or ulimit -Hn)");
  EXPECT_THAT(descriptors_problem(64, 384, 256),
              HasSubstr("expected a limit of at least 608 file descriptors, and it is 256"));
}

// A withdrawal must be readable, however many connections somebody makes.
TEST(Descriptors, ConnectionsLeaveSomeForFiles) {
#if defined(__has_feature)
#if __has_feature(undefined_behavior_sanitizer)
  GTEST_SKIP() << "NOT TESTED under this sanitizer, which opens a pipe to look at an object's type";
#endif
#endif
  constexpr int kPeers = 16;
  Pair pair;
  std::vector<std::unique_ptr<RawPeer>> peers;
  for (int i = 0; i < kPeers; ++i)
    peers.push_back(std::make_unique<RawPeer>(pair.server.network.listen_port()));
  const Limit few(static_cast<rlim_t>(lowest_free()) + kDescriptorsForFiles + kPeers / 2);
  ASSERT_TRUE(pair.loop.until([&] { return !pair.server.logs.empty(); }));
  EXPECT_THAT(pair.server.logs[0], HasSubstr("cannot accept connections now"));
  std::vector<int> files;
  while (files.empty() || files.back() >= 0) files.push_back(::dup(STDERR_FILENO));
  files.pop_back();
  for (const int file : files) ::close(file);
  EXPECT_GE(files.size(), kDescriptorsForFiles);
}

}  // namespace
}  // namespace connect_bridge::test
