#include "run/tar_gz.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <random>

#include "unit/scratch.hpp"

namespace connect_bridge {
namespace {

// What the usual tool reads of it, so that it is what everybody can open.
std::string read_by_tar(const std::string& arguments) {
  const std::string command = "tar " + arguments + " 2>&1";
  std::FILE* const pipe = ::popen(command.c_str(), "r");
  std::string text;
  for (int c = 0; (c = std::fgetc(pipe)) != EOF;) text += static_cast<char>(c);
  EXPECT_EQ(::pclose(pipe), 0) << text;
  return text;
}

TEST(TarGz, IsReadByTheUsualTool) {
  std::string large;
  std::mt19937 random{1};
  for (int i = 0; i < 300'000; ++i) large += static_cast<char>(random());
  const std::vector<PackedFile> files{
      {"a/one.txt", "hello\n"}, {"a/empty", ""}, {"a/large", large + std::string(1 << 20, 'x')}};
  const std::string archive = test::scratch_folder() + "report.tar.gz";
  const std::string bytes = tar_gz(files, 1'796'688'000);
  EXPECT_LT(bytes.size(), 400'000U);
  std::ofstream(archive, std::ios::binary) << bytes;
  EXPECT_EQ(read_by_tar("-tzf " + archive), "a/one.txt\na/empty\na/large\n");
  for (const auto& file : files)
    EXPECT_EQ(read_by_tar("-xzOf " + archive + " " + file.name), file.text);
}

}  // namespace
}  // namespace connect_bridge
