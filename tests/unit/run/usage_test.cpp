#include "run/usage.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "unit/scratch.hpp"

namespace connect_bridge {
namespace {

std::string scratch_file() {
  static int number = 0;
  return test::scratch_folder() + "usage" + std::to_string(++number) + ".json";
}

TEST(Usage, CountsByDayAndMonth) {
  Usage usage;
  usage.count({100, 10}, "2026-10-31");
  usage.count({150, 30}, "2026-11-01");
  usage.count({150, 30}, "2026-11-02");  // nothing more
  usage.count({160, 31}, "2026-11-02");
  EXPECT_EQ(usage.of_day("2026-10-31").sent, 100U);
  EXPECT_EQ(usage.of_day("2026-11-01").received, 20U);
  EXPECT_EQ(usage.of_month("2026-11").sent, 60U);
  EXPECT_EQ(usage.of_month("2026-12").sent, 0U);
}

TEST(Usage, KeepsTwoMonths) {
  Usage usage;
  for (std::uint64_t i = 0; i < 100; ++i)
    usage.count({i + 1, 0}, "2026-01-" + std::to_string(100 + i).substr(1));
  EXPECT_EQ(usage.of_month("2026-01").sent, Usage::kDaysMax);
}

TEST(UsageFile, GoesOnAfterARestart) {
  const std::string file = scratch_file();
  for (int start = 0; start < 2; ++start) {
    UsageFile usage;
    EXPECT_EQ(usage.open(file), "");
    EXPECT_EQ(usage.every_second({1000, 200}, "2026-11-22"), "");
    usage.close();
  }
  UsageFile usage;
  EXPECT_EQ(usage.open(file), "");
  EXPECT_EQ(usage.usage().of_day("2026-11-22").sent, 2000U);
  EXPECT_EQ(usage.usage().of_day("2026-11-22").received, 400U);
}

TEST(UsageFile, IsWrittenOnceAMinute) {
  const std::string file = scratch_file();
  UsageFile usage;
  EXPECT_EQ(usage.open(file), "");
  for (int second = 0; second < 59; ++second)
    EXPECT_EQ(usage.every_second({1000, 200}, "2026-11-22"), "");
  EXPECT_FALSE(std::filesystem::exists(file));
  EXPECT_EQ(usage.every_second({1000, 200}, "2026-11-22"), "");
  EXPECT_TRUE(std::filesystem::exists(file));
}

// Counts a minute of so many bytes of a run, and ends it as a loss of power does.
void count_a_minute(UsageFile& usage, std::uint64_t total) {
  for (int second = 0; second < 60; ++second)
    EXPECT_EQ(usage.every_second({total, 0}, "2026-11-22"), "");
}

std::uint64_t counted_in(const std::string& file) {
  Usage usage;
  EXPECT_TRUE(usage.read_text(test::content(file))) << file;
  return usage.of_day("2026-11-22").sent;
}

TEST(UsageFile, TheOneBeforeIsKept) {
  const std::string file = scratch_file();
  UsageFile usage;
  EXPECT_EQ(usage.open(file), "");
  count_a_minute(usage, 1000);
  EXPECT_FALSE(std::filesystem::exists(file + ".1"));
  for (std::uint64_t minute = 2; minute < 5; ++minute) {
    count_a_minute(usage, minute * 1000);
    EXPECT_EQ(counted_in(file), minute * 1000);
    EXPECT_EQ(counted_in(file + ".1"), (minute - 1) * 1000);
  }
  EXPECT_EQ(usage.every_second({4500, 0}, "2026-11-22"), "");
  usage.close();
  EXPECT_EQ(counted_in(file), 4500U);
  EXPECT_EQ(counted_in(file + ".1"), 3000U) << "the one before is not a second old";
  EXPECT_FALSE(std::filesystem::exists(file + ".1.part"));
}

// After a loss of power the new file can be empty, or full of zeros.
TEST(UsageFile, GoesOnFromTheOneBeforeWhenThePowerFailed) {
  for (const std::string& left : {std::string{}, std::string(100, '\0')}) {
    const std::string file = scratch_file();
    {
      UsageFile usage;
      EXPECT_EQ(usage.open(file), "");
      count_a_minute(usage, 1000);
      count_a_minute(usage, 3000);
    }
    std::ofstream{file} << left;
    UsageFile usage;
    EXPECT_EQ(usage.open(file), "usage_file: " + file +
                                    " is not valid; counting goes on from the one before, " + file +
                                    ".1, and the file is renamed to " + file + ".broken");
    EXPECT_EQ(usage.usage().of_day("2026-11-22").sent, 1000U);
    count_a_minute(usage, 500);
    EXPECT_EQ(counted_in(file), 1500U);
    EXPECT_EQ(counted_in(file + ".1"), 1000U);
  }
}

TEST(UsageFile, GoesOnFromTheOneBeforeWhenThereIsNoOther) {
  const std::string file = scratch_file();
  {
    UsageFile usage;
    EXPECT_EQ(usage.open(file), "");
    count_a_minute(usage, 1000);
    count_a_minute(usage, 3000);
  }
  std::filesystem::remove(file);
  UsageFile usage;
  EXPECT_EQ(
      usage.open(file),
      "usage_file: " + file + " is missing; counting goes on from the one before, " + file + ".1");
  EXPECT_EQ(usage.usage().of_day("2026-11-22").sent, 1000U);
}

TEST(UsageFile, WhereNeitherIsValidCountingBeginsAgain) {
  const std::string file = scratch_file();
  std::ofstream{file} << "{";
  std::ofstream{file + ".1"} << "{";
  UsageFile usage;
  EXPECT_EQ(usage.open(file), "usage_file: " + file +
                                  " is not valid; counting begins again at zero, and the file is "
                                  "renamed to " +
                                  file + ".broken");
  usage.close();
  EXPECT_EQ(UsageFile{}.open(file), "");
}

TEST(UsageFile, WhatCannotBeReadIsNotReplaced) {
  const std::string file = scratch_file();
  std::filesystem::create_symlink(file, file);  // to itself: not even root can read it
  UsageFile usage;
  EXPECT_NE(usage.open(file), "");
  for (int second = 0; second < 61; ++second)
    EXPECT_EQ(usage.every_second({1000, 200}, "2026-11-22"), "");
  usage.close();
  EXPECT_TRUE(std::filesystem::is_symlink(file));
  std::filesystem::remove(file);
}

TEST(UsageFile, WhatIsNotUnderstoodIsPutAside) {
  for (const char* text : {"", "{", "[]", "{}", R"({"days":[]})", R"({"days":{"today":[1,2]}})",
                           R"({"days":{"2026-11-22":[1]}})", R"({"days":{"2026-11-22":[1,-2]}})",
                           R"({"days":{"2026-11-22":"many"}})"}) {
    const std::string file = scratch_file();
    std::ofstream{file} << text;
    UsageFile usage;
    EXPECT_NE(usage.open(file), "") << text;
    EXPECT_EQ(test::content(file + ".broken"), text);
    usage.close();
    EXPECT_EQ(UsageFile{}.open(file), "");
  }
}

TEST(UsageFile, AFolderThatIsNotThereIsSaidOnce) {
  UsageFile usage;
  EXPECT_EQ(usage.open(test::scratch_folder() + "missing/usage.json"), "");
  int problems = 0;
  for (int second = 0; second < 300; ++second)
    problems += usage.every_second({1, 1}, "2026-11-22").empty() ? 0 : 1;
  EXPECT_EQ(problems, 1);
}

TEST(Usage, TodayIsADay) {
  EXPECT_EQ(today().size(), 10U);
}

}  // namespace
}  // namespace connect_bridge
