// Who asks for the status is a stranger: hostile requests, limits, tokens.
#include "net/http/status_door.hpp"

#include <gmock/gmock.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <boost/asio/local/stream_protocol.hpp>

#include "unit/net/tls/certificates.hpp"
#include "unit/net/tls/raw_tls.hpp"
#include "unit/net/websocket/harness.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

SharedText shared(std::string text) {
  return std::make_shared<const std::string>(std::move(text));
}

class StatusDoorTest : public testing::Test {
 protected:
  ~StatusDoorTest() override { door->close(); }

  void open(const std::optional<TlsOptions>& tls = {}) {
    ASSERT_EQ(door->listen("127.0.0.1", 0, tls), "");
  }
  static std::string get(const std::string& path, const std::string& more = "",
                         const std::string& host = "localhost") {
    return "GET " + path + " HTTP/1.1\r\nHost: " + host + "\r\n" + more + "\r\n";
  }
  // The whole answer.
  std::string said(const std::string& request) {
    RawPeer peer(door->port());
    peer.send(request);
    EXPECT_TRUE(peer.ends(loop));
    return peer.text;
  }
  // Whether the door has closed it, also behind the end of its answer.
  bool is_cut(RawPeer& peer) {
    peer.ended = false;
    for (int i = 0; i < 4 && !peer.ended; ++i) {
      peer.send("x");
      loop.run_for(2ms);
    }
    return peer.ended;
  }
  std::string first_line(const std::string& request) {
    const std::string answer = said(request);
    return answer.substr(0, answer.find('\r'));
  }

  Loop loop;
  std::vector<StatusRequest> asked;
  std::vector<StatusDoor::Answered> later;
  std::vector<std::string> logs;
  std::function<unsigned(const std::string&)> judge = [](const std::string&) { return 401U; };
  std::shared_ptr<StatusDoor> made(StatusDoor::Times times) {
    return std::make_shared<StatusDoor>(
        loop.io,
        StatusDoor::Ports{[this](const StatusRequest& request, StatusDoor::Answered answered) {
                            asked.push_back(request);
                            if (request.path == "/later") return later.push_back(answered);
                            StatusAnswer answer;
                            answer.body = shared("this is it");
                            answer.streams = request.path == "/stream";
                            answered(answer);
                          },
                          [this](const std::string& token) { return judge(token); },
                          [this](LogLevel, const std::string& text) { logs.push_back(text); }},
        times);
  }
  std::shared_ptr<StatusDoor> door = made({300ms, 300ms});
};

TEST_F(StatusDoorTest, AnswersWithoutAWayForOtherPages) {
  open();
  EXPECT_THAT(
      said(get("/api/status?x=1", "Accept: application/openmetrics-text\r\n")),
      AllOf(StartsWith("HTTP/1.1 200 OK"), HasSubstr("\r\n\r\nthis is it"),
            HasSubstr("Content-Security-Policy: default-src 'none'"), HasSubstr("nosniff"),
            HasSubstr("Connection: close"), HasSubstr("Cross-Origin-Resource-Policy: same-origin"),
            Not(HasSubstr("Access-Control")), Not(HasSubstr("Set-Cookie"))));
  ASSERT_EQ(asked.size(), 1U);
  EXPECT_EQ(asked[0].path, "/api/status");
  EXPECT_TRUE(asked[0].open_metrics);
  EXPECT_FALSE(asked[0].sees_names);  // every user of this machine may be there
}

TEST_F(StatusDoorTest, TakesRequestsOfThisKindOnly) {
  open();
  EXPECT_EQ(first_line("POST / HTTP/1.1\r\nHost: localhost\r\n\r\n"),
            "HTTP/1.1 405 Method Not Allowed");
  EXPECT_EQ(first_line("HEAD / HTTP/1.1\r\nHost: localhost\r\n\r\n"),
            "HTTP/1.1 405 Method Not Allowed");
  EXPECT_EQ(first_line("OPTIONS / HTTP/1.1\r\nHost: localhost\r\n\r\n"),
            "HTTP/1.1 405 Method Not Allowed");
  const std::string bad = "HTTP/1.1 400 Bad Request";
  EXPECT_EQ(first_line("hello\r\n\r\n"), bad);
  EXPECT_EQ(first_line("GET / HTTP/1.1\r\n\r\n"), bad);
  EXPECT_EQ(first_line(get("/", "Transfer-Encoding: chunked\r\n")), bad);
  EXPECT_EQ(first_line(get("/", "X: " + std::string(9000, 'x') + "\r\n")),
            "HTTP/1.1 431 Request Header Fields Too Large");
  EXPECT_EQ(first_line(get("/", "Origin: http://localhost:9091\r\n")), "HTTP/1.1 403 Forbidden");
  EXPECT_EQ(first_line(get("/", "", "evil.example")), "HTTP/1.1 421 Misdirected Request");
  EXPECT_TRUE(asked.empty());
}

TEST_F(StatusDoorTest, SlowOnesEndInTime) {
  open();
  RawPeer silent(door->port()), slow(door->port());
  slow.send("GET / HTTP/1.1\r\nHost: loc");
  EXPECT_TRUE(silent.ends(loop));
  EXPECT_TRUE(slow.ends(loop));
  RawPeer waiting(door->port());
  waiting.send(get("/later"));
  EXPECT_TRUE(waiting.ends(loop));
  later.at(0)({});  // its connection is gone
  EXPECT_EQ(waiting.text, "");
}

TEST_F(StatusDoorTest, WhoHasNotAskedGivesWay) {
  open();
  std::vector<std::unique_ptr<RawPeer>> silent;
  for (std::size_t i = 0; i < StatusDoor::kConnectionsMax; ++i)
    silent.push_back(std::make_unique<RawPeer>(door->port()));
  RawPeer last(door->port());
  last.send(get("/"));
  EXPECT_TRUE(last.ends(loop, 200ms));
  EXPECT_THAT(last.text, HasSubstr("this is it"));
  silent[0]->poll();
  EXPECT_TRUE(silent[0]->ended);
}

// Nor does who is refused keep a place, if it does not close the connection.
TEST_F(StatusDoorTest, WhoIsRefusedGivesWay) {
  open();
  std::vector<std::unique_ptr<RawPeer>> refused;
  for (std::size_t i = 0; i < StatusDoor::kConnectionsMax; ++i) {
    refused.push_back(std::make_unique<RawPeer>(door->port()));
    refused.back()->send(get("/", "", "evil.example"));
    ASSERT_TRUE(refused.back()->sees(loop, "421"));
  }
  EXPECT_EQ(first_line(get("/")), "HTTP/1.1 200 OK");
}

// A local user that closes nothing keeps out neither Prometheus nor a probe.
TEST_F(StatusDoorTest, WhoHasAnAnswerGivesWayTheOldestFirst) {
  door = made({60s, 60s});
  open();
  RawPeer waits(door->port());
  waits.send(get("/later"));
  ASSERT_TRUE(loop.until([&] { return later.size() == 1; }));
  std::vector<std::unique_ptr<RawPeer>> answered;
  const auto one_more = [&] {
    answered.push_back(std::make_unique<RawPeer>(door->port()));
    answered.back()->send(get("/"));
    return answered.back()->sees(loop, "this is it");
  };
  for (std::size_t i = 1; i < StatusDoor::kConnectionsMax; ++i) ASSERT_TRUE(one_more());
  EXPECT_FALSE(is_cut(*answered[0]));
  for (std::size_t i = 0; i < 3; ++i) {
    ASSERT_TRUE(one_more());
    EXPECT_TRUE(is_cut(*answered[i])) << i;
    EXPECT_FALSE(is_cut(*answered[i + 1])) << i;
  }
  StatusAnswer answer;
  answer.body = shared("late");
  later[0](answer);  // who waits was there before all of them
  EXPECT_TRUE(waits.sees(loop, "late"));
}

TEST_F(StatusDoorTest, WhereAllWaitForAnAnswerTheOldestGivesWay) {
  door = made({60s, 60s});
  open();
  std::vector<std::unique_ptr<RawPeer>> waiting;
  for (std::size_t i = 0; i < StatusDoor::kConnectionsMax; ++i) {
    waiting.push_back(std::make_unique<RawPeer>(door->port()));
    waiting.back()->send(get("/later"));
    ASSERT_TRUE(loop.until([&] { return later.size() == i + 1; }));
  }
  EXPECT_EQ(first_line(get("/")), "HTTP/1.1 200 OK");
  waiting[0]->poll();
  waiting[1]->poll();
  EXPECT_TRUE(waiting[0]->ended);
  EXPECT_FALSE(waiting[1]->ended);
}

TEST_F(StatusDoorTest, EventsAreForAFew) {
  open();
  std::vector<std::unique_ptr<RawPeer>> following;
  for (std::size_t i = 0; i < StatusDoor::kStreamsMax; ++i) {
    following.push_back(std::make_unique<RawPeer>(door->port()));
    following.back()->send(get("/stream"));
    ASSERT_TRUE(following.back()->sees(loop, "this is it"));
  }
  EXPECT_EQ(door->streams(), StatusDoor::kStreamsMax);
  EXPECT_EQ(first_line(get("/stream")), "HTTP/1.1 503 Service Unavailable");
  door->tell(shared("anna"), shared("somebody"));
  EXPECT_TRUE(following[0]->sees(loop, "somebody"));
  EXPECT_THAT(following[0]->text, Not(HasSubstr("anna")));
  following.pop_back();
  EXPECT_TRUE(loop.until([&] { return door->streams() == StatusDoor::kStreamsMax - 1; }));
}

// Also of those that wait together for their first answer.
TEST_F(StatusDoorTest, EventsAreForAFewAtOnce) {
  open();
  std::vector<std::unique_ptr<RawPeer>> following;
  for (std::size_t i = 0; i < StatusDoor::kConnectionsMax; ++i) {
    following.push_back(std::make_unique<RawPeer>(door->port()));
    following.back()->send(get("/later"));
  }
  ASSERT_TRUE(loop.until([&] { return later.size() == StatusDoor::kConnectionsMax; }));
  StatusAnswer stream = plain_answer(200, "first");
  stream.streams = true;
  for (const auto& answered : later) answered(stream);
  EXPECT_EQ(door->streams(), StatusDoor::kStreamsMax);
  ASSERT_TRUE(following.back()->sees(loop, "503"));
  EXPECT_EQ(door->streams(), StatusDoor::kStreamsMax);
}

// However many local users' connections there are.
TEST_F(StatusDoorTest, ByTheFileThereIsAPlace) {
  open();
  const std::string file = scratch_folder() + "/place.status";
  ASSERT_EQ(door->listen_at_file(file), "");
  std::vector<std::unique_ptr<RawPeer>> following;
  for (std::size_t i = 0; i < StatusDoor::kConnectionsMax; ++i) {
    following.push_back(std::make_unique<RawPeer>(door->port()));
    following.back()->send(get(i < StatusDoor::kStreamsMax ? "/stream" : "/later"));
  }
  ASSERT_TRUE(loop.until([&] { return asked.size() == StatusDoor::kConnectionsMax; }));
  asio::local::stream_protocol::socket own(loop.io);
  own.connect({file});
  const std::string request = get("/stream");
  own.write_some(asio::buffer(request));
  EXPECT_TRUE(loop.until([&] { return door->streams() == StatusDoor::kStreamsMax + 1; }));
}

TEST_F(StatusDoorTest, LargeEventsComeLessOften) {
  open();
  RawPeer peer(door->port());
  peer.send(get("/stream"));
  ASSERT_TRUE(peer.sees(loop, "this is it"));
  const auto large = shared(std::string(10 * StatusDoor::kStreamBytesPerSecond, 'x') + "end");
  ASSERT_TRUE(loop.until([&] {
    door->tell(large, large);
    peer.poll();
    return peer.text.ends_with("xend");
  }));
  door->tell(shared("small"), shared("small"));
  loop.run_for(100ms);
  peer.poll();
  EXPECT_THAT(peer.text, Not(HasSubstr("small")));
}

TEST_F(StatusDoorTest, TheSocketIsForThisUserAlone) {
  const std::string file = scratch_folder() + "/door.status";
  ASSERT_EQ(door->listen_at_file(file), "");
  struct stat found {};
  ASSERT_EQ(::stat(file.c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777U, 0600U);
  const int socket = ::socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  file.copy(static_cast<char*>(address.sun_path), sizeof address.sun_path - 1);
  ASSERT_EQ(::connect(socket, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  const std::string request = get("/");
  ASSERT_EQ(::send(socket, request.data(), request.size(), 0),
            static_cast<ssize_t>(request.size()));
  EXPECT_TRUE(loop.until([&] { return !asked.empty(); }));
  EXPECT_TRUE(asked.at(0).sees_names);
  ::close(socket);
  door->close();
  EXPECT_NE(::stat(file.c_str(), &found), 0);
  EXPECT_THAT(door->listen_at_file("/tmp/" + std::string(200, 'x')), HasSubstr("too long"));
}

TEST_F(StatusDoorTest, BeyondLoopbackATokenIsNeeded) {
  Authority authority(scratch_folder() + "/");
  const auto files = authority.sign("robot", "DNS:robot.example");
  TlsOptions tls;
  tls.certificate_file = files.certificate;
  tls.private_key_file = files.key;
  open(tls);
  judge = [](const std::string& token) {
    return token == "right" ? 200U : token == "wrong" ? 401U : 403U;
  };
  const auto over_tls = [&](const std::string& request) {
    RawTls client(door->port(), [](SSL_CTX*) {});
    EXPECT_TRUE(client.shakes(loop));
    SSL_write(client.tls(), request.data(), static_cast<int>(request.size()));
    std::string text(12, ' ');
    client.completes(loop, [&] { return SSL_read(client.tls(), text.data(), 12); });
    return text;
  };
  EXPECT_EQ(over_tls(get("/")), "HTTP/1.1 401");
  EXPECT_EQ(over_tls(get("/", "Authorization: Basic right\r\n")), "HTTP/1.1 401");
  EXPECT_THAT(logs, testing::IsEmpty());
  EXPECT_EQ(over_tls(get("/", "Authorization: Bearer wrong\r\n")), "HTTP/1.1 401");
  EXPECT_EQ(over_tls(get("/", "Authorization: Bearer else\r\n")), "HTTP/1.1 403");
  EXPECT_THAT(logs, testing::ElementsAre("status.listen: refused 127.0.0.1, its token is wrong"))
      << "of many one line now and then";
  EXPECT_TRUE(asked.empty());
  const std::string right = "Authorization: Bearer right\r\n";
  EXPECT_EQ(over_tls(get("/", right, "robot.example:9091")), "HTTP/1.1 200");
  EXPECT_TRUE(asked.at(0).sees_names);
  EXPECT_EQ(over_tls(get("/", right, "evil.example")), "HTTP/1.1 421");
  EXPECT_THAT(said(get("/", right)), Not(HasSubstr("this is it")));  // without TLS

  RawTls follower(door->port(), [](SSL_CTX*) {});
  ASSERT_TRUE(follower.shakes(loop));
  const std::string request = get("/stream", right);
  SSL_write(follower.tls(), request.data(), static_cast<int>(request.size()));
  ASSERT_TRUE(loop.until([&] { return door->streams() == 1; }));
  door->tell(shared("anna"), shared(""));
  EXPECT_EQ(door->streams(), 1U);
  judge = [](const std::string&) { return 401U; };  // it was withdrawn
  door->tell(shared("anna"), shared(""));
  EXPECT_EQ(door->streams(), 0U);
}

}  // namespace
}  // namespace connect_bridge::test
