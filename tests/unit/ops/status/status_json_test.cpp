#include "ops/status/status_json.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string_view>
#include <thread>

#include "core/base/json.hpp"
#include "ops/status/status_file.hpp"
#include "unit/scratch.hpp"
#include "unit/source_text.hpp"

namespace connect_bridge {
namespace {

TEST(StatusJson, WithoutLinks) {
  Status status;
  status.memory_bytes = 7;
  status.shared_bytes = 8;
  status.shared_bytes_max = 9;
  status.last_failure = {Cause::kPortClosed, "refused"};
  RunStatus run{"2026-01-31T12:00:00Z", true, "/connect", Role::kClient, 1.5};
  run.ros.taken = 2;
  run.ros.published = 3;
  run.ros.types_not_installed = 4;
  run.traffic = {5, 6};
  run.version = "1.2.3";
  run.started = "2026-01-30T12:00:00Z";
  const auto json = Json::parse(to_json({status, run}));
  EXPECT_EQ(json, Json::parse(R"({"schema": 1, "time": "2026-01-31T12:00:00Z", "running": true,
    "started": "2026-01-30T12:00:00Z", "version": "1.2.3",
    "node": "/connect", "role": "client", "is_robot": true, "loop_lag_ms": 1.5,
    "memory_bytes": 7, "memory_max_used_bytes": 8, "memory_max_bytes": 9,
     "made_unanswered": 0, "served_unanswered": 0,
     "taken": 2, "published": 3, "types_not_installed": 4, "reading_held": 0,
     "extra_frames": 0,
    "traffic": {"sent_bytes": 5, "received_bytes": 6},
    "last_failure": "refused", "last_failure_code": "port_closed", "links": []})"));
}

TEST(StatusJson, WhereAServerIsReached) {
  RunStatus run;
  run.listens = {"127.0.0.1:9090"};
  EXPECT_EQ(Json::parse(to_json({{}, run})).at("listens"), Json::parse(R"(["127.0.0.1:9090"])"));
}

TEST(StatusJson, TheEndOfItsCertificate) {
  RunStatus run;
  EXPECT_FALSE(Json::parse(to_json({{}, run})).contains("certificate_valid_until"));
  run.certificate_end = 1796688000 * kStampSecond;
  EXPECT_EQ(Json::parse(to_json({{}, run})).at("certificate_valid_until"),
            "2026-12-08T00:00:00.000Z");
}

TEST(StatusJson, WhoCameToAServer) {
  Status status;
  status.strangers = {1, 2, 3, 4, 5, 11, 12, 13};
  RunStatus run{"", true, "/connect", Role::kClient};
  EXPECT_FALSE(Json::parse(to_json({status, run})).contains("strangers"));
  run.role = Role::kServer;
  run.network = {{6, 7, 8, 9, 10, 11, "192.0.2.1: no"}};
  EXPECT_EQ(Json::parse(to_json({status, run})).at("strangers"), Json::parse(R"({
    "accepted": 6, "refused": 7, "last_refused": "192.0.2.1: no", "proxy_headers": 11,
    "waiting": 1, "gave_way": 12, "handshakes_dropped": 8,
    "handshakes_waited": 9, "wrong_logins": 3, "wrong_logins_late": 4, "shut_out": 5,
    "login_timeouts": 11, "logins_without_place": 12, "logins_not_judged": 13})"));
}

ServiceStatus a_service() {
  ServiceStatus service;
  service.service = "/s";
  service.type = "p/srv/S";
  service.exported = service.attached = true;
  service.pending = 1;
  service.waiting = 2;
  service.calls = 3;
  service.answered = 4;
  service.refused = 5;
  service.timed_out = 6;
  service.forgotten = 7;
  service.lost = 8;
  service.duplicates = 9;
  service.request_bytes = 10;
  service.response_bytes = 11;
  service.declined = "no such type";
  return service;
}

MissingName a_missing_name() {
  MissingName missing;
  missing.name = "/c", missing.type = "p/msg/T";
  missing.reason = MissingReason::kDenied;
  missing.rule = "shut";
  missing.text = "it is denied";
  return missing;
}

LinkStatus a_link() {
  LinkStatus link;
  link.number = 8;
  link.peer = "10.0.0.2:4";
  link.node = "/peer";
  link.identity = "anna";
  link.open = true;
  link.open_for = std::chrono::milliseconds(61'900);
  link.unheard = std::chrono::milliseconds(7'400);
  link.peer_findings = {{"qos", "/b"}, {"all_is_well_come_closer", "/b"}};
  link.sent_bytes = 1, link.received_bytes = 2, link.queued_bytes = 3;
  link.unacknowledged_bytes = 4;
  link.memory_bytes = 6;
  link.rate = 2250000;
  link.path_queue = std::chrono::microseconds(1500);
  link.connects = 5;
  link.mirrors_waited = 7;
  link.segments = 9;
  link.retransmitted = 2;
  link.clock = {true, std::chrono::milliseconds(-1500), std::chrono::microseconds(2500),
                std::chrono::microseconds(1250)};
  return link;
}

TEST(StatusJson, ALinkWithItsTopicsAndServices) {
  TopicStatus exported;
  exported.topic = "/a", exported.type = "p/msg/T";
  exported.exported = exported.demanded = true;
  exported.origins = 2;
  exported.messages = 3;
  exported.bytes = 30, exported.wire_bytes = 20;
  exported.queued = 1, exported.published_for_each_sent = 3;
  exported.dropped.add(DropReason::kRate, 4);
  exported.declined = "no such type";
  exported.declined_code = "type_unknown";
  exported.keep_because = "an event";
  exported.rule = "look";
  exported.sent_as = {.codec = Codec::kCloud, .step_um = 5000, .because = "the link is thin"};
  TopicStatus imported;
  imported.topic = "/b", imported.type = "p/msg/T";
  imported.latency_ms = 2.5;
  imported.idle = std::chrono::milliseconds(1900);
  imported.usual_rate = 9.96;
  imported.misfit = "durability";
  LinkStatus link = a_link();
  link.topics = {exported, imported};
  link.services = {a_service()};
  link.missing = {a_missing_name()};
  link.further_missing = 3;
  Status status;
  status.links = {link};
  EXPECT_EQ(Json::parse(to_json({status, {}})).at("links"), Json::parse(R"([{
    "link": 8, "peer": "10.0.0.2:4", "node": "/peer", "identity": "anna", "open": true,
    "state": "open", "open_seconds": 61, "unheard_seconds": 7,
    "peer_findings": [{"id": "qos", "name": "/b"}], "segments": 9, "retransmitted": 2,
    "connects": 5, "mirrors_waited": 7, "sent_bytes": 1, "received_bytes": 2, "queued_bytes": 3,
    "unacknowledged_bytes": 4, "memory_bytes": 6, "rate_bytes_per_second": 2250000,
    "path_queue_ms": 1.5,
    "clock": {"offset_ms": -1500.0, "round_trip_ms": 2.5, "error_bound_ms": 1.25}, "topics": [
      {"topic": "/a", "type": "p/msg/T", "direction": "export", "demanded": true, "origins": 2,
       "state": "declined", "published": 8, "messages": 3, "bytes": 30, "wire_bytes": 20,
       "queued": 1, "dropped": {"rate": 4},
       "keep": "all", "keep_because": "an event", "sent_as": "cloud", "sent_as_step": 0.005,
       "sent_as_because": "the link is thin", "not_exact": "points rounded to 5 mm",
       "rule": "look", "declined": "no such type",
       "declined_code": "type_unknown",
       "overload": "more than the link carries: one of 3.0 is sent"},
      {"topic": "/b", "type": "p/msg/T", "direction": "import", "demanded": false, "origins": 0,
       "state": "no_subscriber", "messages": 0, "bytes": 0, "wire_bytes": 0, "queued": 0,
       "dropped": {}, "misfit": "durability", "latency_ms": 2.5, "idle_seconds": 1,
       "usual_rate": 10.0}],
    "services": [
      {"service": "/s", "type": "p/srv/S", "direction": "export", "state": "declined",
       "attached": true, "pending": 1,
       "waiting": 2, "calls": 3, "answered": 4, "refused": 5, "timed_out": 6, "forgotten": 7,
       "lost": 8, "duplicates": 9, "request_bytes": 10, "response_bytes": 11,
       "declined": "no such type"}],
    "missing": [{"kind": "topic", "name": "/c", "type": "p/msg/T", "direction": "import",
       "reason": "denied", "rule": "shut", "text": "it is denied", "waits": "nobody"}],
    "further_missing": {"count": 3}}])"));
}

TEST(StatusJson, NamesOfPeopleAreHiddenFromOtherUsers) {
  Status status;
  status.links.resize(1);
  status.links[0].identity = "anna";
  status.last_failure = {Cause::kLoginRefused, "anna is not permitted"};
  EXPECT_THAT(to_json({status, {}}), testing::HasSubstr("anna"));
  EXPECT_THAT(to_json({status, {}}, Names::kHidden), testing::Not(testing::HasSubstr("anna")));
}

TEST(StatusJson, OneWordForWhatATopicDoes) {
  TopicStatus topic;
  EXPECT_EQ(name_of(state_of(topic)), "no_subscriber");
  topic.kept = true;
  EXPECT_EQ(name_of(state_of(topic)), "kept");
  topic.demanded = true;
  EXPECT_EQ(name_of(state_of(topic)), "no_publisher");
  topic.origins = 1;
  EXPECT_EQ(name_of(state_of(topic)), "flows");
  topic.idle = std::chrono::seconds(9);
  EXPECT_EQ(name_of(state_of(topic)), "flows");
  topic.idle = std::chrono::seconds(10);
  EXPECT_EQ(name_of(state_of(topic)), "quiet");
  topic.published_for_each_sent = 10;
  EXPECT_EQ(name_of(state_of(topic)), "overloaded");
  topic.declined = "no such type";
  EXPECT_EQ(name_of(state_of(topic)), "declined");
  ServiceStatus service;
  EXPECT_EQ(name_of(state_of(service)), "no_client");
  service.attached = true;
  EXPECT_EQ(name_of(state_of(service)), "ready");
  LinkStatus link;
  EXPECT_EQ(name_of(state_of(link)), "lost");
}

// What a stopped sensor has said last is not the age of what it says.
TEST(StatusJson, AQuietTopicHasNoAge) {
  Status status;
  TopicStatus topic;
  topic.demanded = true;
  topic.origins = 1;
  topic.latency_ms = 2.5;
  LinkStatus& link = status.links.emplace_back();
  link.topics = {topic, topic};
  link.topics[1].idle = std::chrono::seconds(60);
  const Json topics = Json::parse(to_json({status, {}})).at("links")[0].at("topics");
  EXPECT_EQ(topics[0].value("latency_ms", 0.0), 2.5);
  EXPECT_FALSE(topics[1].contains("latency_ms"));
}

// An importer is not told the reason, and there is one only.
TEST(StatusJson, TheFormOfAMessageInWords) {
  const auto shown = [](SentAs form) {
    TopicStatus topic;
    topic.sent_as = form;
    Status status;
    status.links.resize(1);
    status.links[0].topics = {topic};
    return Json::parse(to_json({status, {}})).at("links").at(0).at("topics").at(0);
  };
  const Json video = shown({Codec::kPictureBase, 0, 50, true});
  EXPECT_EQ(video.at("not_exact"), "video, poor, half size");
  EXPECT_EQ(video.at("sent_as_quantiser"), 50);
  EXPECT_EQ(video.at("sent_as_because"), "the link would carry too few exact ones");
  EXPECT_EQ(shown({Codec::kPictureBase, 0, 36}).at("not_exact"), "video, good");
  EXPECT_EQ(shown({Codec::kCloud, 0, 0, false, "thinned"}).at("not_exact"), "points left out");
  const Json exact = shown({Codec::kPlanes});
  for (const char* member : {"not_exact", "sent_as_because", "sent_as_quantiser"})
    EXPECT_FALSE(exact.contains(member)) << member;
}

// Nine of ten pictures are replaced: the tenth is not all of it.
TEST(StatusJson, WhatIsPublishedBesideWhatIsForwarded) {
  TopicStatus topic;
  topic.exported = true;
  topic.messages = 10;
  topic.queued = 1;
  topic.dropped.add(DropReason::kNewerAvailable, 89);
  Status status;
  status.links.resize(1);
  status.links[0].topics = {topic};
  const auto link = Json::parse(to_json({status, {}})).at("links").at(0);
  const Json& json = link.at("topics").at(0);
  EXPECT_EQ(json.at("messages"), 10);
  EXPECT_EQ(json.at("published"), 100);
}

TEST(StatusJson, TheBreaksOfALink) {
  LinkStatus link;
  link.breaks = {
      {1796688000 * kStampSecond, 1796688004 * kStampSecond, {Cause::kSilent, "no answer"}, true},
      {1796688100 * kStampSecond, 0, {Cause::kClosed, "closed"}}};
  Status status;
  status.links = {link};
  EXPECT_EQ(Json::parse(to_json({status, {}})).at("links").at(0).at("breaks"), Json::parse(R"([
    {"lost": "2026-12-08T00:00:00.000Z", "back": "2026-12-08T00:00:04.000Z", "seconds": 4.0,
     "reason": "no answer", "code": "silent", "by_peer": true},
    {"lost": "2026-12-08T00:01:40.000Z", "reason": "closed", "code": "closed",
     "by_peer": false}])"));
  // A reason may name a person; its code does not.
  const Json hidden =
      Json::parse(to_json({status, {}}, Names::kHidden)).at("links").at(0).at("breaks");
  EXPECT_EQ(hidden.at(0).at("code"), "silent");
  EXPECT_FALSE(hidden.at(0).contains("reason") || hidden.at(1).contains("reason"));
}

TEST(StatusJson, TheRelayAndARefusedFile) {
  RunStatus run;
  EXPECT_FALSE(Json::parse(to_json({{}, run})).contains("relays"));
  run.relays = {{"wss://r@relay:443", 1796688000 * kStampSecond, {}}};
  run.refused_parameters = {"2026-12-08T00:00:00.000Z", "rule.a: unknown"};
  auto json = Json::parse(to_json({{}, run}));
  EXPECT_EQ(json.at("relays"), Json::parse(R"([{"relay": "wss://r@relay:443", "connected": true,
    "connected_since": "2026-12-08T00:00:00.000Z"}])"));
  EXPECT_EQ(json.at("refused_parameters"),
            Json::parse(R"({"time": "2026-12-08T00:00:00.000Z", "problem": "rule.a: unknown"})"));
  run.relays[0] = {"wss://r@relay:443", 0, {Cause::kRelayUnreachable, "no answer"}};
  json = Json::parse(to_json({{}, run}, Names::kHidden));
  EXPECT_EQ(json.at("relays").at(0).at("connected"), false);
  EXPECT_EQ(json.at("relays").at(0).at("last_failure"), "no answer");
  EXPECT_EQ(json.at("relays").at(0).at("last_failure_code"), "relay_unreachable");
  EXPECT_EQ(json.at("refused_parameters").at("problem"), "");
  EXPECT_FALSE(json.contains("needs_restart"));
  EXPECT_FALSE(json.contains("refused_files") || json.contains("status_file_problem"));
  run.refused_files = {"tokens.yaml:3: anna is there twice"};
  run.status_file_problem = "cannot write /home/anna/status";
  json = Json::parse(to_json({{}, run}));
  EXPECT_EQ(json.at("refused_files"),
            Json::parse(R"([{"reason": "tokens.yaml:3: anna is there twice"}])"));
  EXPECT_EQ(json.at("status_file_problem"), "cannot write /home/anna/status");
  json = Json::parse(to_json({{}, run}, Names::kHidden));
  EXPECT_EQ(json.at("refused_files"), Json::parse("[{}]")) << "it names people";
  EXPECT_EQ(json.at("status_file_problem"), "");
  run.needs_restart = {"prefix", "url"};
  EXPECT_EQ(Json::parse(to_json({{}, run})).at("needs_restart"),
            Json::parse(R"(["prefix", "url"])"));
}

TEST(StatusJson, TheLastMinutes) {
  TopicStatus topic;
  topic.lately = {3, 30, {}};
  topic.lately->dropped.add(DropReason::kRate, 2);
  LinkStatus link;
  link.same_graph = link.two_of_a_kind = true;
  link.lately = {std::chrono::milliseconds(1500), 10, 2};
  link.topics = {topic};
  RunStatus run;
  run.lately = {900, 5, 4, 3, 1, 7};
  Status status;
  status.links = {link};
  const auto json = Json::parse(to_json({status, run}));
  EXPECT_EQ(json.at("lately"), Json::parse(R"({"loop_lag_ms": 900.0, "held_up": 5,
    "refused": 4, "wrong_logins": 3, "logins_not_judged": 1, "memory_max_used_bytes": 7})"));
  const Json& shown = json.at("links").at(0);
  EXPECT_EQ(shown.at("lately"),
            Json::parse(R"({"path_queue_ms": 1500.0, "segments": 10, "retransmitted": 2})"));
  EXPECT_EQ(shown.at("same_graph"), true);
  EXPECT_EQ(shown.at("two_of_a_kind"), true);
  EXPECT_EQ(shown.at("topics").at(0).at("lately"),
            Json::parse(R"({"messages": 3, "wire_bytes": 30, "dropped": {"rate": 2}})"));
}

// A field is one row: every view has it by that.
TEST(StatusFields, TheDocumentHasTheTables) {
  EXPECT_THAT(test::source_text("docs/status.md"), testing::HasSubstr(status_tables()))
      << "make them again: ctl status-doc, between the marks";
}

TEST(StatusFields, NamesAreThereOnce) {
  const auto check = [](auto fields) {
    std::set<std::string_view> names;
    for (const auto& field : fields) EXPECT_TRUE(names.insert(field.name).second) << field.name;
  };
  check(side_fields());
  check(link_fields());
  check(topic_fields());
  check(service_fields());
  check(missing_fields());
}

TEST(StatusJson, AClockThatIsNotKnownIsLeftOut) {
  Status status;
  status.links.resize(1);
  EXPECT_FALSE(Json::parse(to_json({status, {}})).at("links").at(0).contains("clock"));
}

TEST(StatusJson, BytesThatAreNoTextDoNotThrow) {
  Status status;
  status.last_failure = {Cause::kOther, "\xff\xfe"};
  EXPECT_EQ(Json::parse(to_json({status, {}})).at("last_failure"), "\xef\xbf\xbd\xef\xbf\xbd");
}

TEST(StatusJson, TheFileIsReplacedInOneStep) {
  const std::filesystem::path folder = test::scratch_folder();
  const std::string file = folder / "status.json";
  EXPECT_EQ(write_atomically(file, "{1}"), "");
  EXPECT_EQ(write_atomically(file, "{2}"), "");
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  EXPECT_EQ(text.str(), "{2}\n");
  EXPECT_FALSE(std::filesystem::exists(file + ".part"));
  using std::filesystem::perms;
  const perms alone = perms::owner_read | perms::owner_write;
  EXPECT_EQ(std::filesystem::status(file).permissions(), alone);
  std::filesystem::permissions(file, alone | perms::group_read);
  EXPECT_EQ(write_atomically(file, "{3}"), "");
  EXPECT_EQ(std::filesystem::status(file).permissions(), alone | perms::group_read);
  if (::geteuid() == 0) {
    // What somebody else has put there decides nothing.
    ASSERT_EQ(::chown(file.c_str(), 65534, 65534), 0);
    EXPECT_EQ(write_atomically(file, "{4}"), "");
    EXPECT_EQ(std::filesystem::status(file).permissions(), alone);
  }
  EXPECT_EQ(write_atomically(folder / "nowhere" / "x", "{}").find("cannot write"), 0U);
  std::filesystem::create_directories(folder / "taken" / "x");
  EXPECT_EQ(write_atomically(folder / "taken", "{}").find("cannot replace"), 0U);
}

TEST(StatusJson, WhatIsNotShownIsSummedUp) {
  LinkStatus link;
  link.further_topics = 2;
  link.further.messages = 3;
  link.further.queued = 1;
  link.further.dropped.add(DropReason::kRate, 4);
  link.further_services = 5;
  Status status;
  status.links = {link};
  const auto json = Json::parse(to_json({status, {}})).at("links").at(0);
  EXPECT_EQ(json.at("further_topics"), Json::parse(R"({"count": 2, "messages": 3, "bytes": 0,
    "wire_bytes": 0, "queued": 1, "dropped": {"rate": 4}})"));
  EXPECT_EQ(json.at("further_services"), Json::parse(R"({"count": 5})"));
}

// A thread writes it: the last one that was given in any case, and a problem is told once.
TEST(StatusFile, TheLastOneIsWrittenAndAProblemToldOnce) {
  const std::filesystem::path folder = test::scratch_folder();
  std::atomic<int> told = 0;
  {
    StatusFile file([&](const std::string&) { ++told; });
    file.write(folder / "nowhere" / "x", std::make_shared<StatusPicture>());
    while (told == 0) std::this_thread::yield();
    for (int i = 0; i < 10; ++i)
      file.write(folder / "nowhere" / "x", std::make_shared<StatusPicture>());
  }
  EXPECT_EQ(told, 1);
  {
    StatusFile file([](const std::string& problem) { ADD_FAILURE() << problem; });
    for (const bool running : {true, true, false}) {
      RunStatus run;
      run.running = running;
      file.write(folder / "status.json", std::make_shared<StatusPicture>(StatusPicture{{}, run}));
    }
  }
  EXPECT_FALSE(Json::parse(std::ifstream(folder / "status.json")).at("running"));
}

// Others may write to the folder.
TEST(StatusFile, ALinkInItsPlaceIsNotFollowed) {
  const std::filesystem::path folder = test::scratch_folder();
  const auto victim = folder / "victim";
  std::ofstream(victim) << "precious";
  std::filesystem::create_symlink(victim, folder / "status.part");
  EXPECT_EQ(write_atomically(folder / "status", "{}"), "");
  std::string text;
  std::ifstream(victim) >> text;
  EXPECT_EQ(text, "precious");
}

// Nobody runs what was told then.
TEST(StatusFile, TheProblemOfTheLastWriteIsReturned) {
  const std::string nowhere = test::scratch_folder() + "missing/status.json";
  StatusFile file([](const std::string&) {});
  file.write(nowhere, std::make_shared<StatusPicture>());
  EXPECT_THAT(file.end(), testing::HasSubstr(nowhere));
  EXPECT_THAT(file.problem(), testing::HasSubstr(nowhere));
  StatusFile other([](const std::string&) {});
  EXPECT_EQ(other.end(), "");
}

}  // namespace
}  // namespace connect_bridge
