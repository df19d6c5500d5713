// What systemd is told, at real sockets, and what it passes.
#include "run/supervisor.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <boost/asio/buffer.hpp>
#include <vector>

#include "unit/scratch.hpp"

namespace connect_bridge::test {
namespace {

using Told = std::vector<std::string>;
using Datagrams = boost::asio::local::datagram_protocol;

constexpr char kFirst[] = "READY=1\nWATCHDOG=1";
constexpr char kNext[] = "WATCHDOG=1";

// Stands in for systemd. At most one at a path of this process.
class Manager {
 public:
  // `name` as the kernel has it: a path, or a zero byte and a name.
  Manager(boost::asio::io_context& io, const std::string& name)
      : socket_(io, Datagrams::endpoint(name)) {
    socket_.non_blocking(true);
  }

  // What has come since the last time.
  Told read() {
    Told told;
    std::array<char, 256> buffer{};
    boost::system::error_code error;
    for (;;) {
      const std::size_t size = socket_.receive(boost::asio::buffer(buffer), 0, error);
      if (error) return told;
      told.emplace_back(buffer.data(), size);
    }
  }

 private:
  Datagrams::socket socket_;
};

std::string fresh_path() {
  static int number = 0;
  return scratch_folder() + "notify_" + std::to_string(++number);
}

TEST(Supervisor, LearnsOfTheStartOnceThenOfEachSecondThenOfTheEnd) {
  boost::asio::io_context io;
  const std::string path = fresh_path();
  Manager manager(io, path);
  Supervisor supervisor(io, path);
  EXPECT_EQ(manager.read(), Told{});
  supervisor.every_second();
  EXPECT_EQ(manager.read(), Told{kFirst});
  supervisor.every_second();
  supervisor.every_second();
  supervisor.stopping();
  EXPECT_EQ(manager.read(), (Told{kNext, kNext, "STOPPING=1"}));
}

TEST(Supervisor, MayHaveAnAbstractName) {
  boost::asio::io_context io;
  const std::string name = "connect_bridge_test_" + std::to_string(::getpid());
  Manager manager(io, '\0' + name);
  Supervisor supervisor(io, '@' + name);
  supervisor.every_second();
  EXPECT_EQ(manager.read(), Told{kFirst});
}

TEST(Supervisor, ThatWasNotThereLearnsOfTheStartLater) {
  boost::asio::io_context io;
  const std::string path = fresh_path();
  Supervisor supervisor(io, path);
  supervisor.every_second();
  Manager manager(io, path);
  supervisor.every_second();
  supervisor.every_second();
  EXPECT_EQ(manager.read(), (Told{kFirst, kNext}));
}

TEST(Supervisor, ThatReadsNothingHoldsUpNobody) {
  boost::asio::io_context io;
  const std::string path = fresh_path();
  Manager manager(io, path);
  Supervisor supervisor(io, path);
  for (int i = 0; i < 5000; ++i) supervisor.every_second();  // more than any queue holds
  supervisor.stopping();
  EXPECT_EQ(manager.read().front(), kFirst);
}

TEST(Supervisor, IsNobodyAtAnAddressThatIsNoSocket) {
  boost::asio::io_context io;
  const std::string long_name(200, 'a');
  for (const std::string& address :
       Told{"", "vsock:2:1", "notify", '/' + long_name, '@' + long_name}) {
    Supervisor supervisor(io, address);
    supervisor.every_second();
    supervisor.stopping();
  }
}

using Sockets = std::vector<int>;

TEST(Activation, TakesTheSocketsOfThisProcessOnly) {
  EXPECT_EQ(passed_sockets(77, "77", "1").sockets, Sockets{3});
  EXPECT_EQ(passed_sockets(77, "77", "3").sockets, (Sockets{3, 4, 5}));
  EXPECT_EQ(passed_sockets(77, "77", "3").problem, "");
  for (const char* other : {"", "78", "77x", " 77", "-77"}) {
    const PassedSockets passed = passed_sockets(77, other, "1");
    EXPECT_TRUE(passed.sockets.empty()) << other;
    EXPECT_NE(passed.problem.find("LISTEN_PID"), std::string::npos) << passed.problem;
  }
  for (const char* count : {"", "0", "-1", "9", "many", "99999999999999999999"}) {
    const PassedSockets passed = passed_sockets(77, "77", count);
    EXPECT_TRUE(passed.sockets.empty()) << count;
    EXPECT_NE(passed.problem.find("LISTEN_FDS"), std::string::npos) << passed.problem;
  }
}

}  // namespace
}  // namespace connect_bridge::test
