// What processes of this graph ask the bridge about its types, and how much of that at a time.
#include "core/types/description_calls.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/base/cdr.hpp"
#include "core/types/description_service.hpp"
#include "unit/flow/script.hpp"
#include "unit/types/descriptions.hpp"

namespace connect_bridge {
namespace {

using flow_test::now_ms;

const Definition kEmpty{"std_msgs/msg/Empty", kEmptyHash};

struct Asked {
  // A request for this type at a server of ours.
  void ask(std::uint64_t server, std::uint64_t request, const Definition& of = kEmpty,
           std::int64_t at = 0) {
    Payload bytes = CdrWriter{}.string(of.first).string(of.second).u8(0).take();
    subject.begin({{server}, {request}, std::move(bytes)}, now_ms(at));
  }
  std::optional<Definition> look_up(std::uint64_t lookup, const std::string& text) {
    return subject.on_looked_up({{lookup}, text});
  }
  // "1.2 known": the answer to request 2 at server 1; "unknown" or "later"; "look up 1"; "1.2
  // dropped".
  std::string did() {
    std::string words;
    while (const auto action = outputs.next()) {
      std::string word;
      if (const auto* look = std::get_if<LookUpType>(&*action))
        word = "look up " + std::to_string(look->id.value);
      if (const auto* drop = std::get_if<DropRequest>(&*action))
        word = name(drop->mirror, drop->request) + " dropped";
      if (const auto* sent = std::get_if<SendResponse>(&*action))
        word = name(sent->mirror, sent->request) + " " + word_of(sent->payload);
      words += (words.empty() ? "" : ", ") + word;
    }
    return words;
  }
  static std::string name(ServiceMirrorId server, RequestId request) {
    return std::to_string(server.value) + "." + std::to_string(request.value);
  }
  static std::string word_of(const Payload& response) {
    if (text_of_response(response.view())) return "known";
    const std::string text(response.view().begin(), response.view().end());
    return text.find("ask again later") == std::string::npos ? "unknown" : "later";
  }
  [[nodiscard]] std::int64_t deadline() const {
    const auto at = subject.deadline();
    return at ? (*at - TimePoint{}) / std::chrono::milliseconds(1) : -1;
  }

  Outputs outputs;
  DescriptionCalls subject{outputs};
};

TEST(DescriptionCalls, AreAnsweredFromTheInstalledPackage) {
  Asked s;
  s.ask(1, 1);
  EXPECT_EQ(s.did(), "look up 1");
  EXPECT_FALSE(s.subject.waits_for(kEmpty));  // no peer is asked yet
  EXPECT_EQ(s.deadline(), 5000);
  EXPECT_FALSE(s.look_up(1, kEmptyText));
  EXPECT_EQ(s.did(), "1.1 known");
  EXPECT_EQ(s.deadline(), -1);
}

TEST(DescriptionCalls, WhatIsNotInstalledAPeerMayKnow) {
  Asked s;
  s.ask(1, 1);
  s.did();
  EXPECT_EQ(s.look_up(1, ""), kEmpty);
  EXPECT_TRUE(s.subject.waits_for(kEmpty));
  EXPECT_EQ(s.did(), "");
  EXPECT_FALSE(s.look_up(1, kEmptyText));  // an answer that nobody waits for
  EXPECT_EQ(s.did(), "");
  s.subject.on_there(kEmpty, kEmptyText);
  EXPECT_EQ(s.did(), "1.1 known");
  s.subject.on_there(kEmpty, kEmptyText);
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.deadline(), -1);
}

// Whoever gives it.
TEST(DescriptionCalls, ATextOfAnotherHashOrNameIsNotGiven) {
  for (const Definition& asked : {Definition{kEmpty.first, "RIHS01_0"}, {"p/msg/T", kEmptyHash}}) {
    Asked s;
    s.ask(1, 1, asked);
    s.did();
    static_cast<void>(s.look_up(1, ""));
    s.subject.on_there(asked, kEmptyText);
    EXPECT_EQ(s.did(), "1.1 unknown");
  }
}

TEST(DescriptionCalls, AllThatAskForATypeAreAnsweredTogether) {
  Asked s;
  const Definition other{"p/msg/T", "RIHS01_1"};
  s.ask(1, 1);
  s.ask(2, 7);
  s.ask(1, 2, other);
  s.ask(1, 3);  // is still looked up
  for (const std::uint64_t lookup : {1, 2, 3}) static_cast<void>(s.look_up(lookup, ""));
  s.did();
  s.subject.on_there(kEmpty, kEmptyText);
  EXPECT_EQ(s.did(), "1.1 known, 2.7 known");
  s.subject.on_there(other, "");
  EXPECT_EQ(s.did(), "1.2 unknown");
}

TEST(DescriptionCalls, AreNotAnsweredLaterThanFiveSeconds) {
  Asked s;
  s.ask(1, 1, kEmpty, 0);
  s.ask(1, 2, kEmpty, 1000);
  static_cast<void>(s.look_up(1, ""));
  s.did();
  EXPECT_EQ(s.deadline(), 5000);
  s.subject.on_time(now_ms(4999));
  EXPECT_EQ(s.did(), "");
  s.subject.on_time(now_ms(5000));
  EXPECT_EQ(s.did(), "1.1 unknown");
  EXPECT_EQ(s.deadline(), 6000);
  s.subject.on_time(now_ms(6000));
  EXPECT_EQ(s.did(), "1.2 unknown");
  EXPECT_FALSE(s.look_up(2, kEmptyText));
  EXPECT_EQ(s.did(), "");
}

TEST(DescriptionCalls, WhatIsNoRequestIsDroppedAndCountsNowhere) {
  Asked s;
  for (std::uint64_t i = 1; i <= 1000; ++i)
    s.subject.begin({{1}, {i}, Payload::adopt({0, 1, 0, 0, 9})}, now_ms(0));
  EXPECT_EQ(s.did().substr(0, 24), "1.1 dropped, 1.2 dropped");
  s.ask(1, 1);
  EXPECT_EQ(s.did(), "look up 1");
}

TEST(DescriptionCalls, NobodyIsAnsweredWhoIsGone) {
  Asked s;
  s.ask(1, 1);
  s.ask(1, 2);
  s.ask(2, 1);
  s.ask(3, 1);
  s.did();
  s.subject.on_callers_gone({{1}, {{1}, {9}}});
  s.subject.on_server_gone({3});
  s.subject.on_time(now_ms(5000));
  EXPECT_EQ(s.did(), "1.2 unknown, 2.1 unknown");
}

// ---- how much

// Asks at this server until it says "later"; how many were looked up.
int asked_at(Asked& s, std::uint64_t server, std::int64_t at = 0) {
  int looked_up = 0;
  for (std::uint64_t request = 1; request <= 2000; ++request) {
    s.ask(server, request, kEmpty, at);
    if (s.did().find("later") != std::string::npos) break;
    ++looked_up;
  }
  return looked_up;
}

TEST(DescriptionCalls, AtOneServerAndInAllSoManyAreUnderWay) {
  Asked s;
  EXPECT_EQ(asked_at(s, 1), 32);
  EXPECT_EQ(asked_at(s, 2), 32);
  EXPECT_EQ(asked_at(s, 3), 0);
  s.subject.on_server_gone({2});
  EXPECT_EQ(asked_at(s, 1), 0);
  EXPECT_EQ(asked_at(s, 3), 32);
}

// Whose answers come at once.
TEST(DescriptionCalls, AtOneServerTheyComeNoFasterThanItsPace) {
  Asked s;
  const auto answered = [&](std::uint64_t server, std::int64_t at) {
    int count = 0;
    for (std::uint64_t request = 1; request <= 2000; ++request) {
      s.ask(server, request, kEmpty, at);
      const std::string did = s.did();
      if (did.find("later") != std::string::npos) break;
      static_cast<void>(s.look_up(std::stoull(did.substr(8)), ""));
      s.subject.on_there(kEmpty, kEmptyText);
      EXPECT_EQ(s.did().substr(0, 2), std::to_string(server) + ".");
      ++count;
    }
    return count;
  };
  EXPECT_EQ(answered(1, 0), 256);
  EXPECT_EQ(answered(1, 49), 0);
  EXPECT_EQ(answered(1, 50), 1);
  EXPECT_EQ(answered(2, 50), 256);  // others are not held up
  EXPECT_EQ(answered(3, 50) + answered(4, 50), 512);
  EXPECT_EQ(answered(5, 50), 4);  // all together have a pace, too: 1024, and five since then
}

}  // namespace
}  // namespace connect_bridge
