#include "access/login/runtime_folder.hpp"

#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "unit/scratch.hpp"

namespace connect_bridge {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::Contains;
using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;
using testing::UnorderedElementsAre;

// A unit's folder has the unit's name, which the operator chooses.
TEST(RuntimeFolder, FoldersOfUnitsHaveAnyName) {
  const std::string run = test::scratch_folder() + "run";
  for (const char* name : {"connect_bridge", "connect_client", "of_anna", "lock"})
    fs::create_directories(run + "/" + name);
  fs::permissions(run + "/lock", fs::perms::all | fs::perms::sticky_bit);
  fs::create_directory_symlink(run + "/lock", run + "/linked");
  EXPECT_THAT(
      folders_of_units(run),
      UnorderedElementsAre(run + "/connect_bridge", run + "/connect_client", run + "/of_anna"))
      << "others may put a socket into /run/lock";
}

TEST(RuntimeFolder, AUnitOfAnotherUserIsNotAsked) {
  const fs::path run = fs::temp_directory_path() / ("connect_run_" + std::to_string(::getpid()));
  fs::create_directories(run / "unit");
  const std::string socket = run / "unit/connect_server-1.status";
  boost::asio::io_context io;
  const boost::asio::local::stream_protocol::acceptor listens(io, {socket});
  EXPECT_THAT(status_sockets(run), Contains(socket));
  ASSERT_EQ(::chmod(socket.c_str(), 0), 0);
  const auto look = [&] {
    if (::getuid() == 0 && ::setuid(65534) != 0) std::exit(1);
    const auto found = status_sockets(run);
    std::exit(static_cast<int>(std::count(found.begin(), found.end(), socket)));
  };
  EXPECT_EXIT(look(), testing::ExitedWithCode(0), "");
  fs::remove_all(run);
}

// It was started with another XDG_RUNTIME_DIR, or by another user.
TEST(RuntimeFolder, SocketsElsewhereAreNamed) {
  const std::string bound = test::scratch_folder() + "bound";
  std::ofstream table(bound);
  const auto socket = [&](const std::string& path) {
    table << "0000000000000000: 00000002 00000000 00010000 0001 01 4711" << path << "\n";
  };
  table << "Num       RefCount Protocol Flags    Type St Inode Path\n";
  socket("");
  socket(" /run/systemd/private");
  socket(" @/abstract.status");
  table.flush();
  EXPECT_EQ(where_sockets_are(bound).find("elsewhere"), std::string::npos);
  socket(" /tmp/connect_bridge-" + std::to_string(::geteuid()) + "/connect_server-3.status");
  table.flush();
  EXPECT_THAT(where_sockets_are(bound), AllOf(StartsWith("looked in "), Not(HasSubstr("-3"))));
  socket(" /home/anna/run/connect_bridge/connect_server-17.status");
  table.flush();
  EXPECT_THAT(where_sockets_are(bound),
              EndsWith("; elsewhere there is /home/anna/run/connect_bridge/"
                       "connect_server-17.status"));
  for (int i = 20; i < 30; ++i) socket(" /x/connect_client-" + std::to_string(i) + ".status");
  table.flush();
  EXPECT_THAT(where_sockets_are(bound), EndsWith("/x/connect_client-22.status, ..."));
}

}  // namespace
}  // namespace connect_bridge
