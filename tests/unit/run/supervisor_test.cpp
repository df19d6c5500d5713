// What systemd is told, at real sockets.
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

}  // namespace
}  // namespace connect_bridge::test
