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
#include "ops/audit/audit_book.hpp"
#include "ops/audit/audit_file.hpp"
#include "ops/audit/audit_json.hpp"
#include "ops/audit/audit_log.hpp"
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

// ---- lines

TEST(AuditJson, ALine) {
  EXPECT_EQ(to_line(call_of("/s"), kTime),
            R"({"time":"2026-11-22T16:30:00.123Z","event":"call","link":1,"identity":"anna",)"
            R"("address":"10.0.0.5:40312","direction":"export","kind":"service","name":"/s",)"
            R"("type":"p/srv/T","rule":"tune"})"
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

TEST(AuditJson, WhatIsMissing) {
  EXPECT_EQ(to_line(AuditBook::LeftOut{"anna", AuditRank::kChannels, 7}, kTime),
            R"({"time":"2026-11-22T16:30:00.123Z","event":"left_out","identity":"anna",)"
            R"("of":"channels","lines":7})"
            "\n");
}

// ---- which lines are taken

Audit declined(const std::string& identity, std::uint64_t link = 1) {
  Audit line = call_of("/junk", link, identity);
  line.event = AuditEvent::kChannelRefused;
  return line;
}

// How many of so many are written; each is written at once.
int taken(AuditBook& book, const Audit& line, int count, Duration at) {
  int n = 0;
  for (int i = 0; i < count; ++i) {
    AuditBook::Account* const account = book.take(line, TimePoint(at));
    if (!account) continue;
    ++n;
    book.written(*account);
  }
  return n;
}

std::uint64_t left_out(AuditBook& book, Duration at) {
  std::uint64_t sum = 0;
  for (const auto& one : book.take_left_out(TimePoint(at))) sum += one.lines;
  return sum;
}

TEST(AuditBook, DeclinedOffersTakeNothingFromCalls) {
  AuditBook book;
  EXPECT_EQ(taken(book, declined("anna"), 100'000, 1s), 5000);
  EXPECT_EQ(taken(book, call_of("/arm/enable"), 50, 1s), 50);
  EXPECT_EQ(left_out(book, 11s), 95'000U);
  EXPECT_EQ(left_out(book, 30s), 0U);
}

TEST(AuditBook, RefusedCallsTakeNothingFromCalls) {
  AuditBook book;
  Audit refused = call_of("/s");
  refused.event = AuditEvent::kCallRefused;
  taken(book, refused, 100'000, 1s);
  EXPECT_EQ(taken(book, call_of("/s"), 50, 1s), 50);
}

TEST(AuditBook, OneIdentityTakesNothingFromAnother) {
  AuditBook book;
  EXPECT_EQ(taken(book, call_of("/s"), 20'000, 1s), 1000);
  EXPECT_EQ(taken(book, call_of("/s"), 20'000, 2s), 20);
  EXPECT_EQ(taken(book, call_of("/s", 2, "bert"), 1000, 2s), 1000);
}

TEST(AuditBook, WhatWaitsForTheDiskLeavesRoomForOthers) {
  AuditBook book;
  std::size_t waiting = 0;
  for (int i = 0; i < 40; ++i) {
    const Audit line = declined("one" + std::to_string(i));
    for (int k = 0; k < 4096; ++k) waiting += book.take(line, TimePoint(1s)) ? 1U : 0U;
  }
  EXPECT_LT(waiting, AuditBook::kWaitingMax + 40 * AuditBook::kSureMax);
  for (std::size_t i = 0; i < AuditBook::kSureMax; ++i)
    EXPECT_TRUE(book.take(declined("anna"), TimePoint(1s))) << i;
  EXPECT_TRUE(book.take(call_of("/s", 1, "anna"), TimePoint(1s)));
}

TEST(AuditBook, RoomComesBackWithWhatIsWritten) {
  AuditBook book;
  std::vector<AuditBook::Account*> waiting;
  const auto fill = [&] {
    for (int i = 0; i < 400; ++i) {
      const Audit line = declined("one" + std::to_string(i));
      for (int k = 0; k < 100; ++k)
        if (auto* account = book.take(line, TimePoint(1s))) waiting.push_back(account);
    }
  };
  fill();
  const std::size_t most = waiting.size();
  EXPECT_GT(most, AuditBook::kWaitingMax / 2);
  for (auto* account : std::exchange(waiting, {})) book.written(*account);
  fill();
  EXPECT_EQ(waiting.size(), most);
}

TEST(AuditBook, StrangersWriteLessThanAMegabyteAnHour) {
  AuditBook book;
  int lines = 0;
  for (int second = 0; second < 3600; ++second)
    for (int i = 0; i < 20; ++i)
      lines += taken(book, stranger(second * 20 + i), 1, std::chrono::seconds(1 + second));
  EXPECT_LT(lines, 1900);
  EXPECT_GT(lines, 1800);
  EXPECT_EQ(taken(book, call_of("/s"), 1, 3600s), 1);
}

TEST(AuditBook, ANoisyStrangerHidesNoOther) {
  AuditBook book;
  Audit noise = stranger(1);
  noise.address = "192.0.2.1:5000";
  EXPECT_EQ(taken(book, noise, 1000, 1s), 30);
  noise.address = "192.0.2.1:5001";
  EXPECT_EQ(taken(book, noise, 1000, 2s), 0);
  Audit other = stranger(2);
  other.address = "[2001:db8::1]:5000";
  EXPECT_EQ(taken(book, other, 50, 2s), 30);
}

// N13: several noisy addresses, and one network of IPv6 with many of them.
TEST(AuditBook, NoisyNetworksLeaveTheFirstLinesOfAnother) {
  AuditBook book;
  for (int second = 1; second <= 600; ++second) {
    for (int i = 0; i < 6; ++i) taken(book, stranger(i), 50, std::chrono::seconds(second));
    Audit host = stranger(0);
    host.address = "[2001:db8:0:" + std::to_string(second) + "::1]:5000";
    taken(book, host, 5, std::chrono::seconds(second));
  }
  Audit other = stranger(1000);
  EXPECT_EQ(taken(book, other, 5, 600s), 5);
  EXPECT_LE(taken(book, other, 100, 600s), 1) << "then it is one of the noisy ones";
}

TEST(AuditBook, LinesThatAreLeftOutAreCountedByNetwork) {
  AuditBook book;
  taken(book, stranger(1), 100, 1s);
  Audit other = stranger(2);
  other.address = "[2001:db8::7]:5000";
  taken(book, other, 40, 1s);
  const auto left = book.take_left_out(TimePoint(20s));
  ASSERT_EQ(left.size(), 1U);
  EXPECT_EQ(left[0].networks,
            (std::map<std::string, std::uint64_t>{{"10.0.0.1", 70}, {"2001:db8::", 10}}));
  EXPECT_THAT(
      to_line(left[0], kTime),
      HasSubstr(R"("of":"strangers","lines":80,"networks":{"10.0.0.1":70,"2001:db8::":10})"));
  for (int i = 0; i < 1000; ++i) taken(book, stranger(i), 40, 30s);
  EXPECT_LE(book.take_left_out(TimePoint(60s))[0].networks.size(), 17U);
}

TEST(AuditBook, ForgetsWhoIsQuiet) {
  AuditBook book;
  for (std::size_t i = 0; i < AuditBook::kAccountsMax; ++i)
    taken(book, call_of("/s", 1, std::to_string(i)), 1, 1s);
  const Audit one = call_of("/s", 1, "one");
  const Audit other = call_of("/s", 1, "other");
  EXPECT_EQ(taken(book, one, 2000, 1s), 1000);
  EXPECT_EQ(taken(book, other, 1, 1s), 0) << "the rest shares one pace";
  EXPECT_EQ(left_out(book, 60s), 1001U);
  EXPECT_EQ(left_out(book, 120s), 0U);
  EXPECT_EQ(taken(book, one, 2000, 120s), 1000);
  EXPECT_EQ(taken(book, other, 1, 120s), 1);
}

// ---- files

struct AuditFiles : testing::Test {
  const std::string file = test::scratch_folder() + "audit.jsonl";
  const std::string line = std::string(99, 'x') + "\n";
  void SetUp() override {
    for (const char* end : {"", ".1"}) std::filesystem::remove_all(file + end);
  }
};

TEST_F(AuditFiles, AreTheirOwnersAlone) {
  std::ofstream(file) << line;
  std::filesystem::permissions(file, std::filesystem::perms::all);
  AuditFile audit(file);
  EXPECT_EQ(audit.write(line), "");
  struct stat found {};
  ASSERT_EQ(::stat(file.c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777U, 0600U);
  EXPECT_EQ(test::content(file), line + line) << "it is continued";
}

// As logrotate does it.
TEST_F(AuditFiles, AreBegunAnewWhenOthersHaveRenamedThem) {
  AuditFile audit(file);
  ASSERT_EQ(audit.write(line), "");
  std::filesystem::rename(file, file + ".1");
  ASSERT_EQ(audit.write(line), "");
  EXPECT_EQ(test::content(file + ".1"), line);
  ASSERT_EQ(audit.write(line), "");
  EXPECT_EQ(test::content(file), line + line);
  std::filesystem::remove(file);
  std::filesystem::create_symlink(file + ".1", file);
  EXPECT_THAT(audit.write(line), HasSubstr("cannot open " + file));
  EXPECT_EQ(test::content(file + ".1"), line) << "no link is followed";
}

TEST_F(AuditFiles, HaveNoHalfLineWhenTheDiskIsFull) {
  AuditFile audit(file);
  ASSERT_EQ(audit.write(line), "");
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit full{line.size() + 50, before.rlim_max};
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &full), 0);
  const std::string problem = audit.write(line);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, handler);
  EXPECT_THAT(problem, HasSubstr("cannot write " + file + ": File too large"));
  EXPECT_EQ(test::content(file), line);
}

TEST_F(AuditFiles, AreRegularFiles) {
  std::filesystem::create_symlink("/dev/null", file);
  EXPECT_THAT(AuditFile(file).open(), HasSubstr("cannot open " + file));
  std::filesystem::remove(file);
  ASSERT_EQ(::mkfifo(file.c_str(), 0600), 0);
  EXPECT_NE(AuditFile(file).open(), "");
  EXPECT_THAT(AuditFile(file + ".1/audit").open(), HasSubstr("No such file"));
}

// ---- the log

// A disk that does what the test says, and what it was told of.
struct Disk {
  std::mutex mutex;
  std::condition_variable changed;
  std::string problem;  // of each write
  bool hangs = false;
  bool writing = false;
  std::string text;
  std::vector<std::string> told;

  AuditLog::Write write() {
    return [this](const std::string& lines) {
      std::unique_lock lock(mutex);
      writing = true;
      changed.notify_all();
      changed.wait(lock, [&] { return !hangs; });
      writing = false;
      if (problem.empty()) text += lines;
      return problem;
    };
  }
  AuditLog::Tell tell() {
    return [this](bool works, const std::string& what) {
      const std::lock_guard lock(mutex);
      told.push_back(works ? "works" : what);
      changed.notify_all();
    };
  }
  void set(const std::string& now) {
    const std::lock_guard lock(mutex);
    problem = now;
  }
  void wait_until_told(std::size_t count) {
    std::unique_lock lock(mutex);
    EXPECT_TRUE(changed.wait_for(lock, 20s, [&] { return told.size() >= count; }));
  }
};

TEST_F(AuditFiles, TheLogWritesWhatWaitsAtItsEnd) {
  {
    AuditLog log(file, [](bool, const std::string&) {});
    for (int i = 0; i < 1200; ++i) log.add(call_of("/s" + std::to_string(i)));
    EXPECT_GE(log.counts().left_out, 100U);
  }
  const std::string text = test::content(file);
  EXPECT_THAT(text, HasSubstr("/s999\""));
  EXPECT_THAT(text, HasSubstr("\"event\":\"left_out\",\"identity\":\"anna\",\"of\":\"calls\""));
}

TEST_F(AuditFiles, TheLogBeginsAnewWhenItsFileIsRenamed) {
  {
    AuditLog log(file, [](bool, const std::string&) {});
    log.add(call_of("/before"));
    for (int i = 0; i < 2000 && log.counts().lines == 0; ++i) std::this_thread::sleep_for(10ms);
    std::filesystem::rename(file, file + ".1");
    log.add(call_of("/after"));
  }
  EXPECT_THAT(test::content(file + ".1"), HasSubstr("\"/before\""));
  EXPECT_THAT(test::content(file), HasSubstr("\"/after\""));
}

TEST(AuditLog, WhatCannotBeWrittenWaits) {
  Disk disk;
  disk.problem = "cannot write it: No space left on device";
  AuditLog log(disk.write(), disk.tell());
  EXPECT_TRUE(log.add(call_of("/a")));
  disk.wait_until_told(1);
  EXPECT_THAT(log.counts().problem, HasSubstr("No space left"));
  EXPECT_TRUE(log.add(call_of("/b")));
  EXPECT_FALSE(log.add(call_of("/c"), true)) << "it may not be written at all";
  EXPECT_EQ(log.counts().left_out, 1U);
  disk.set("");
  disk.wait_until_told(2);
  EXPECT_TRUE(log.add(call_of("/d"), true));
  EXPECT_EQ(log.counts().problem, "");
  const std::lock_guard lock(disk.mutex);
  EXPECT_THAT(disk.told, testing::ElementsAre(HasSubstr("No space left"), "works"));
  EXPECT_THAT(disk.text, HasSubstr("\"/a\""));
  EXPECT_THAT(disk.text, testing::Not(HasSubstr("\"/c\"")));
}

TEST(AuditLog, IsWrittenLaterWhereMemoryLacks) {
  Disk disk;
  std::atomic<bool> lacks{true};
  const auto write = [&, to_disk = disk.write()](const std::string& lines) {
    if (lacks) throw std::bad_alloc();
    return to_disk(lines);
  };
  AuditLog log(write, disk.tell());
  EXPECT_TRUE(log.add(call_of("/a")));
  disk.wait_until_told(1);
  EXPECT_EQ(log.counts().problem, "no memory left");
  lacks = false;
  disk.wait_until_told(2);
  const std::lock_guard lock(disk.mutex);
  EXPECT_THAT(disk.text, HasSubstr("\"/a\""));
}

// Many lines are no fault of the disk.
TEST(AuditLog, AFloodIsNotBlamedOnTheDisk) {
  Disk disk;
  AuditLog log(disk.write(), disk.tell());
  for (int i = 0; i < 10; ++i)
    for (int k = 0; k < 4096; ++k) log.add(declined("flood", 1U + static_cast<unsigned>(i)));
  EXPECT_TRUE(log.add(call_of("/s"), true));
  EXPECT_GT(log.counts().left_out, 30'000U);
  EXPECT_EQ(log.counts().problem, "");
}

// The thread that writes says nothing then, so the one that adds does.
TEST(AuditLog, ADiskThatHangsIsToldOnce) {
  Disk disk;
  disk.hangs = true;
  AuditLog log(disk.write(), disk.tell());
  EXPECT_TRUE(log.add(call_of("/first")));
  std::unique_lock lock(disk.mutex);
  disk.changed.wait(lock, [&] { return disk.writing; });
  disk.changed.wait_for(lock, AuditLog::kHangTime + 100ms, [] { return false; });
  lock.unlock();
  EXPECT_FALSE(log.add(call_of("/s"), true));
  EXPECT_TRUE(log.add(call_of("/s")));
  EXPECT_THAT(log.counts().problem, HasSubstr("the disk has not taken a line"));
  lock.lock();
  EXPECT_THAT(disk.told, testing::ElementsAre(HasSubstr("the disk has not taken a line")));
  disk.hangs = false;
  disk.changed.notify_all();
  lock.unlock();
  disk.wait_until_told(2);
  EXPECT_EQ(log.counts().problem, "");
}

}  // namespace
}  // namespace connect_bridge
