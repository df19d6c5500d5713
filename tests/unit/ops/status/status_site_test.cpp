#include "ops/status/status_site.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <boost/asio/local/stream_protocol.hpp>
#include <cstdlib>
#include <filesystem>
#include <iterator>

#include "access/login/runtime_folder.hpp"

namespace connect_bridge {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;

class StatusSiteTest : public testing::Test {
 protected:
  StatusSiteTest() {
    std::filesystem::create_directories(folder);
    ::setenv("RUNTIME_DIRECTORY", folder.c_str(), 1);
    std::filesystem::permissions(folder, std::filesystem::perms::owner_all);
  }
  ~StatusSiteTest() override {
    ::unsetenv("RUNTIME_DIRECTORY");
    std::filesystem::remove_all(folder);
  }
  // Other programs of this user may run now.
  [[nodiscard]] std::vector<std::string> sockets() const {
    auto all = status_sockets();
    std::erase_if(all, [&](const auto& socket) { return !socket.starts_with(folder); });
    return all;
  }
  [[nodiscard]] std::string answer(const std::string& path) const {
    boost::asio::local::stream_protocol::iostream asked(
        boost::asio::local::stream_protocol::endpoint(sockets().at(0)));
    asked << "GET " << path << " HTTP/1.1\r\nHost: localhost\r\n\r\n" << std::flush;
    return {std::istreambuf_iterator<char>(asked), std::istreambuf_iterator<char>()};
  }
  static std::shared_ptr<StatusPicture> picture(bool open) {
    auto made = std::make_shared<StatusPicture>();
    made->run.role = Role::kClient;
    made->side.last_failure = {Cause::kPortClosed, "refused"};
    made->side.links.resize(open ? 1 : 0);
    if (open) made->side.links[0].open = true;
    return made;
  }

  // Short: the path of a socket has 107 bytes at most.
  const std::string folder = "/tmp/cb_site_" + std::to_string(::getpid());
  std::vector<std::string> logs;
  StatusSite site{{"/robot/connect_server", {}, {}, {}},
                  [this](LogLevel, const std::string& text) { logs.push_back(text); }};
};

TEST_F(StatusSiteTest, ALoopThatStandsStillIsNotAlive) {
  ASSERT_EQ(site.open(), "");
  EXPECT_THAT(logs, IsEmpty());
  EXPECT_THAT(sockets(), ElementsAre(HasSubstr("/robot.connect_server-")));
  EXPECT_FALSE(site.wanted());
  // The page needs no picture.
  EXPECT_THAT(answer("/"), AllOf(StartsWith("HTTP/1.1 200 OK"), HasSubstr("script-src 'sha256-"),
                                 HasSubstr("<!doctype html>"), Not(HasSubstr("/*columns*/")),
                                 HasSubstr(page_columns().dump())));
  EXPECT_THAT(answer("/healthz"), StartsWith("HTTP/1.1 503"));
  EXPECT_TRUE(site.wanted());
}

TEST_F(StatusSiteTest, AClientIsReadyWhenItIsLinked) {
  ASSERT_EQ(site.open(), "");
  site.publish(picture(false));
  EXPECT_THAT(answer("/readyz"),
              AllOf(StartsWith("HTTP/1.1 503"), HasSubstr("refused (port_closed)")));
  site.publish(picture(true));
  EXPECT_THAT(answer("/readyz"), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(answer("/api/history"), HasSubstr("\"path_queue_ms\":[0.0]"));
  // A gap, and no zero, where nothing is known.
  EXPECT_THAT(answer("/api/history"), HasSubstr("\"round_trip_ms\":[null]"));
  const auto lost = picture(true);
  lost->side.links[0].open = false;
  site.publish(lost);
  EXPECT_THAT(answer("/api/history"), AllOf(HasSubstr("\"path_queue_ms\":[0.0,null]"),
                                            HasSubstr("\"sent_bytes_per_second\":[null,null]")));
}

TEST_F(StatusSiteTest, WhatAKilledProgramLeftIsRemoved) {
  const std::string left = folder + "/left-1.status";
  {
    boost::asio::io_context io;
    const boost::asio::local::stream_protocol::acceptor ended(
        io, boost::asio::local::stream_protocol::endpoint(left));
  }
  ASSERT_TRUE(std::filesystem::exists(left));
  EXPECT_THAT(sockets(), IsEmpty());
  EXPECT_FALSE(std::filesystem::exists(left));
}

TEST_F(StatusSiteTest, AFolderThatOthersMayChangeIsNotUsed) {
  std::filesystem::permissions(folder, std::filesystem::perms::all);
  std::string problem;
  EXPECT_NE(make_runtime_folder(problem), folder);
}

}  // namespace
}  // namespace connect_bridge
