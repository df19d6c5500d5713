#include "core/services/call_gate.hpp"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace connect_bridge {
namespace {

struct Step {
  std::string does;
  std::string begins;  // "1.2/3": call 3 of link 1 at service 2 is handed over
};

// Gates that are told of what happens in words:
//
//   open 1, results 1     service 1 can be called, and has a gate of its own
//   admit 1.2 3           link 1 has 3 places at service 2; with a further number, the depth of the
//                         server's queue by its rule; with a third one, its identity
//   add 1.2 5             the next 5 calls of link 1 at service 2
//   answer 1 7            service 1 answers what was handed over as its request 7, and the call of
//                         that leaves
//   fail 1 7              request 7 cannot be sent to service 1; its call left before
//   leave 1.2 3           call 3 of link 1 at service 2 is given up
//   slow 1.2 3            when call 3 is handed over, a worker prepares it first
//   ready 1.2 3           and is done
//   dismiss 1.2, gone 1, pass 5000 (ms)
//
// Requests are numbered per service as they are handed over.
class Words {
 public:
  std::string does(const std::string& text) {
    std::istringstream words(text);
    std::string verb;
    words >> verb;
    if (verb == "pass") {
      now_ += std::chrono::milliseconds(number(words));
    } else if (verb == "open" || verb == "results" || verb == "gone" || verb == "answer" ||
               verb == "fail") {
      of_service(verb, number(words), words);
    } else {
      of_caller(verb, caller(words), words);
    }
    return begun();
  }

  std::map<std::uint32_t, CallGate> gates;  // by service

 private:
  struct Caller {
    LinkId link;
    std::uint32_t service = 0;
    auto operator<=>(const Caller&) const = default;
  };
  static std::uint32_t number(std::istringstream& words) {
    std::uint32_t value = 0;
    words >> value;
    return value;
  }
  static Caller caller(std::istringstream& words) {
    const std::uint32_t link = number(words);
    words.ignore(1);
    return {{link}, number(words)};
  }
  void of_service(const std::string& verb, std::uint32_t service, std::istringstream& words) {
    if (verb == "open" || verb == "results") gates.try_emplace(service, verb == "results");
    CallGate& gate = gates.at(service);
    if (verb == "gone") gate.server_gone();
    const InvocationId request{number(words)};
    if (verb == "fail") gate.failed(request);
    if (verb != "answer") return;
    gate.answered(request, now_);
    const auto it = handed_.find({service, request});
    if (it != handed_.end()) gate.leave(it->second.caller, it->second.call);
  }
  void of_caller(const std::string& verb, const Caller& who, std::istringstream& words) {
    CallGate& gate = gates.at(who.service);
    if (verb == "admit") {
      CallGate::Terms terms;
      words >> terms.places;
      if (!(words >> terms.queue_depth)) terms.queue_depth = CallGate::Terms{}.queue_depth;
      if (!(words >> terms.identity)) terms.identity = who.link.value;
      gate.admit(who.link, terms);
    }
    if (verb == "dismiss") gate.dismiss(who.link);
    if (verb == "leave") gate.leave(who.link, {number(words)});
    if (verb == "slow") slow_.insert({who, {number(words)}});
    if (verb == "ready") hand_over(who.service, {who.link, {number(words)}});
    if (verb != "add") return;
    for (std::uint32_t left = number(words); left > 0; --left) gate.add(who.link, {++last_[who]});
  }
  void hand_over(std::uint32_t service, const CallGate::Next& next) {
    const InvocationId request{++requests_[service]};
    handed_[{service, request}] = next;
    gates.at(service).handed_over(next.caller, next.call, request, now_);
  }
  std::string begun() {
    std::string line;
    for (auto& [service, gate] : gates) {
      while (const auto next = gate.next(now_)) {
        line += (line.empty() ? "" : " ") + std::to_string(next->caller.value) + "." +
                std::to_string(service) + "/" + std::to_string(next->call.value);
        if (slow_.contains({{next->caller, service}, next->call})) {
          gate.preparing(next->caller, next->call);
        } else {
          hand_over(service, *next);
        }
      }
    }
    return line;
  }

  TimePoint now_{};
  std::map<Caller, std::uint32_t> last_;
  std::map<std::uint32_t, std::uint32_t> requests_;
  std::map<std::pair<std::uint32_t, InvocationId>, CallGate::Next> handed_;
  std::set<std::pair<Caller, CallId>> slow_;
};

void play(const std::vector<Step>& steps) {
  Words words;
  for (const Step& step : steps) EXPECT_EQ(words.does(step.does), step.begins) << step.does;
}

TEST(CallGate, ACallerHasItsPlaces) {
  play({{"open 1", ""},
        {"admit 1.1 2", ""},
        {"add 1.1 4", "1.1/1 1.1/2"},
        {"leave 1.1 3", ""},  // it only waited
        {"answer 1 2", "1.1/4"},
        {"answer 1 2", ""}});
}

TEST(CallGate, AServiceThatHangsHoldsUpNoOther) {
  play({{"open 1", ""},
        {"open 2", ""},
        {"admit 1.1 2", ""},
        {"admit 1.2 2", ""},
        {"add 1.1 9", "1.1/1 1.1/2"},
        {"add 1.2 2", "1.2/1 1.2/2"}});
}

TEST(CallGate, LinksTakeTurnsAtAFullServer) {
  play({{"open 1", ""},
        {"admit 1.1 4", ""},
        {"admit 2.1 4", ""},
        {"admit 3.1 4", ""},
        {"add 1.1 9", "1.1/1 1.1/2 1.1/3 1.1/4"},
        {"add 2.1 9", "2.1/1 2.1/2 2.1/3 2.1/4"},
        {"add 3.1 9", "3.1/1 3.1/2"},  // ten lie in the queue now
        {"answer 1 1", "3.1/3"},       // link 1 has a place again, behind link 3
        {"answer 1 2", "1.1/5"},
        {"answer 1 5", "3.1/4 1.1/6 2.1/5"},  // proves that 3 and 4 are taken, too
        {"answer 1 6", "2.1/6"}});
}

TEST(CallGate, ARuleSaysHowMuchTheQueueKeeps) {
  play({{"open 1", ""},
        {"admit 1.1 4 2", ""},
        {"admit 2.1 3 0", ""},
        {"add 1.1 4", "1.1/1 1.1/2"},
        {"add 2.1 5", "2.1/1 2.1/2 2.1/3"},  // without a depth nothing holds it up
        {"answer 1 3", "2.1/4"},             // the two behind it lie in the queue still
        {"answer 1 5", "1.1/3 2.1/5"}});
}

TEST(CallGate, WhatCannotBeSentLeavesRoomInTheQueue) {
  play({{"open 1", ""},
        {"admit 1.1 1 2", ""},
        {"admit 2.1 2 2", ""},
        {"add 1.1 1", "1.1/1"},
        {"add 2.1 2", "2.1/1"},
        {"leave 1.1 1", ""},
        {"fail 1 1", "2.1/2"}});
}

TEST(CallGate, WhoLeavesWhileItWaitsMakesWay) {
  play({{"open 1", ""},
        {"admit 1.1 4", ""},
        {"admit 2.1 4", ""},
        {"admit 3.1 4", ""},
        {"add 1.1 4", "1.1/1 1.1/2 1.1/3 1.1/4"},
        {"add 2.1 4", "2.1/1 2.1/2 2.1/3 2.1/4"},
        {"add 3.1 4", "3.1/1 3.1/2"},
        {"leave 3.1 3", ""},
        {"answer 1 1", "3.1/4"}});
}

TEST(CallGate, WhatWasHandedOverStaysInTheQueueWhenItsCallerLeaves) {
  play({{"open 1", ""},
        {"admit 1.1 4", ""},
        {"admit 2.1 4", ""},
        {"admit 3.1 4", ""},
        {"add 1.1 4", "1.1/1 1.1/2 1.1/3 1.1/4"},
        {"add 2.1 4", "2.1/1 2.1/2 2.1/3 2.1/4"},
        {"add 3.1 4", "3.1/1 3.1/2"},
        {"dismiss 1.1", ""},
        {"pass 4999", ""},
        {"pass 1", "3.1/3 3.1/4"}});  // silent for so long, it has taken them
}

TEST(CallGate, AServerThatIsGoneIsGivenNothing) {
  play({{"results 1", ""},
        {"admit 1.1 1", ""},
        {"add 1.1 12", "1.1/1 1.1/2 1.1/3 1.1/4 1.1/5 1.1/6 1.1/7 1.1/8 1.1/9 1.1/10"},
        {"gone 1", ""},
        {"pass 5000", ""},
        {"dismiss 1.1", ""}});
}

TEST(CallGate, ResultsHavePlacesOfTheirOwn) {
  play({{"results 1", ""},
        {"admit 1.1 1", ""},
        {"add 1.1 6", "1.1/1 1.1/2 1.1/3 1.1/4 1.1/5 1.1/6"}});
}

TEST(CallGate, APreparedCallHoldsThoseBehindIt) {
  play({{"open 1", ""},
        {"admit 1.1 4", ""},
        {"admit 2.1 4", ""},
        {"slow 1.1 2", ""},
        {"add 1.1 4", "1.1/1 1.1/2"},
        {"add 2.1 1", "2.1/1"},
        {"answer 1 1", ""},
        {"ready 1.1 2", "1.1/3 1.1/4"}});
}

TEST(CallGate, APreparedCallThatLeavesMakesWay) {
  play({{"open 1", ""},
        {"admit 1.1 4", ""},
        {"slow 1.1 1", ""},
        {"add 1.1 2", "1.1/1"},
        {"leave 1.1 1", "1.1/2"}});
}

// 1, 2 and 3 are links of one identity.
TEST(CallGate, AnIdentityWithManyLinksHasTheTurnsOfOne) {
  play({{"open 1", ""},
        {"admit 1.1 100 1 7", ""},
        {"admit 2.1 100 1 7", ""},
        {"admit 3.1 100 1 7", ""},
        {"admit 4.1 100 1 8", ""},
        {"add 1.1 2", "1.1/1"},
        {"add 2.1 2", ""},
        {"add 3.1 2", ""},
        {"add 4.1 3", ""},
        {"answer 1 1", "1.1/2"},
        {"answer 1 2", "4.1/1"},
        {"answer 1 3", "2.1/1"},
        {"answer 1 4", "4.1/2"},
        {"answer 1 5", "3.1/1"},
        {"answer 1 6", "4.1/3"},
        {"answer 1 7", "2.1/2"}});
}

TEST(CallGate, TheLinksOfAnIdentityShareItsPlaces) {
  play({{"open 1", ""},
        {"admit 1.1 2 10 7", ""},
        {"admit 2.1 2 10 7", ""},
        {"admit 3.1 2 10 8", ""},
        {"add 1.1 3", "1.1/1 1.1/2"},
        {"add 2.1 2", "2.1/1"},  // a link has one in any case
        {"add 3.1 1", "3.1/1"},
        {"answer 1 1", ""},
        {"answer 1 2", "1.1/3"},
        {"dismiss 1.1", "2.1/2"}});
}

TEST(CallGate, SaysWhatACallWaitsFor) {
  Words words;
  words.does("open 1");
  const CallGate& gate = words.gates.at(1);
  words.does("admit 1.1 3 2");
  words.does("add 1.1 2");
  EXPECT_FALSE(gate.wait());
  words.does("pass 100");
  words.does("add 1.1 1");
  ASSERT_TRUE(gate.wait());
  EXPECT_EQ(gate.wait()->obstacle, CallGate::Obstacle::kQueue);
  words.does("pass 100");
  const TimePoint since = gate.wait()->since;
  words.does("add 1.1 1");
  EXPECT_EQ(gate.wait()->since, since);
  EXPECT_EQ(words.does("pass 5000"), "1.1/3");  // the first two are presumed taken
  ASSERT_TRUE(gate.wait());
  EXPECT_EQ(gate.wait()->obstacle, CallGate::Obstacle::kPlaces);
  EXPECT_GT(gate.wait()->since, since);
}

TEST(CallGate, TellsWhetherACallWouldWait) {
  Words words;
  words.does("open 1");
  const CallGate& gate = words.gates.at(1);
  EXPECT_TRUE(gate.would_wait({1}));  // it is not admitted
  words.does("admit 1.1 2");
  EXPECT_FALSE(gate.would_wait({1}));
  words.does("add 1.1 5");
  EXPECT_TRUE(gate.would_wait({1}));
  EXPECT_EQ(gate.waiting({1}), 3U);
}

}  // namespace
}  // namespace connect_bridge
