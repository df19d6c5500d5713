// Addresses that no interface has when the server starts, and the socket file.
#include "net/tcp/tcp_doors.hpp"

#include <gtest/gtest.h>

#include "core/ports/url.hpp"
#include "unit/net/websocket/harness.hpp"

namespace connect_bridge::test {
namespace {

// As at boot, before a VPN is up. Nobody has these addresses: they are for documentation.
TEST(TcpDoors, AnAddressThatNoInterfaceHasYetKeepsNoOtherClosed) {
  for (const std::string absent : {"192.0.2.1", "2001:db8::1"}) {
    ListenOptions options;
    options.addresses = {absent, "127.0.0.1"};
    Pair pair{options};
    if (pair.problem.find("not supported") != std::string::npos) continue;  // no IPv6 here
    ASSERT_EQ(pair.problem, "");
    const std::string there = host_and_port(absent, pair.server.network.listen_port());
    EXPECT_EQ(pair.server.network.listen_addresses().front(), there);
    const std::string warning = "no interface has the address of " + there +
                                " now: nobody can connect there before one has it (listen.address)";
    EXPECT_EQ(pair.server.logs, std::vector<std::string>{warning});
    EXPECT_TRUE(pair.connect());
  }
}

TEST(TcpDoors, APortThatIsInUseIsAProblemThereToo) {
  ListenOptions options;
  options.addresses = {"192.0.2.1"};
  Pair pair{options};
  ASSERT_EQ(pair.problem, "");
  Side other(pair.loop);
  options.port = pair.server.network.listen_port();
  EXPECT_EQ(other.network.listen(options).find(
                "cannot listen on 192.0.2.1:" + std::to_string(options.port) +
                ": Address already in use (a server that runs"),
            0U);
  EXPECT_TRUE(other.logs.empty());
}

TEST(TcpDoors, AnAddressThatIsThereCausesNoWarning) {
  ListenOptions options;
  options.addresses = {"localhost", "127.0.0.2"};  // no interface lists the second one
  Pair pair{options};
  EXPECT_EQ(pair.problem, "");
  EXPECT_TRUE(pair.server.logs.empty());
}

}  // namespace
}  // namespace connect_bridge::test
