// Injected faults, each with the finding that `ctl doctor` has of it.
#include "ops/doctor/diagnosis.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <functional>
#include <regex>
#include <set>

#include "config/document.hpp"
#include "ops/doctor/status_diagnosis.hpp"
#include "unit/config/yaml_parameters.hpp"
#include "unit/source_text.hpp"

namespace connect_bridge {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::UnorderedElementsAre;

std::vector<std::string> ids_of(const std::vector<Found>& found) {
  std::vector<std::string> ids;
  for (const auto& one : found) ids.emplace_back(one.id);
  return ids;
}

TEST(Findings, EachHasAnIdACauseAndACure) {
  std::set<std::string_view> ids;
  for (const Finding& finding : all_findings()) {
    EXPECT_TRUE(ids.insert(finding.id).second) << finding.id;
    EXPECT_FALSE(finding.cause.empty() || finding.cure.empty()) << finding.id;
    EXPECT_EQ(finding_of(finding.id), &finding);
  }
  EXPECT_EQ(finding_of("wombat"), nullptr);
}

TEST(Findings, CuresNameKeysThatExist) {
  const std::regex key("`([a-z_]+[.][a-z_.]+)`");
  const std::string tables = config_tables();
  for (const Finding& finding : all_findings()) {
    const std::string cure(finding.cure);
    for (std::sregex_iterator it(cure.begin(), cure.end(), key), end; it != end; ++it)
      EXPECT_THAT(tables, HasSubstr((*it)[1].str() + "`")) << finding.id;
  }
}

// ---- the link (e2e/test_doctor.py has the real ones)

TEST(DoctorFailure, EveryCauseHasAFinding) {
  for (const auto& [cause, word] : kCauseWords) {
    const Found found = diagnose({cause, "seen"});
    EXPECT_NE(finding_of(found.id), nullptr) << word;
    EXPECT_EQ(found.detail, "seen");
  }
}

TEST(DoctorFailure, CausesHaveWordsOfTheirOwn) {
  std::set<std::string_view> words;
  for (const auto& [cause, word] : kCauseWords) EXPECT_TRUE(words.insert(word).second) << word;
  EXPECT_EQ(word_of(Cause::kRelayUnreachable), "relay_unreachable");
  EXPECT_EQ(word_of(Cause{200}), "other");
}

TEST(DoctorFailure, TheDocumentHasEveryCause) {
  const std::string document = test::source_text("docs/status.md");
  for (const auto& [cause, word] : kCauseWords)
    EXPECT_THAT(document, HasSubstr("`" + std::string(word))) << word;
}

TEST(DoctorFailure, CloseCodesAreCausesOfTheirName) {
  for (std::uint16_t code = 4001; code <= 4016; ++code)
    EXPECT_EQ(word_of(cause_of(CloseCode{code})), name_of(CloseCode{code}));
  EXPECT_EQ(cause_of(CloseCode{1001}), Cause::kGoingAway);
  EXPECT_EQ(cause_of(CloseCode{1011}), Cause::kClosed) << "none of the protocol";
}

// A text that looks like another cause changes nothing.
TEST(DoctorFailure, ATextIsNotRead) {
  EXPECT_EQ(diagnose({Cause::kLoginRefused, "HTTP 404: connection refused"}).id, "login_refused");
  EXPECT_EQ(diagnose({Cause::kOther, "certificate has expired"}).id, "link_fails");
}

// ---- a file

struct FileCase {
  const char* id;
  Role role;
  const char* yaml;
};

class DoctorFile : public testing::TestWithParam<FileCase> {};

TEST_P(DoctorFile, IsRecognised) {
  const Parsed parsed = parse_config(yaml(GetParam().yaml), GetParam().role, {});
  std::vector<std::string> ids;
  for (const auto& problem : parsed.problems) ids.emplace_back(diagnose(failure_of(problem)).id);
  EXPECT_THAT(ids, Contains(GetParam().id));
}

INSTANTIATE_TEST_SUITE_P(
    All, DoctorFile,
    testing::Values(FileCase{"key_unknown", Role::kServer, "listen: {prot: 1}"},
                    FileCase{"url_wrong", Role::kClient, "url: 'http://robot'"},
                    FileCase{"prefix_wrong", Role::kServer, "prefix: '/a b'"},
                    FileCase{"rule_wrong", Role::kServer,
                             "{rules: [a], rule: {a: {import_topics: ['not a name']}}}"},
                    FileCase{"file_wrong", Role::kServer, "dead_after: 0"},
                    FileCase{"certificate_files", Role::kServer, "tls: {certificate: a}"},
                    FileCase{"token_missing", Role::kClient,
                             "{url: 'ws://h', auth: {method: token}}"}));

// Why a file cannot be used is found where it is looked at.
TEST(DoctorFile, WhatIsWrongWithAFileIsKept) {
  Surroundings around;
  around.unreadable = [](const std::string& file) {
    if (file == "/none") return Failure{Cause::kFileMissing, "/none is missing"};
    if (file == "/theirs") return Failure{Cause::kFileNotPermitted, "it belongs to ben"};
    return Failure{};
  };
  around.distrusted = [](const std::string& file) {
    return std::string(file == "/open" ? "every user may change it" : "");
  };
  const auto finding = [&](const std::string& file) {
    const Parsed parsed = parse_config(
        yaml("{url: 'ws://127.0.0.1', auth: {method: token, token_file: " + file + "}}"),
        Role::kClient, around);
    return parsed.problems.size() == 1 ? diagnose(failure_of(parsed.problems[0])).id : "several";
  };
  EXPECT_EQ(finding("/none"), "file_missing");
  EXPECT_EQ(finding("/theirs"), "file_not_permitted") << "another token would not help";
  EXPECT_EQ(finding("/open"), "file_distrusted");
}

TEST(DoctorFile, AnotherUsersListenerMayBeThisServer) {
  const auto id = [](Cause cause, std::optional<std::uint32_t> listener) {
    return diagnose_port({cause, "127.0.0.1:9090: it"}, listener, 1000).id;
  };
  EXPECT_EQ(id(Cause::kPortTaken, 0), "port_hidden");
  EXPECT_EQ(id(Cause::kPortNotPermitted, 0), "port_hidden");
  EXPECT_EQ(id(Cause::kPortTaken, 1000), "port_taken") << "this user's";
  EXPECT_EQ(id(Cause::kPortTaken, std::nullopt), "port_taken");
  EXPECT_EQ(id(Cause::kAddressNotHere, 0), "address_not_here");
}

TEST(DoctorConfig, ARobotWithoutRulesAllowsNothing) {
  const auto found = [](const std::string& rules) {
    return ids_of(
        diagnose_config(config_of(yaml("{auth: {method: none}" + rules + "}"), Role::kServer)));
  };
  EXPECT_THAT(found(""), ElementsAre("rule_allows_nothing"));
  EXPECT_THAT(found(", rules: [a], rule: {a: {deny: [/x]}}"), ElementsAre("rule_allows_nothing"));
  EXPECT_THAT(found(", rules: [a], rule: {a: {export_topics: [/x]}}"), IsEmpty());
}

TEST(DoctorConfig, ARuleThatKeepsLatchedTopicsFromLateSubscribers) {
  const Config config = config_of(
      yaml("{auth: {method: none}, rules: [a], rule: {a: {export_topics: [/map], max_age: 1.0}}}"),
      Role::kServer);
  EXPECT_THAT(ids_of(diagnose_config(config)), ElementsAre("max_age_and_latched"));
}

TEST(DoctorConfig, ARuleBehindOneThatAllowsAll) {
  const auto found = [](const std::string& rules) {
    return ids_of(diagnose_config(config_of(
        yaml("{auth: {method: none}, rules: [all, cam], rule: " + rules + "}"), Role::kServer)));
  };
  EXPECT_THAT(
      found("{all: {export_topics: [/**]}, cam: {export_topics: [/c/a, /b/**], max_rate: 2.0}}"),
      ElementsAre("rule_hidden"));
  EXPECT_THAT(
      found("{all: {export_topics: [/c/*]}, cam: {export_topics: [/c/a, /b], max_rate: 2.0}}"),
      IsEmpty());
  EXPECT_THAT(found("{all: {export_topics: [/**]}, cam: {import_topics: [/c], max_rate: 2.0}}"),
              IsEmpty());
  EXPECT_THAT(
      found("{all: {export_topics: [/**]}, cam: {export_topics: [/_hidden], max_rate: 2.0}}"),
      IsEmpty());
}

TEST(DoctorConfig, AHaltThatNothingHears) {
  const auto found = [](const std::string& types) {
    return ids_of(diagnose_config(config_of(
        yaml("{auth: {method: none}, rules: [a], rule: {a: {import_topics: [/joy], types: [" +
             types + "], halt_after: 0.5}}}"),
        Role::kServer)));
  };
  EXPECT_THAT(found("sensor_msgs/msg/Joy"), ElementsAre("halts_nothing"));
  EXPECT_THAT(found("geometry_msgs/msg/Twist"), IsEmpty());
}

// ---- a running side

Json status_of(const std::string& text) {
  Json status = Json::parse(R"({"schema": 1, "time": "2026-01-31T12:00:00.000Z",
    "started": "2026-01-31T11:00:00.000Z", "role": "server", "loop_lag_ms": 1,
    "memory_max_used_bytes": 1, "memory_max_bytes": 100, "strangers": {"wrong_logins": 0},
    "links": []})");
  status.merge_patch(Json::parse(text));
  return status;
}
// A link that is well, with this in it.
std::string link_with(const std::string& text) {
  Json link = Json::parse(R"({"link": 1, "node": "/peer", "open": true, "open_seconds": 60,
    "connects": 1, "path_queue_ms": 1, "rate_bytes_per_second": 1000, "missing": [],
    "topics": [{"topic": "/well", "direction": "export", "demanded": true, "origins": 1,
                "messages": 100, "queued": 0, "dropped": {}}], "services": []})");
  link.merge_patch(Json::parse(text));
  return R"({"links": [)" + link.dump() + "]}";
}
std::string topic_with(const std::string& text) {
  Json topic = Json::parse(R"({"topic": "/t", "direction": "export", "demanded": true,
    "origins": 1, "messages": 100, "queued": 0, "dropped": {}})");
  topic.merge_patch(Json::parse(text));
  return link_with(R"({"topics": [)" + topic.dump() + "]}");
}
std::string missing_for(const std::string& reason, const std::string& text = "",
                        const std::string& code = "") {
  return link_with(R"({"missing": [{"kind": "topic", "name": "/t", "type": "p/msg/T",
    "direction": "import", "reason": ")" +
                   reason + R"(", "text": ")" + text + R"(", "code": ")" + code + R"("}]})");
}

// Three breaks within ten minutes, and one of yesterday.
std::string broken(const std::string& code, double seconds, bool is_regular = false) {
  Json link = {{"breaks", Json::array({{{"lost", "2026-01-30T11:00:00Z"}, {"code", code}}})}};
  for (const std::string lost : {"11:52:00", is_regular ? "11:55:30" : "11:56:00", "11:59:00"})
    link["breaks"].push_back({{"lost", "2026-01-31T" + lost + "Z"},
                              {"back", "2026-01-31T" + lost + ".2Z"},
                              {"code", code},
                              {"seconds", seconds},
                              {"reason", "it"}});
  return link_with(link.dump());
}
std::string service_with(const std::string& text) {
  Json service = Json::parse(R"({"service": "/s", "direction": "import", "answered": 0})");
  service.merge_patch(Json::parse(text));
  return link_with(R"({"services": [)" + service.dump() + "]}");
}
// While a client is linked by another way.
std::string relay_fails(const std::string& code) {
  Json status = Json::parse(link_with("{}"));
  status["relays"] = {
      {{"relay", "wss://r@relay"}, {"connected", false}, {"last_failure_code", code}}};
  return status.dump();
}

std::string at_operator(const std::string& text) {
  Json status = Json::parse(text);
  status["is_robot"] = false;
  return status.dump();
}
// Its camera's pictures wait, and hardly any bytes get through.
std::string crawling(const std::string& text) {
  Json status = Json::parse(text);
  status["links"][0]["topics"].push_back({{"topic", "/camera"},
                                          {"direction", "export"},
                                          {"demanded", true},
                                          {"messages", 5},
                                          {"wire_bytes", 500'000}});
  return status.dump();
}
// At an operator: the other one's node has this name.
std::string two_robots(const std::string& node) {
  Json status = Json::parse(at_operator(link_with(R"({"node": "/robot7", "identity": "r7"})")));
  status["links"].push_back(status["links"][0]);
  status["links"][1]["node"] = node;
  return status.dump();
}

struct StatusCase {
  const char* id;
  std::string status;
};

class DoctorStatus : public testing::TestWithParam<StatusCase> {};

TEST_P(DoctorStatus, IsRecognised) {
  const auto found = diagnose_status(status_of(GetParam().status));
  EXPECT_THAT(ids_of(found), Contains(GetParam().id));
  for (const auto& one : found) EXPECT_NE(finding_of(one.id), nullptr) << one.id;
}

INSTANTIATE_TEST_SUITE_P(
    All, DoctorStatus,
    testing::Values(
        StatusCase{"not_linked", R"({"role": "client"})"},
        StatusCase{"port_closed", R"({"role": "client", "last_failure": "it",
                                       "last_failure_code": "port_closed"})"},
        StatusCase{"link_fails",
                   R"({"role": "client", "last_failure_code": "of_a_later_version"})"},
        StatusCase{"nobody_linked", "{}"},
        StatusCase{"nobody_linked", R"({"listens": ["127.0.0.1:9090", "10.0.0.5:9090"]})"},
        StatusCase{"loopback_alone", R"({"listens": ["127.0.0.1:9090", "[::1]:9090"]})"},
        StatusCase{"nobody_linked", R"({"listens": ["127.0.0.1:9090"],
                                       "relays": [{"connected": true}]})"},
        StatusCase{"relay_unreachable", R"({"relays": [{"connected": false, "last_failure": "it",
                                           "last_failure_code": "relay_unreachable"}]})"},
        StatusCase{"relay_refuses", R"({"relays": [{"connected": false,
                                       "last_failure_code": "relay_refuses"}]})"},
        StatusCase{"clients_refused", R"({"listens": ["127.0.0.1:9090"], "lately": {"refused": 1},
                                         "strangers": {"last_refused": "10.0.0.7: HTTP 426"}})"},
        StatusCase{"loopback_alone", R"({"listens": ["127.0.0.1:9090"], "lately": {"refused": 1},
                                        "strangers": {"last_refused": "127.0.0.1: HTTP 426"}})"},
        StatusCase{"nobody_linked", R"({"listens": ["10.0.0.5:9090"], "lately": {"refused": 0},
                                       "strangers": {"last_refused": "10.0.0.7: HTTP 426"}})"},
        StatusCase{"nobody_linked", R"({"listens": ["127.0.0.1:9090"],
                                       "links": [{"breaks":
                                         [{"lost": "2026-01-31T11:00:00Z"}]}]})"},
        StatusCase{"wrong_logins", R"({"strangers": {"wrong_logins": 3}})"},
        StatusCase{"proxy_header_unexpected", R"({"strangers": {"proxy_headers": 1}})"},
        StatusCase{"loop_slow", R"({"loop_lag_ms": 700})"},
        StatusCase{"memory_full", R"({"memory_max_used_bytes": 95})"},
        StatusCase{"audit_fails", R"({"audit": {"problem": "disk full"}})"},
        StatusCase{"certificate_expired",
                   R"({"certificate_valid_until": "2026-01-31T11:59:00.000Z"})"},
        StatusCase{"certificate_ends_soon",
                   R"({"certificate_valid_until": "2026-02-03T00:00:00.000Z"})"},
        StatusCase{"no_rule", at_operator(missing_for("no_rule"))},
        StatusCase{"other_peer", at_operator(missing_for("other_peer"))},
        StatusCase{"denied", at_operator(missing_for("denied"))},
        StatusCase{"rule_type", missing_for("rule_type")},
        StatusCase{"not_taken", missing_for("not_taken")},
        StatusCase{"not_given", missing_for("not_given")},
        StatusCase{"other_type", missing_for("other_type")},
        StatusCase{"not_there", at_operator(missing_for("not_there"))},
        StatusCase{"outside_prefix", missing_for("outside_prefix")},
        StatusCase{"type_not_installed", missing_for("type_unknown")},
        StatusCase{"type_not_installed",
                   missing_for("declined", "no matter what it says", "type_unknown")},
        StatusCase{"definitions_differ", missing_for("declined", "it", "type_mismatch")},
        StatusCase{"declined", missing_for("declined", "it", "not_permitted")},
        StatusCase{"declined", missing_for("declined", "install a type", "limit")},
        StatusCase{"qos", missing_for("qos")},
        StatusCase{"lost_in_middleware", missing_for("lost")},
        StatusCase{"nothing_arrives", topic_with(R"({"messages": 0})")},
        StatusCase{"no_listener", topic_with(R"({"demanded": false, "messages": 0})")},
        StatusCase{"drops_rate", topic_with(R"({"dropped": {"rate": 5000}})")},
        StatusCase{"stamps_old", topic_with(R"({"messages": 0, "dropped": {"max_age": 50}})")},
        StatusCase{"drops_max_age", topic_with(R"({"dropped": {"max_age": 50}})")},
        StatusCase{"publisher_ahead", topic_with(R"({"ahead_ms": 5000})")},
        StatusCase{"drops_too_large", topic_with(R"({"dropped": {"too_large": 50}})")},
        StatusCase{"drops_memory", topic_with(R"({"dropped": {"memory": 50}})")},
        StatusCase{"link_too_thin", topic_with(R"({"dropped": {"newer_available": 50}})")},
        StatusCase{"path_full", link_with(R"({"path_queue_ms": 2000})")},
        StatusCase{"link_breaks", broken("silent", 5)},
        StatusCase{"link_breaks", broken("silent", 0.2)},
        StatusCase{"link_breaks", broken("address_gone", 0.1)},
        StatusCase{"connections_ended", broken("connection_lost", 0.1)},
        StatusCase{"connections_forgotten", broken("silent", 0.2, true)},
        StatusCase{"large_packets_vanish", crawling(broken("silent", 0.2, true))},
        StatusCase{"large_packets_vanish", crawling(broken("replaced", 0.2))},
        StatusCase{"another_drives", topic_with(R"({"wheel": "taken"})")},
        StatusCase{"another_drives", topic_with(R"({"direction": "import",
                                        "dropped": {"wheel": 50}})")},
        StatusCase{"let_go_first", topic_with(R"({"wheel": "halted"})")},
        StatusCase{"calls_refused", service_with(R"({"calls": 4, "refused": 4})")},
        StatusCase{"identity_twice", two_robots("/robot7")},
        StatusCase{"one_graph", link_with(R"({"same_graph": true})")},
        StatusCase{"robot_word", link_with(R"({"two_of_a_kind": true})")},
        StatusCase{"clocks_apart",
                   link_with(R"({"clock": {"offset_ms": 250, "error_bound_ms": 5}})")},
        StatusCase{"path_loses",
                   link_with(R"({"lately": {"segments": 500, "retransmitted": 60}})")},
        StatusCase{"service_silent", service_with(R"({"calls": 4, "timed_out": 4})")},
        StatusCase{"calls_wait", service_with(R"({"pending": 1, "oldest_seconds": 10})")},
        StatusCase{"parameters_refused",
                   R"({"refused_parameters": {"time": "12:00", "problem": "it"}})"},
        StatusCase{"file_refused", R"({"refused_files": [{"reason": "tokens.yaml:3: it"}]})"},
        StatusCase{"file_unwritable", R"({"status_file_problem": "it"})"},
        StatusCase{"certificate_expired", R"({"role": "relay",
                       "certificate_valid_until": "2026-01-31T11:59:00.000Z"})"},
        StatusCase{"certificate_ends_soon", R"({"role": "relay",
                       "certificate_valid_until": "2026-02-03T00:00:00.000Z"})"},
        StatusCase{"needs_restart", R"({"needs_restart": ["prefix"]})"},
        StatusCase{"loop_slow", R"({"lately": {"loop_lag_ms": 900, "held_up": 5}})"},
        StatusCase{"memory_full", R"({"lately": {"memory_max_used_bytes": 95}})"},
        StatusCase{"path_full", link_with(R"({"lately": {"path_queue_ms": 2000}})")},
        StatusCase{"relay_unreachable", relay_fails("host_unknown")},
        StatusCase{"relay_certificate", relay_fails("other_key")},
        StatusCase{"relay_is_none", relay_fails("not_this_program")},
        StatusCase{"relay_token_missing", relay_fails("token_missing")},
        StatusCase{"relay_fails", relay_fails("malformed")},
        StatusCase{"robots_with_one_token", relay_fails("robots_with_one_token")},
        StatusCase{"no_robot_here", R"({"role": "relay", "robots": [{"robot": "a"}]})"},
        StatusCase{"nothing_here", link_with(R"({"topics": []})")}));

TEST(DoctorStatus, ASideThatIsWellHasNoFinding) {
  EXPECT_THAT(ids_of(diagnose_status(status_of(link_with("{}")))), IsEmpty());
  EXPECT_EQ(report_text({}),
            "nothing is wrong, as far as can be seen from here; the other end may see more\n");
  EXPECT_FALSE(has_fault({}));
}

TEST(DoctorStatus, AServiceThatAnswersLatelyIsNotSilent) {
  const auto found = [](const char* lately) {
    return ids_of(diagnose_status(status_of(service_with(
        R"({"calls": 9, "answered": 5, "timed_out": 4, "lately": )" + std::string(lately) + "}"))));
  };
  EXPECT_THAT(found(R"({"answered": 0, "timed_out": 1})"), Contains("service_silent"));
  EXPECT_THAT(found(R"({"answered": 0, "timed_out": 0})"), Not(Contains("service_silent")));
  EXPECT_THAT(found(R"({"answered": 2, "timed_out": 1})"), Not(Contains("service_silent")));
}

// One long time is no busy moment of the machine.
TEST(DoctorStatus, ALoopThatStoodForSecondsIsSaidAtOnce) {
  const auto found =
      diagnose_status(status_of(R"({"lately": {"loop_lag_ms": 20200, "held_up": 1}})"));
  EXPECT_THAT(ids_of(found), Contains("loop_slow"));
  EXPECT_THAT(report_text(found), HasSubstr("seen: for 20200 ms"));
}

// Links of one program that was killed, and the one that it has now.
Json killed(int times) {
  Json status = status_of(link_with(R"({"link": 9, "identity": "anna", "peer": "10.0.0.7:4009"})"));
  for (int i = 1; i <= times; ++i) {
    Json lost = status["links"][0];
    lost["link"] = i;
    lost["open"] = false;
    lost["peer"] = "10.0.0.7:400" + std::to_string(i);
    lost["breaks"] = {{{"lost", "2026-01-31T11:59:0" + std::to_string(i) + "Z"},
                       {"reason", "it ended"},
                       {"code", "connection_lost"}}};
    status["links"].push_back(lost);
  }
  return status;
}

TEST(DoctorStatus, AProgramThatIsKilledAgainAndAgain) {
  const auto found = diagnose_status(killed(3));
  ASSERT_THAT(ids_of(found), ElementsAre("program_restarts"));
  EXPECT_EQ(found[0].subject, "anna /peer");
  EXPECT_THAT(found[0].detail, HasSubstr("3 of its links were lost in 10 min, the last: it ended"));
  EXPECT_THAT(ids_of(diagnose_status(killed(2))), IsEmpty()) << "now and then";
}

TEST(DoctorStatus, OperatorsWhoGoAwayAreNoRestarts) {
  const auto found_if = [](const std::function<void(Json & links)>& change) {
    Json status = killed(3);
    change(status["links"]);
    return ids_of(diagnose_status(status));
  };
  EXPECT_THAT(found_if([](Json& links) { links.erase(0); }), Not(Contains("program_restarts")))
      << "none is back";
  EXPECT_THAT(found_if([](Json& links) { links[0]["link"] = 0; }), IsEmpty())
      << "who stays was there before";
  EXPECT_THAT(found_if([](Json& links) { links[1]["identity"] = "ben"; }), IsEmpty());
  EXPECT_THAT(found_if([](Json& links) { links[1]["peer"] = "10.0.0.8:1"; }), IsEmpty());
  EXPECT_THAT(found_if([](Json& links) { links[1]["breaks"][0]["code"] = "going_away"; }),
              IsEmpty());
  EXPECT_THAT(found_if([](Json& links) { links[1]["breaks"][0]["lost"] = "2026-01-31T11:40:00Z"; }),
              IsEmpty());
}

TEST(DoctorStatus, ALoopThatWasHeldUpOnceIsNotSlow) {
  EXPECT_THAT(
      ids_of(diagnose_status(status_of(R"({"lately": {"loop_lag_ms": 900, "held_up": 2}})"))),
      Not(Contains("loop_slow")));
}

// A rule that keeps names here, and a topic on which nothing happens, are as they are to be.
TEST(DoctorStatus, WhatMayBeMeantIsNoFault) {
  for (const char* reason : {"no_rule", "denied", "other_peer", "not_there"})
    EXPECT_FALSE(has_fault(diagnose_status(status_of(missing_for(reason))))) << reason;
  EXPECT_FALSE(has_fault(diagnose_status(status_of(topic_with(R"({"messages": 0})")))));
}

// Its socket is in the same folder.
TEST(DoctorStatus, ARelayIsNoServer) {
  EXPECT_THAT(diagnose_status(status_of(R"({"role": "relay", "robots": []})")), IsEmpty());
}

TEST(DoctorStatus, ARelayKnowsARobotWhoseTokenASecondMachineHas) {
  const auto robots = [](bool in_use) {
    return ids_of(
        diagnose_status({{"role", "relay"},
                         {"robots",
                          {{{"robot", "robot6"}, {"open", true}, {"token_in_use", false}},
                           {{"robot", "robot7"}, {"open", true}, {"token_in_use", in_use}}}}}));
  };
  EXPECT_THAT(robots(true), ElementsAre("robots_with_one_token"));
  EXPECT_THAT(robots(false), IsEmpty());
}

// The keys of a server are not those of a client, and a failure is one also while others are
// linked.
TEST(DoctorStatus, AServersRelayHasItsOwnCures) {
  for (const auto& [cause, word] : kCauseWords) {
    if (cause == Cause::kNone) continue;
    const auto found = diagnose_status(status_of(relay_fails(std::string(word))));
    ASSERT_EQ(found.size(), 1U) << word;
    const std::string cure(finding_of(found[0].id)->cure);
    EXPECT_THAT(cure, testing::AnyOf(HasSubstr("relay"))) << word;
    EXPECT_TRUE(cure.find("`tls.") == std::string::npos) << cure;
  }
}

// ---- healthy setups have nothing to say

// Of a robot: topics that no rule names, one that the peer's rules do not take, one that nobody
// looks at, one that is slowed down on purpose.
TEST(DoctorStatus, AHealthyRobotHasNoFinding) {
  Json status = status_of(link_with(R"({"missing": [
    {"name": "/odom", "direction": "export", "reason": "no_rule", "waits": "sender"},
    {"name": "/joint_states", "direction": "export", "reason": "not_taken", "waits": "sender"},
    {"name": "/secret", "direction": "export", "reason": "denied", "waits": "nobody"}]})"));
  status["is_robot"] = true;
  Json& topics = status["links"][0]["topics"];
  for (const char* more : {R"({"topic": "/map", "direction": "export", "demanded": false})",
                           R"({"topic": "/e_stop", "direction": "export", "demanded": true,
                               "origins": 1, "messages": 0})",
                           R"({"topic": "/image", "direction": "export", "demanded": true,
                               "messages": 50, "dropped": {"rate": 250}})"})
    topics.push_back(Json::parse(more));
  EXPECT_THAT(ids_of(diagnose_status(status)), IsEmpty());
}

// RViz has tools that publish, and nobody uses them.
TEST(DoctorStatus, AnOperatorWhoOnlyLooksHasNoFinding) {
  Json status = status_of(R"({"role": "client", "is_robot": false, "links": [{"link": 1,
    "open": true, "open_seconds": 60, "connects": 1,
    "topics": [{"topic": "/scan", "direction": "import", "demanded": true, "messages": 9}],
    "missing": [{"name": "/goal_pose", "direction": "export", "reason": "not_taken",
                 "waits": "nobody"}]}]})");
  EXPECT_THAT(ids_of(diagnose_status(status)), IsEmpty());
  Json& tool = status["links"][0]["missing"][0];
  tool["waits"] = "sender";
  EXPECT_THAT(ids_of(diagnose_status(status)), ElementsAre("not_taken")) << "of teleop";
}

// ---- the other end

// Somebody here waits for what only the other end can see.
TEST(DoctorStatus, FindingsOfThePeerAreTold) {
  const auto found = diagnose_status(status_of(link_with(R"({"peer_findings": [
    {"id": "stamps_old", "name": "/cmd_vel"}, {"id": "path_full", "name": ""},
    {"id": "login_refused", "name": ""}, {"id": "no finding", "name": "/x"}]})")));
  ASSERT_THAT(ids_of(found), UnorderedElementsAre("stamps_old", "path_full"));
  EXPECT_EQ(found[0].program, "the other end of link 1 to /peer");
  EXPECT_EQ(found[0].subject, "/cmd_vel");
  EXPECT_TRUE(found[0].waits);
  EXPECT_FALSE(has_fault(found)) << "a peer's word is no reason for an exit code";
}

// The importer's own word; and what it declines may be what nobody there wants.
TEST(DoctorStatus, ADeclineOfThisSideIsAHint) {
  const auto found = [](const char* waits, const char* code) {
    return diagnose_status(status_of(link_with(
        std::string(R"({"missing": [{"name": "/t", "direction": "import", "reason": "declined",
          "code": ")") +
        code + R"(", "waits": ")" + waits + "\"}]}")));
  };
  EXPECT_THAT(ids_of(found("nobody", "not_permitted")), ElementsAre("declined"));
  EXPECT_FALSE(has_fault(found("nobody", "type_unknown")));
  EXPECT_TRUE(has_fault(found("here", "type_unknown")));
}

std::string for_peer(const std::string& text) {
  std::string told;
  for (const auto& [link, findings] : findings_for_peers(status_of(text), {}))
    for (const PeerFinding& finding : findings)
      told += std::to_string(link.value) + " " + finding.id + " " + finding.name + "\n";
  return told;
}

TEST(DoctorStatus, APeerIsToldWhatConcernsIt) {
  EXPECT_EQ(for_peer(topic_with(R"({"dropped": {"max_age": 50}})")), "1 drops_max_age /t\n");
  EXPECT_EQ(for_peer(link_with(R"({"lately": {"segments": 1000, "retransmitted": 500}})")),
            "1 path_loses \n");
  EXPECT_EQ(for_peer(link_with("{}")), "");
  EXPECT_EQ(for_peer(link_with(R"({"open": false, "path_queue_ms": 5000})")), "");
}

// Names that no rule allows, files and logins are this side's own; and nobody is told what it said.
TEST(DoctorStatus, APeerIsNotToldOfOtherNames) {
  for (const char* reason : {"no_rule", "denied", "other_peer", "not_given", "not_taken"})
    EXPECT_EQ(for_peer(missing_for(reason)), "") << reason;
  EXPECT_EQ(for_peer(link_with(R"({"peer_findings": [{"id": "stamps_old", "name": "/a"}]})")), "");
  EXPECT_EQ(for_peer(R"({"audit": {"problem": "disk full"}, "lately": {"wrong_logins": 3}})"), "");
}

TEST(DoctorStatus, APublisherAtBothEndsIsNamed) {
  constexpr char kTwo[] = R"({"direction": "import", "also_from": "/nav"})";
  const auto found = diagnose_status(status_of(topic_with(kTwo)));
  ASSERT_THAT(ids_of(found), ElementsAre("published_here_too"));
  EXPECT_EQ(found[0].detail, "/nav");
  Json shared = status_of(topic_with(kTwo));
  shared["links"][0]["topics"][0]["topic"] = "/tf";
  EXPECT_THAT(ids_of(diagnose_status(shared)), IsEmpty());
  EXPECT_THAT(ids_of(diagnose_status(status_of(service_with(R"({"also_here": true})")))),
              ElementsAre("served_here_too"));
}

// ---- rules explain what their topics lack

std::vector<std::string> ids_by_rule(const RuleFacts& rule, const std::string& topic,
                                     const std::string& link = "{}") {
  SideFacts facts;
  facts.rules["r"] = rule;
  Json status = status_of(topic_with(topic));
  status["links"][0].merge_patch(Json::parse(link));
  status["links"][0]["topics"][0]["rule"] = "r";
  return ids_of(diagnose_status(status, facts));
}

TEST(DoctorStatus, APathThatTakesLongerThanTheAge) {
  RuleFacts rule;
  rule.max_age = 0.1;
  constexpr char kOld[] = R"({"messages": 0, "dropped": {"max_age": 50}})";
  EXPECT_THAT(ids_by_rule(rule, kOld, R"({"clock": {"round_trip_ms": 600}})"),
              ElementsAre("path_too_long"));
  EXPECT_THAT(ids_by_rule(rule, kOld, R"({"clock": {"round_trip_ms": 20}})"),
              ElementsAre("stamps_old"));
  EXPECT_THAT(ids_by_rule({}, kOld, R"({"clock": {"round_trip_ms": 600}})"),
              ElementsAre("stamps_old"));
}

TEST(DoctorStatus, ALimitOfBytesIsNoRateOnPurpose) {
  RuleFacts rule;
  constexpr char kLess[] = R"({"messages": 36, "dropped": {"rate": 121}})";
  EXPECT_THAT(ids_by_rule(rule, kLess), IsEmpty());
  rule.limits_bytes = true;
  EXPECT_THAT(ids_by_rule(rule, kLess), ElementsAre("drops_rate"));
}

// It has crossed the link, and a node here subscribes.
TEST(DoctorStatus, ARateOfAnImportsOwnRuleDropsMost) {
  EXPECT_THAT(ids_by_rule({}, R"({"direction": "import", "messages": 8, "dropped": {"rate": 92}})"),
              ElementsAre("drops_rate"));
  EXPECT_THAT(
      ids_by_rule({}, R"({"direction": "import", "messages": 60, "dropped": {"rate": 40}})"),
      IsEmpty());
  EXPECT_THAT(ids_by_rule({}, R"({"messages": 8, "dropped": {"rate": 92}})"), IsEmpty());
}

TEST(DoctorStatus, AnUrgentTopicFillsAThinLink) {
  RuleFacts rule;
  rule.urgent = true;
  constexpr char kHeavy[] = R"({"wire_bytes": 9000, "dropped": {"newer_available": 900}})";
  EXPECT_THAT(ids_by_rule(rule, kHeavy), ElementsAre("urgent_is_heavy"));
  EXPECT_THAT(ids_by_rule({}, kHeavy), ElementsAre("link_too_thin"));
}

TEST(DoctorStatus, ATypeThatCannotBeHalted) {
  RuleFacts rule;
  rule.halts = true;
  EXPECT_THAT(ids_by_rule(rule, R"({"direction": "import", "type": "sensor_msgs/msg/Joy"})"),
              ElementsAre("halts_nothing"));
  EXPECT_THAT(ids_by_rule(rule, R"({"direction": "import", "type": "geometry_msgs/msg/Twist"})"),
              IsEmpty());
  EXPECT_THAT(
      ids_by_rule(
          rule, R"({"direction": "import", "type": "geometry_msgs/msg/Pose"})",
          R"({"topics": [{"topic": "/goal", "direction": "import", "rule": "r", "demanded": true,
                              "type": "geometry_msgs/msg/Pose"},
                             {"topic": "/cmd_vel", "direction": "import", "rule": "r",
                              "type": "geometry_msgs/msg/Twist"}]})"),
      IsEmpty())
      << "the rule halts another topic";
}

// One of an operator's two publishers holds the wheel; another operator's would be another peer's.
TEST(DoctorStatus, TwoPublishersOfOneDriver) {
  const auto dropped = [](const char* wheel, int origins) {
    Json topic = {{"direction", "import"}, {"origins", origins}, {"wheel", wheel}};
    topic["dropped"] = {{"wheel", 300}};
    return ids_of(diagnose_status(status_of(topic_with(topic.dump()))));
  };
  EXPECT_THAT(dropped("yours", 2), ElementsAre("two_of_one_driver"));
  EXPECT_THAT(dropped("yours", 1), IsEmpty());
  EXPECT_THAT(dropped("taken", 2), ElementsAre("another_drives"));
  EXPECT_THAT(dropped("halted", 1), ElementsAre("let_go_first"));
}

TEST(DoctorStatus, ServersThatEndOrAreSeveral) {
  const auto found = [](const char* text) {
    return ids_of(diagnose_status(status_of(service_with(text))));
  };
  EXPECT_THAT(found(R"({"direction": "export", "lost": 10})"), ElementsAre("server_ends"));
  EXPECT_THAT(found(R"({"direction": "export", "lost": 10, "answered": 5})"), IsEmpty());
  EXPECT_THAT(found(R"({"direction": "export", "lost": 10, "answered": 5,
                        "lately": {"lost": 3, "answered": 0}})"),
              ElementsAre("server_ends"))
      << "what was answered yesterday counts no longer";
  EXPECT_THAT(found(R"({"direction": "export", "lost": 10, "lately": {"lost": 0}})"), IsEmpty());
  EXPECT_THAT(found(R"({"direction": "export", "several_here": true})"),
              ElementsAre("several_servers"));
}

TEST(DoctorStatus, ASensorWhoseNodeLivesStopsPublishing) {
  const auto found = [](const char* type, double idle, double rate, const char* more = "{}") {
    Json topic = Json::parse(more);
    topic["type"] = type;
    topic["idle_seconds"] = idle;
    topic["usual_rate"] = rate;
    return ids_of(diagnose_status(status_of(topic_with(topic.dump()))));
  };
  for (const char* type : {"sensor_msgs/msg/LaserScan", "nav_msgs/msg/Odometry"})
    EXPECT_THAT(found(type, 12, 10), ElementsAre("publisher_stops"));
  EXPECT_THAT(found("sensor_msgs/msg/LaserScan", 2, 10), IsEmpty());
  EXPECT_THAT(found("sensor_msgs/msg/BatteryState", 12, 0.2), IsEmpty()) << "it is seldom";
  EXPECT_THAT(found("geometry_msgs/msg/Twist", 12, 20), IsEmpty()) << "nobody drives";
  EXPECT_THAT(found("sensor_msgs/msg/Joy", 12, 20), IsEmpty());
  EXPECT_THAT(found("nav_msgs/msg/OccupancyGrid", 3600, 0), IsEmpty()) << "a map";
  EXPECT_THAT(found("sensor_msgs/msg/LaserScan", 12, 10, R"({"origins": 0})"), IsEmpty());
  EXPECT_THAT(found("sensor_msgs/msg/LaserScan", 12, 10, R"({"direction": "import"})"), IsEmpty())
      << "the exporter sees it, and tells this side";
}

// Shared memory of 512 kB has room for many small messages.
TEST(DoctorStatus, SmallMessagesAreNotLostForLackOfSharedMemory) {
  const auto found = [](const char* topic) {
    Json status = status_of(topic_with(topic));
    status["links"][0]["missing"] = status_of(missing_for("lost"))["links"][0]["missing"];
    status["links"][0]["missing"][0]["direction"] = "export";
    return ids_of(diagnose_status(status));
  };
  EXPECT_THAT(found(R"({"messages": 100, "bytes": 1600})"), ElementsAre("lost_in_bursts"));
  EXPECT_THAT(found(R"({"messages": 10, "bytes": 9000000})"), ElementsAre("lost_in_middleware"));
}

TEST(DoctorStatus, CallsThatAreRefusedNowOrWereYesterday) {
  const auto found = [](const char* text) {
    return ids_of(diagnose_status(status_of(service_with(text))));
  };
  EXPECT_THAT(found(R"({"refused": 9, "answered": 50, "lately": {"refused": 2, "answered": 0}})"),
              ElementsAre("calls_refused"));
  EXPECT_THAT(found(R"({"refused": 9, "lately": {"refused": 0, "answered": 0}})"), IsEmpty());
}

// By default no call times out, and a result comes when the goal ends.
TEST(DoctorStatus, ACallThatWaitsWhateverWasAnsweredBefore) {
  const auto found = [](const char* text) {
    return ids_of(diagnose_status(status_of(service_with(text))));
  };
  EXPECT_THAT(found(R"({"answered": 7, "pending": 1, "oldest_seconds": 14})"),
              ElementsAre("calls_wait"));
  EXPECT_THAT(found(R"({"answered": 7, "pending": 1, "oldest_seconds": 2})"), IsEmpty());
  EXPECT_THAT(found(R"({"service": "/a/_action/send_goal", "pending": 1, "oldest_seconds": 14})"),
              ElementsAre("calls_wait"));
  EXPECT_THAT(found(R"({"service": "/a/_action/get_result", "pending": 1, "oldest_seconds": 14})"),
              IsEmpty());
}

TEST(DoctorStatus, APathThatAnswersLate) {
  const auto found = [](const char* clock) {
    return ids_of(diagnose_status(status_of(link_with(clock))));
  };
  EXPECT_THAT(found(R"({"clock": {"round_trip_ms": 1200}})"), ElementsAre("path_slow"));
  EXPECT_THAT(found(R"({"clock": {"round_trip_ms": 600}})"), IsEmpty()) << "a satellite";
}

TEST(DoctorStatus, APathIsSilentWhileDataWaits) {
  const auto silent = [](const char* unheard) {
    return ids_of(diagnose_status(status_of(link_with(unheard))));
  };
  EXPECT_THAT(silent(R"({"unheard_seconds": 25, "unacknowledged_bytes": 900})"),
              ElementsAre("path_silent"));
  EXPECT_THAT(silent(R"({"unheard_seconds": 25, "unacknowledged_bytes": 0})"), IsEmpty());
  EXPECT_THAT(silent(R"({"unheard_seconds": 2, "unacknowledged_bytes": 900})"), IsEmpty());
}

// What was yesterday is in the counts, and not told.
TEST(DoctorStatus, YesterdayIsNotToldAsNow) {
  Json status = status_of(topic_with(R"({"dropped": {"max_age": 50, "newer_available": 900},
    "lately": {"messages": 10, "wire_bytes": 10, "dropped": {}}})"));
  status["strangers"] = {{"wrong_logins", 3}};
  status["lately"] = {{"wrong_logins", 0}};
  EXPECT_THAT(ids_of(diagnose_status(status)), IsEmpty());
}

TEST(DoctorStatus, APathThatCarriesAllIsNotThin) {
  Json status =
      status_of(topic_with(R"({"wire_bytes": 30000000, "dropped": {"newer_available": 50}})"));
  EXPECT_THAT(ids_of(diagnose_status(status)), ElementsAre("link_too_thin"));
  status["links"][0]["rate_bytes_per_second"] = 236'000'000;
  EXPECT_THAT(ids_of(diagnose_status(status)), IsEmpty());
}

TEST(DoctorStatus, ABreakNowAndThenIsUsual) {
  Json status = status_of(broken("silent", 0.2));
  status["links"][0]["breaks"].erase(1);
  EXPECT_THAT(ids_of(diagnose_status(status)), IsEmpty());
  status = status_of(broken("going_away", 0.2));
  EXPECT_THAT(ids_of(diagnose_status(status)), IsEmpty()) << "restarts";
  status = status_of(broken("replaced", 0));
  EXPECT_THAT(ids_of(diagnose_status(status)), IsEmpty()) << "a robot that changes its network";
}

// A path that breaks carries less than it could.
TEST(DoctorStatus, ABrokenLinkIsNotCalledThin) {
  Json status = status_of(broken("silent", 5));
  status["links"][0]["topics"][0]["dropped"] = {{"newer_available", 50}};
  EXPECT_THAT(ids_of(diagnose_status(status)), ElementsAre("link_breaks"));
}

// Somebody set it, and no path is looked for.
TEST(DoctorStatus, ALimitOfThisSideIsNamed) {
  Json status = status_of(topic_with(R"({"dropped": {"newer_available": 50}})"));
  EXPECT_THAT(ids_of(diagnose_status(status)), ElementsAre("link_too_thin"));
  EXPECT_THAT(ids_of(diagnose_status(status, {true, 1000})), ElementsAre("own_limit"));
  EXPECT_THAT(ids_of(diagnose_status(status, {true, 1'000'000})), ElementsAre("link_too_thin"));
  status["links"][0]["rate_bytes_per_second"] = 0;  // nothing says that it is the path
  EXPECT_THAT(ids_of(diagnose_status(status, {true, 1'000'000})), ElementsAre("own_limit"));
}

TEST(DoctorStatus, TheSmallerLimitOfThisSideCounts) {
  const SideFacts facts = facts_of(config_of(
      yaml("{auth: {method: none}, bytes_per_second: 500000, link: {bytes_per_second: 10000}}"),
      Role::kServer));
  Json status = status_of(topic_with(R"({"dropped": {"newer_available": 50}})"));
  status["links"][0]["rate_bytes_per_second"] = 0;
  const auto found = diagnose_status(status, facts);
  ASSERT_THAT(ids_of(found), ElementsAre("own_limit"));
  EXPECT_EQ(found[0].detail, "`link.bytes_per_second` is 10000 bytes/s");
}

TEST(DoctorStatus, ARuleThatKeepsPicturesExactIsNamed) {
  SideFacts facts;
  facts.rules["cam"].exact = true;
  Json status = status_of(topic_with(R"({"rule": "cam", "dropped": {"newer_available": 50}})"));
  EXPECT_THAT(diagnose_status(status, facts)[0].detail, Not(HasSubstr("lossy")));
  status["links"][0]["topics"][0]["type"] = "sensor_msgs/msg/Image";
  EXPECT_THAT(diagnose_status(status, facts)[0].detail, HasSubstr("`lossy: never`"));
}

TEST(DoctorStatus, ABuildWithoutVideoIsNamed) {
  SideFacts facts;
  facts.video = false;
  Json status = status_of(topic_with(R"({"dropped": {"newer_available": 50}})"));
  EXPECT_THAT(diagnose_status(status, facts)[0].detail, Not(HasSubstr("video")));
  status["links"][0]["topics"][0]["type"] = "sensor_msgs/msg/Image";
  EXPECT_THAT(diagnose_status(status, facts)[0].detail, HasSubstr("this build has no video"));
  facts.video = true;
  EXPECT_THAT(diagnose_status(status, facts)[0].detail, Not(HasSubstr("video")));
}

// A path that delays beyond `dead_after` now and then does so in a time of its own.
TEST(DoctorStatus, WhatAnImpatientSideCallsSilenceForgetsNothing) {
  SideFacts facts;
  facts.dead_after = 0.5;
  const Json status = status_of(broken("silent", 0.2, true));
  EXPECT_THAT(ids_of(diagnose_status(status)), ElementsAre("connections_forgotten"));
  EXPECT_THAT(ids_of(diagnose_status(status, facts)), ElementsAre("link_breaks"));
}

TEST(DoctorStatus, ALimitOfTheLifetimeIsSaidWhereConnectionsEnd) {
  const auto detail = [](bool is_regular) {
    return diagnose_status(status_of(broken("connection_lost", 0.1, is_regular)))[0].detail;
  };
  EXPECT_THAT(detail(true), HasSubstr("; each connection lasted about 210 s"));
  EXPECT_THAT(detail(false), Not(HasSubstr("each connection")));
}

TEST(DoctorStatus, TheOtherEndsWordForTheSameIsNotRepeated) {
  Json status = status_of(topic_with(R"({"dropped": {"too_large": 50}})"));
  status["links"][0]["peer_findings"] = {{{"id", "drops_too_large"}, {"name", "/t"}}};
  EXPECT_THAT(ids_of(diagnose_status(status)), ElementsAre("drops_too_large"));
}

TEST(DoctorStatus, AnImpatientSideIsNamedWhereLinksBreakBySilence) {
  SideFacts facts;
  facts.dead_after = 0.3;
  const Json status = status_of(broken("silent", 5));
  EXPECT_THAT(diagnose_status(status, facts)[0].detail, HasSubstr("`dead_after` is 0.3 s here"));
  facts.dead_after = 3;
  EXPECT_THAT(diagnose_status(status, facts)[0].detail, Not(HasSubstr("dead_after")));
}

// It is to be driven, and gives nothing.
TEST(DoctorStatus, WhoseRulesExportNothingLacksNothing) {
  const Json status = status_of(link_with(R"({"topics": []})"));
  EXPECT_THAT(ids_of(diagnose_status(status)), ElementsAre("nothing_here"));
  EXPECT_THAT(ids_of(diagnose_status(status, {false, 0})), IsEmpty());
  const Json driven = status_of(topic_with(R"({"direction": "import"})"));
  EXPECT_THAT(ids_of(diagnose_status(driven)), IsEmpty()) << "its graph is the right one";
}

TEST(DoctorStatus, ANodeThatWaitsForAPeerShowsThatTheGraphIsRight) {
  Json status = status_of(missing_for("other_peer"));
  status["links"][0]["topics"] = Json::array();
  EXPECT_THAT(ids_of(diagnose_status(status)), ElementsAre("other_peer"));
}

TEST(DoctorStatus, ASensorThatIsSilentIsSaidWhateverElseCrosses) {
  Json status = status_of(topic_with("{}"));
  Json silent = status["links"][0]["topics"][0];
  silent["topic"] = "/scan";
  silent["messages"] = 0;
  for (const auto& [type, id] : {std::pair("std_msgs/msg/String", ""),
                                 std::pair("sensor_msgs/msg/LaserScan", "nothing_arrives")}) {
    silent["type"] = type;
    status["links"][0]["topics"][1] = silent;
    EXPECT_EQ(ids_of(diagnose_status(status)),
              *id == 0 ? std::vector<std::string>() : std::vector<std::string>{id});
  }
}

TEST(DoctorStatus, AnActionBelowAnotherKeyIsNamed) {
  const auto found = [](const char* kind, const std::string& services) {
    const SideFacts facts =
        facts_of(config_of(yaml("{auth: {method: none}, rules: [a], rule: {a: {export_services: [" +
                                services + "]}}}"),
                           Role::kServer));
    Json status = status_of(missing_for("no_rule"));
    Json& name = status["links"][0]["missing"][0];
    name.merge_patch({{"name", "/r/go"}, {"direction", "export"}, {"kind", kind}});
    name["waits"] = "nobody";
    status["prefix"] = "/r";
    return diagnose_status(status, facts);
  };
  ASSERT_THAT(ids_of(found("action", "/go")), ElementsAre("no_rule"));
  EXPECT_THAT(found("action", "/go")[0].detail,
              HasSubstr("rule.a.export_services names it, but not as an action"));
  EXPECT_THAT(found("topic", "/go"), IsEmpty()) << "it may share its name with the service";
  ASSERT_THAT(ids_of(found("action", "\"/**\"")), ElementsAre("no_rule"));
  EXPECT_THAT(found("action", "\"/**\"], export_actions: [/stop"), IsEmpty())
      << "not to be given, as it seems";
}

TEST(DoctorStatus, TheNamespaceOfTheProgramIsTakenForAPrefix) {
  Json status = status_of(missing_for("not_given"));
  status["links"][0]["missing"][0]["name"] = "/robot1/chatter";
  status["node"] = "/connect_client";
  EXPECT_THAT(diagnose_status(status)[0].detail, Not(HasSubstr("prefix")));
  status["node"] = "/robot1/connect_client";
  EXPECT_THAT(diagnose_status(status)[0].detail, HasSubstr("set `prefix: /robot1`"));
}

// The server's own login method fails: nobody comes in.
TEST(DoctorStatus, ALoginMethodThatGivesNoAnswerIsSaidAtTheServer) {
  const Json status =
      status_of(R"({"listens": ["10.0.0.5:9090"], "lately": {"logins_not_judged": 2}})");
  EXPECT_THAT(ids_of(diagnose_status(status)),
              UnorderedElementsAre("login_not_judged", "nobody_linked"));
}

// A robot listens to much that only some peers, or none, may send.
TEST(DoctorStatus, ARobotThatWorksKeepsItsRules) {
  for (const char* reason : {"no_rule", "other_peer", "denied", "not_there"}) {
    Json status = status_of(missing_for(reason));
    status["links"][0]["missing"][0]["kind"] = "topic";
    EXPECT_THAT(ids_of(diagnose_status(status)), IsEmpty()) << reason;
    status["links"][0]["topics"] = Json::array();
    EXPECT_THAT(ids_of(diagnose_status(status)), Contains(reason)) << "nothing crosses";
  }
}

// Two people, or two machines of one; and a robot with two modems has two nodes.
TEST(DoctorStatus, LinksOfOneIdentityAreUsual) {
  EXPECT_THAT(ids_of(diagnose_status(status_of(two_robots("/modem_b")))), IsEmpty());
  Json status = status_of(two_robots("/robot7"));
  status["is_robot"] = true;
  EXPECT_THAT(ids_of(diagnose_status(status)), IsEmpty());
}

TEST(DoctorStatus, AnExpiredTokenExplainsWrongLogins) {
  SideFacts facts;
  facts.expired = {"anna"};
  const Json wrong = status_of(R"({"listens": ["10.0.0.5:9090"], "lately": {"wrong_logins": 2}})");
  EXPECT_THAT(ids_of(diagnose_status(wrong, facts)),
              UnorderedElementsAre("nobody_linked", "wrong_logins", "token_expired"));
  EXPECT_THAT(ids_of(diagnose_status(status_of(link_with("{}")), facts)), IsEmpty());
}

// Another peer drives, and nobody here wants to.
TEST(DoctorStatus, AnOperatorWhoRestsIsNotTakenFrom) {
  const Json status = status_of(topic_with(R"({"wheel": "taken", "messages": 0})"));
  EXPECT_THAT(ids_of(diagnose_status(status)), Not(Contains("another_drives")));
}

// Both graphs are one: nothing else about the link means anything.
TEST(DoctorStatus, OneGraphIsSaidAsWhatItIs) {
  Json status = status_of(missing_for("not_taken"));
  status["links"][0]["same_graph"] = true;
  EXPECT_THAT(ids_of(diagnose_status(status)), ElementsAre("one_graph"));
}

TEST(DoctorStatus, ClocksThatDifferExplainMaxAge) {
  auto status = status_of(topic_with(R"({"dropped": {"max_age": 50}})"));
  status["links"][0]["clock"] = {{"offset_ms", -4000}};
  EXPECT_THAT(ids_of(diagnose_status(status)), ElementsAre("clocks_differ"));
}

TEST(DoctorStatus, TheHeaviestTopicOfAThinLinkIsNamed) {
  auto status = status_of(topic_with(R"({"wire_bytes": 10, "dropped": {"queue_time": 50}})"));
  auto image = status["links"][0]["topics"][0];
  image["topic"] = "/image";
  image["wire_bytes"] = 9'000'000;
  status["links"][0]["topics"].push_back(image);
  const auto found = diagnose_status(status);
  ASSERT_THAT(ids_of(found), ElementsAre("link_too_thin"));
  EXPECT_EQ(found[0].subject, "/image");
  EXPECT_THAT(found[0].detail, HasSubstr("1 kB/s"));
}

// An operator may subscribe to little; who drives wants that somebody listens.
TEST(DoctorStatus, NobodyListensToCommands) {
  auto status = status_of(at_operator(
      topic_with(R"({"type": "geometry_msgs/msg/Twist", "demanded": false, "messages": 0})")));
  auto& topics = status["links"][0]["topics"];
  topics.push_back(topics[0]);
  topics[1]["direction"] = "import";
  topics[1]["messages"] = 100;
  EXPECT_THAT(ids_of(diagnose_status(status)), ElementsAre("no_listener"));
  topics[0]["declined"] = "the peer does not import it";
  EXPECT_THAT(ids_of(diagnose_status(status)), IsEmpty());
  topics[0]["declined"] = "";
  topics[0]["type"] = "geometry_msgs/msg/PoseStamped";
  EXPECT_THAT(ids_of(diagnose_status(status)), IsEmpty());
}

TEST(DoctorStatus, ManyOfOneKindAreOneLine) {
  auto status = status_of(topic_with(R"({"demanded": false, "messages": 0})"));
  auto& topics = status["links"][0]["topics"];
  for (int i = 0; i < 300; ++i) topics.push_back(topics[0]);
  const auto found = diagnose_status(status);
  ASSERT_THAT(ids_of(found), ElementsAre("no_listener"));
  EXPECT_EQ(found[0].subject, "/t, /t, /t, /t and 297 more");
}

// Whatever answers may be another version, or no status at all.
TEST(DoctorStatus, WhatIsNoStatusIsNoTrap) {
  for (const char* text :
       {"{}", "[]", "1", "null", R"({"links": 3})", R"({"links": [1, null, {"topics": [2]}]})",
        R"({"links": [{"open": true, "topics": [{"dropped": []}], "missing": ["x"]}]})",
        R"({"time": "yesterday", "certificate_valid_until": 5})"})
    for (const auto& one : diagnose_status(Json::parse(text)))
      EXPECT_NE(finding_of(one.id), nullptr);
}

// ---- processes and the machine

TEST(DoctorProcesses, WhatKeepsNodesAndBridgeApart) {
  const ProcessFacts plain{{}, 1000};
  EXPECT_THAT(diagnose_processes(plain, plain), IsEmpty());
  const auto differs = [&](const char* name, const char* value) {
    return ids_of(diagnose_processes({{{name, value}}, 1000}, plain));
  };
  EXPECT_THAT(differs("ROS_DOMAIN_ID", "7"), ElementsAre("domain_differs"));
  EXPECT_THAT(differs("ROS_DOMAIN_ID", "0"), IsEmpty()) << "the default";
  EXPECT_THAT(differs("RMW_IMPLEMENTATION", "rmw_cyclonedds_cpp"), ElementsAre("rmw_differs"));
  EXPECT_THAT(differs("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp"), IsEmpty()) << "the default";
  EXPECT_FALSE(has_fault(diagnose_processes({{{"ROS_DOMAIN_ID", "7"}}, 1000}, plain)))
      << "two graphs on one machine, as in README";
  EXPECT_THAT(differs("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"),
              ElementsAre("discovery_range"));
  EXPECT_THAT(differs("ROS_LOCALHOST_ONLY", "1"), ElementsAre("discovery_range"));
  EXPECT_THAT(ids_of(diagnose_processes({{{"ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF"}}, 1000},
                                        {{{"ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF"}}, 1000})),
              ElementsAre("discovery_range"));
  EXPECT_THAT(differs("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF"), ElementsAre("discovery_range"));
  EXPECT_THAT(ids_of(diagnose_processes({{}, 0}, plain)), ElementsAre("user_differs"));
  const auto found =
      diagnose_processes({{{"ROS_DISCOVERY_SERVER", "10.9.0.254:11811"}}, 1000}, plain);
  ASSERT_THAT(ids_of(found), ElementsAre("middleware_differs"));
  EXPECT_EQ(found[0].detail, "10.9.0.254:11811 there, not set here");
  EXPECT_EQ(diagnose_processes({{{"CYCLONEDDS_URI", "<Security>secret"}}, 1000}, plain)[0].detail,
            "set inline there, not set here");
}

// A shell of another domain says nothing about a bridge that carries data.
TEST(DoctorProcesses, DataThatCrossesProvesTheGraph) {
  EXPECT_TRUE(carries_data(status_of(link_with("{}"))));
  EXPECT_FALSE(carries_data(status_of(topic_with(R"({"messages": 0})"))));
  EXPECT_TRUE(
      carries_data(status_of(link_with(R"({"topics": [], "services": [{"answered": 1}]})"))));
}

TEST(DoctorProcesses, ADomainIsANumberFrom0To232) {
  for (const char* right : {"", "0", "232"})
    EXPECT_THAT(diagnose_shell({{{"ROS_DOMAIN_ID", right}}, 0}), IsEmpty()) << right;
  for (const char* wrong : {"233", "-1", "abc", "1 "})
    EXPECT_THAT(ids_of(diagnose_shell({{{"ROS_DOMAIN_ID", wrong}}, 0})),
                ElementsAre("domain_wrong"));
}

TEST(DoctorProcesses, TheDomainIsSaidOnce) {
  const auto said = [](std::vector<ProgramFacts> programs) {
    std::vector<Found> found{{"domain_differs", "ROS_DOMAIN_ID", "7 there", false, "one"},
                             {"loop_slow", "", "", false, "one"},
                             {"domain_differs", "ROS_DOMAIN_ID", "7 there", false, "two"}};
    gather_domains(programs, found);
    return found;
  };
  EXPECT_THAT(said({{"/a", "7", 1}, {"/b", "7", 2}}),
              ElementsAre(Found{"domain_differs", "ROS_DOMAIN_ID", "7 there"},
                          Found{"loop_slow", "", "", false, "one"}));
  EXPECT_THAT(ids_of(said({{"/a", "7", 1}, {"/b", "0", 2}})), ElementsAre("loop_slow"))
      << "two graphs on one machine";
}

TEST(DoctorProcesses, AGroupThatUsesUpItsProcessorTime) {
  EXPECT_THAT(ids_of(diagnose_throttling("usage_usec 9\nnr_periods 243\nnr_throttled 243\n")),
              ElementsAre("processor_limited"));
  EXPECT_THAT(diagnose_throttling("nr_periods 243\nnr_throttled 9\n"), IsEmpty());
  EXPECT_THAT(diagnose_throttling("nr_periods 20\nnr_throttled 20\n"), IsEmpty()) << "a start";
  EXPECT_THAT(diagnose_throttling("nr_periods 0\nnr_throttled 0\n"), IsEmpty()) << "no limit";
  EXPECT_THAT(diagnose_throttling(""), IsEmpty());
}

TEST(DoctorProcesses, TwoProgramsOfOneNameInOneDomain) {
  EXPECT_THAT(ids_of(diagnose_programs({{"/a", "0", 1}, {"/b", "0", 2}, {"/a", "0", 3}})),
              ElementsAre("same_name"));
  EXPECT_THAT(diagnose_programs({{"/a", "0", 1}, {"/a", "7", 2}, {"", "", 3}, {"", "", 4}}),
              IsEmpty());
}

TEST(DoctorProcesses, TwoRobotsWithoutAPrefixAreMixed) {
  const auto brings = [](const char* of_a, const char* of_b, const char* domain_of_b = "0") {
    return diagnose_programs({{"/a", "0", 1, {of_a}}, {"/b", domain_of_b, 2, {of_b}}});
  };
  EXPECT_THAT(brings("/scan", "/scan"), ElementsAre(Found{"names_collide", "/scan", "/a and /b"}));
  EXPECT_THAT(brings("/robot1/scan", "/robot2/scan"), IsEmpty());
  EXPECT_THAT(brings("/scan", "/scan", "7"), IsEmpty());
  EXPECT_THAT(brings("/tf", "/tf"), IsEmpty()) << "robots with frames of their own";
  const Json status = status_of(topic_with(R"({"direction": "import"})"));
  EXPECT_THAT(brought_topics(status), ElementsAre("/t"));
  EXPECT_THAT(brought_topics(status_of(link_with("{}"))), IsEmpty());
}

TEST(DoctorMachine, SharedMemoryAndBbr) {
  EXPECT_THAT(diagnose_machine({"reno cubic bbr", 1ULL << 30}), IsEmpty());
  EXPECT_THAT(ids_of(diagnose_machine({"reno cubic", 1ULL << 30, true})), ElementsAre("no_bbr"));
  EXPECT_THAT(diagnose_machine({"reno cubic", 1ULL << 30, false}), IsEmpty()) << "no path loses";
  EXPECT_THAT(ids_of(diagnose_machine({"", 1 << 20})), ElementsAre("shared_memory_small"));
}

// ---- the report

TEST(DoctorReport, FaultsComeBeforeHintsWithCauseAndCure) {
  const std::vector<Found> found{{"no_bbr", "", "reno"}, {"rule_type", "/t", "by the rule a"}};
  const std::string text = report_text(found);
  EXPECT_THAT(text,
              HasSubstr("/t: the rule of this side is for another type\n  seen: by the rule a\n"));
  EXPECT_LT(text.find("[rule_type]"), text.find("hint: "));
  EXPECT_TRUE(has_fault(found));
  EXPECT_FALSE(has_fault({{"no_bbr", "", ""}}));
  const Json json = Json::parse(report_json(found));
  ASSERT_EQ(json.at("findings").size(), 2U);
  EXPECT_EQ(json["findings"][0]["id"], "rule_type");
  EXPECT_EQ(json["findings"][0]["cure"], std::string(finding_of("rule_type")->cure));
}

TEST(DoctorReport, WhatSomebodyWaitsForComesFirst) {
  const auto rows = sorted({{"no_rule", "/h", "", false, ""},
                            {"loop_slow", "", "", false, ""},
                            {"not_there", "/w", "", true, ""},
                            {"not_taken", "/t", "", true, ""}});
  EXPECT_THAT(ids_of(rows), ElementsAre("not_taken", "loop_slow", "not_there", "no_rule"));
}

TEST(DoctorReport, SeveralProgramsHaveTheirNames) {
  EXPECT_THAT(report_text({{"loop_slow", "", "", false, "connect_server (7)"}}),
              HasSubstr("connect_server (7): the bridge was held up"));
  EXPECT_EQ(
      gathered({{"no_rule", "/a", "", false, "one"}, {"no_rule", "/a", "", false, "two"}}).size(),
      2U);
}

// Faults with one reason are one line, those with different ones are not.
TEST(DoctorReport, OneReasonIsOneLine) {
  const auto found = gathered({{"not_taken", "/a", "no", true, ""},
                               {"not_taken", "/b", "no", true, ""},
                               {"not_taken", "/c", "only as p/msg/T", true, ""}});
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].subject, "/a, /b");
}

TEST(DoctorReport, WhatAPeerNamesIsText) {
  auto status = status_of(missing_for("denied", "\\u001b[31m"));
  EXPECT_THAT(report_text(diagnose_status(status)), Not(HasSubstr("\x1b")));
}

}  // namespace
}  // namespace connect_bridge
