#include "net/tcp/socket_tuning.hpp"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <boost/asio/ip/tcp.hpp>

#include "unit/net/websocket/harness.hpp"

namespace connect_bridge::test {
namespace {

TEST(SocketTuning, TcpSendsAgainSoonButNotBeforeAnAnswerCanCome) {
  EXPECT_EQ(longest_retry(0us), 1s);
  EXPECT_EQ(longest_retry(20ms), 1s);
  EXPECT_EQ(longest_retry(600ms), 2400ms);
  EXPECT_EQ(longest_retry(1h), 120s) << "more is an error for the kernel";
}

TEST(SocketTuning, EachConnectionHasIt) {
  constexpr int kRtoMaxMs = 44;  // TCP_RTO_MAX_MS
  boost::asio::io_context io;
  boost::asio::ip::tcp::socket socket(io, boost::asio::ip::tcp::v4());
  const int native = socket.native_handle();
  int value = 0;
  socklen_t size = sizeof value;
  tune_socket(native, {});
  ASSERT_EQ(::getsockopt(native, IPPROTO_TCP, TCP_THIN_LINEAR_TIMEOUTS, &value, &size), 0);
  EXPECT_EQ(value, 1);
  if (::getsockopt(native, IPPROTO_TCP, kRtoMaxMs, &value, &size) != 0)
    GTEST_SKIP() << "SKIPPED TCP_RTO_MAX_MS: the kernel is older than Linux 6.15";
  EXPECT_EQ(value, 1000);
}

}  // namespace
}  // namespace connect_bridge::test
