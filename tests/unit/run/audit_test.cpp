// The audit log: its lines, which of them are written, and its files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <condition_variable>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <sstream>

#include "core/base/json.hpp"
#include "run/audit_book.hpp"
#include "run/audit_file.hpp"
#include "run/audit_json.hpp"
#include "run/audit_log.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge {
namespace {

using testing::HasSubstr;
using namespace std::chrono_literals;

constexpr auto kTime = std::chrono::system_clock::time_point(1795365000123ms);

std::size_t lines_of(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

Audit call_of(const std::string& name, std::uint64_t link = 1,
              const std::string& identity = "anna") {
  Audit line;
  line.event = AuditEvent::kCall;
  line.link = {link};
  line.identity = identity;
  line.address = "10.0.0.5:40312";
  line.channel = {Direction::kExport, InterfaceKind::kService, name, "p/srv/T", "tune"};
  return line;
}

Audit stranger(int n) {
  Audit line;
  line.event = AuditEvent::kRefused;
  line.address = "10.0." + std::to_string(n / 256) + "." + std::to_string(n % 256) + ":1";
  line.code = "login_refused";
  return line;
}

AuditBook::Entry at(Audit line, Duration when) {
  return {std::move(line), kTime + std::chrono::duration_cast<std::chrono::microseconds>(when),
          TimePoint(when)};
}

// ---- lines

TEST(AuditJson, ALine) {
  EXPECT_EQ(to_line(call_of("/s"), kTime, 3),
            R"({"time":"2026-11-22T16:30:00.123Z","event":"call","link":1,"identity":"anna",)"
            R"("address":"10.0.0.5:40312","direction":"export","kind":"service","name":"/s",)"
            R"("type":"p/srv/T","rule":"tune","times":3})"
            "\n");
}

TEST(AuditJson, APeerForgesNothing) {
  Audit line = call_of("/s\"}\n{\"event\":\"login\"");
  line.identity = "an\xff\x1b[2Jna\u202e\r\n";
  line.reason = std::string(100'000, 'x');
  line.groups.assign(1000, "g");
  const std::string text = to_line(line, kTime);
  EXPECT_EQ(lines_of(text), 1U);
  EXPECT_EQ(text.back(), '\n');
  EXPECT_LT(text.size(), 2000U);
  EXPECT_TRUE(
      std::all_of(text.begin(), text.end() - 1, [](char c) { return c >= ' ' && c < 127; }));
  const auto json = Json::parse(text);
  EXPECT_EQ(json["event"], "call");
  EXPECT_EQ(json["name"], "/s\"}\n{\"event\":\"login\"");
}

// ---- what is written

TEST(AuditBook, WhatRepeatsIsCounted) {
  AuditBook book;
  EXPECT_THAT(book.add(at(call_of("/s"), 0s)), HasSubstr("\"name\":\"/s\""));
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(book.add(at(call_of("/s"), 1s)), "");
  EXPECT_NE(book.add(at(call_of("/other"), 1s)), "");
  EXPECT_NE(book.add(at(call_of("/s", 2, "bert"), 1s)), "");
  EXPECT_EQ(book.take_due(TimePoint(9s)), "");
  const std::string due = book.take_due(TimePoint(11s));
  EXPECT_EQ(lines_of(due), 1U);
  EXPECT_THAT(due, HasSubstr("\"times\":1001"));
  EXPECT_NE(book.add(at(call_of("/s"), 12s)), "");
  EXPECT_EQ(book.add(at(call_of("/s"), 12s)), "");
  EXPECT_THAT(book.take_due(TimePoint(12s), true), HasSubstr("\"times\":2"));
  EXPECT_EQ(book.lost(), 0U);
}

// The longest lines that strangers can cause, each more than once.
TEST(AuditBook, StrangersHaveAPaceAndTakeNothingFromOthers) {
  AuditBook book;
  std::size_t bytes = 0;
  int n = 0;
  for (int second = 0; second < 3600; ++second) {
    for (int i = 0; i < 18; ++i) {
      Audit line = stranger(n++);
      for (int k = 0; k < 127; ++k) line.node += "\u00e9";
      line.reason = "the login method '" + line.node.substr(0, 32) + "' is not that of this server";
      bytes += book.add(at(line, std::chrono::seconds(second))).size();
      bytes += book.add(at(line, std::chrono::seconds(second))).size();
    }
    bytes += book.take_due(TimePoint(std::chrono::seconds(second))).size();
  }
  EXPECT_GT(bytes, 300'000U);
  EXPECT_LT(bytes, 1'000'000U) << "in an hour";
  EXPECT_GT(book.lost(), 60'000U);
  EXPECT_NE(book.add(at(call_of("/s"), 3600s)), "");
}

// A proxy may send a client's address without its port.
TEST(AuditBook, AStrangerIsAnAddressWithoutItsPort) {
  AuditBook book;
  const auto writes = [&](const char* address) {
    Audit line = stranger(0);
    line.address = address;
    return !book.add(at(line, 0s)).empty();
  };
  for (const char* one : {"192.0.2.5", "192.0.2.6:1", "[2001:db8::5]", "[2001:db8::6]:1"})
    EXPECT_TRUE(writes(one)) << one;
  for (const char* same : {"192.0.2.5:1", "192.0.2.6", "192.0.2.6:2", "[2001:db8::6]:2"})
    EXPECT_FALSE(writes(same)) << same;
}

TEST(AuditBook, OneIdentityTakesNothingFromAnother) {
  AuditBook book;
  std::string written;
  for (int i = 0; i < 20'000; ++i) written += book.add(at(call_of("/" + std::to_string(i)), 0s));
  EXPECT_EQ(lines_of(written), std::size_t{AuditBook::kIdentityAtOnce});
  EXPECT_EQ(book.lost(), 20'000U - AuditBook::kIdentityAtOnce);
  const auto next = book.add(at(call_of("/s", 2, "bert"), 0s));
  EXPECT_THAT(next, HasSubstr("{\"time\":\"2026-11-22T16:30:00.123Z\",\"event\":\"lost\",\"times\":"
                              "15000}\n"));
  EXPECT_THAT(next, HasSubstr("bert"));
}

// ---- files

struct AuditFiles : testing::Test {
  const std::string file = test::scratch_folder() + "audit.jsonl";
  const std::string line = std::string(99, 'x') + "\n";
  void SetUp() override {
    for (const char* end : {"", ".1", ".2", ".3"}) std::filesystem::remove_all(file + end);
  }
};

TEST_F(AuditFiles, AreTheirOwnersAlone) {
  std::ofstream(file) << line;
  std::filesystem::permissions(file, std::filesystem::perms::all);
  AuditFile audit({file, 1000, 2});
  EXPECT_EQ(audit.write(line).problem, "");
  struct stat found {};
  ASSERT_EQ(::stat(file.c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777U, 0600U);
  EXPECT_EQ(test::content(file), line + line) << "it is continued";
}

TEST_F(AuditFiles, RotateAndAreBounded) {
  AuditFile audit({file, 1000, 2});
  for (int i = 0; i < 100; ++i) ASSERT_EQ(audit.write(line).problem, "");
  EXPECT_EQ(test::content(file).size(), 1000U);
  EXPECT_EQ(test::content(file + ".1").size(), 1000U);
  EXPECT_EQ(test::content(file + ".2").size(), 1000U);
  EXPECT_FALSE(std::filesystem::exists(file + ".3"));
}

TEST_F(AuditFiles, WithoutOlderOnesItBeginsAnew) {
  AuditFile audit({file, 1000, 0});
  for (int i = 0; i < 15; ++i) ASSERT_EQ(audit.write(line).problem, "");
  EXPECT_EQ(test::content(file).size(), 500U);
  EXPECT_FALSE(std::filesystem::exists(file + ".1"));
}

// As where its folder belongs to somebody else.
TEST_F(AuditFiles, WithoutOlderOnesTheFileGrowsToTheSizeOfAll) {
  std::filesystem::create_directories(file + ".1/in_the_way");
  AuditFile audit({file, 1000, 1});
  for (int i = 0; i < 20; ++i) {
    const auto written = audit.write(line);
    ASSERT_TRUE(written.whole) << i;
    ASSERT_EQ(written.problem.empty(), i < 10) << i << written.problem;
  }
  const auto written = audit.write(line);
  EXPECT_FALSE(written.whole);
  EXPECT_THAT(written.problem, HasSubstr("cannot rename " + file));
  EXPECT_EQ(test::content(file).size(), 2000U);
  std::filesystem::remove_all(file + ".1");
  EXPECT_EQ(audit.write(line).problem, "");
  EXPECT_EQ(test::content(file), line);
}

TEST_F(AuditFiles, AreMadeAnewWhenOthersTakeThemAway) {
  AuditFile audit({file, 1000, 2});
  ASSERT_EQ(audit.write(line).problem, "");
  std::filesystem::rename(file, file + ".3");
  ASSERT_EQ(audit.write(line).problem, "");
  EXPECT_EQ(test::content(file), line);
}

// As by `copytruncate` of logrotate, or by another process that writes to it.
TEST_F(AuditFiles, HaveTheLengthThatOthersGaveThem) {
  AuditFile audit({file, 1000, 2});
  for (int i = 0; i < 5; ++i) ASSERT_EQ(audit.write(line).problem, "");
  std::filesystem::resize_file(file, line.size());
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit full{line.size() + 50, before.rlim_max};
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &full), 0);
  const auto cut = audit.write(line);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, handler);
  EXPECT_FALSE(cut.whole);
  EXPECT_EQ(test::content(file), line) << "neither half a line nor zeros";
  std::ofstream(file, std::ios::app) << "of others\n";
  std::filesystem::resize_file(file, 950);
  ASSERT_EQ(audit.write(line).problem, "");
  EXPECT_EQ(test::content(file), line) << "what others have written counts for its size";
}

TEST_F(AuditFiles, AreRegularFiles) {
  std::filesystem::create_symlink("/dev/null", file);
  EXPECT_THAT(AuditFile({file, 1000, 2}).open(), HasSubstr("cannot open " + file));
  std::filesystem::remove(file);
  ASSERT_EQ(::mkfifo(file.c_str(), 0600), 0);
  EXPECT_NE(AuditFile({file, 1000, 2}).open(), "");
  EXPECT_THAT(AuditFile({file + ".1/audit", 1000, 2}).open(), HasSubstr("No such file"));
}

// ---- the log

TEST_F(AuditFiles, TheLogWritesWhatWaitsAtItsEnd) {
  {
    AuditLog log({file, 1 << 20, 2}, [](bool, const std::string&) {});
    for (int i = 0; i < 100; ++i) log.add(call_of("/s" + std::to_string(i)));
    for (int i = 0; i < 9; ++i) log.add(call_of("/s0"));
  }
  const std::string text = test::content(file);
  EXPECT_EQ(lines_of(text), 101U);
  EXPECT_THAT(text, HasSubstr("\"times\":10"));
}

TEST_F(AuditFiles, WhatCannotBeWrittenIsCountedAndToldOnce) {
  std::filesystem::create_directory(file);
  std::mutex mutex;
  std::vector<std::string> told;
  AuditLog log({file, 1 << 20, 2}, [&](bool works, const std::string& problem) {
    const std::lock_guard lock(mutex);
    told.push_back(works ? "works" : problem);
  });
  std::condition_variable nobody;  // tells: there is no event for a line that was not written
  const auto wait_for = [&](auto&& is_so) {
    for (int i = 0; i < 3000 && !is_so(); ++i) {
      std::mutex own;
      std::unique_lock lock(own);
      nobody.wait_for(lock, 10ms);
    }
    EXPECT_TRUE(is_so());
  };
  log.add(call_of("/a"));
  wait_for([&] { return log.counts().lost == 1; });
  log.add(call_of("/b"));
  wait_for([&] { return log.counts().lost == 2; });
  EXPECT_THAT(log.counts().problem, HasSubstr(file));
  std::filesystem::remove(file);
  log.add(call_of("/c"));
  wait_for([&] { return log.counts().lines == 1; });
  EXPECT_EQ(log.counts().problem, "");
  wait_for([&] {
    const std::lock_guard lock(mutex);
    return told.size() == 2;
  });
  EXPECT_EQ(told.back(), "works");
}

// The thread that writes says nothing then, so the one that adds does.
TEST(AuditLog, ADiskThatHangsIsToldOnce) {
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<std::string> told;
  bool begun = false;
  bool hangs = true;
  const auto write = [&](const std::string&) {
    std::unique_lock lock(mutex);
    begun = true;
    changed.notify_all();
    changed.wait(lock, [&] { return !hangs; });
    return AuditFile::Written{true, ""};
  };
  AuditLog log(AuditLog::Write(write), [&](bool works, const std::string& problem) {
    const std::lock_guard lock(mutex);
    told.push_back(works ? "works" : problem);
    changed.notify_all();
  });
  log.add(call_of("/first"));
  {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return begun; });
  }
  for (std::size_t i = 0; i < AuditLog::kWaitingMax; ++i) log.add(call_of("/s"));
  EXPECT_EQ(log.counts().lost, 0U);
  for (int i = 0; i < 3; ++i) log.add(call_of("/s"));
  EXPECT_EQ(log.counts().lost, 3U);
  EXPECT_THAT(log.counts().problem, HasSubstr("does not keep up"));
  std::unique_lock lock(mutex);
  EXPECT_THAT(told, testing::ElementsAre(HasSubstr("its lines are lost: the disk does not")));
  hangs = false;
  changed.notify_all();
  changed.wait(lock, [&] { return told.size() == 2; });
  EXPECT_EQ(told.back(), "works");
  lock.unlock();
  EXPECT_EQ(log.counts().problem, "");
}

}  // namespace
}  // namespace connect_bridge
