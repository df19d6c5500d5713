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
