#include "run/machine_memory.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "unit/scratch.hpp"

namespace connect_bridge {
namespace {

constexpr std::uint64_t kMachine = 4ULL << 30;

struct MachineMemory : testing::Test {
  void write(const std::string& file, const std::string& text) const {
    std::filesystem::create_directories(std::filesystem::path(root + file).parent_path());
    std::ofstream(root + file) << text;
  }
  const std::string root = test::scratch_folder() + "memory" +
                           testing::UnitTest::GetInstance()->current_test_info()->name();
};

TEST_F(MachineMemory, WithoutGroupsItIsTheMachines) {
  EXPECT_EQ(memory_limit(kMachine, root), kMachine);
}

TEST_F(MachineMemory, TheLeastLimitOfAllGroupsAboveCounts) {
  write("/proc/self/cgroup", "0::/system.slice/connect_bridge.service\n");
  write("/sys/fs/cgroup/system.slice/connect_bridge.service/memory.max", "max\n");
  EXPECT_EQ(memory_limit(kMachine, root), kMachine);
  write("/sys/fs/cgroup/system.slice/memory.max", "1073741824\n");
  EXPECT_EQ(memory_limit(kMachine, root), 1ULL << 30);
  write("/sys/fs/cgroup/system.slice/connect_bridge.service/memory.max", "536870912\n");
  EXPECT_EQ(memory_limit(kMachine, root), 512ULL << 20);
}

TEST_F(MachineMemory, AContainerSeesItsOwnGroupAsTheRoot) {
  write("/proc/self/cgroup", "0::/\n");
  write("/sys/fs/cgroup/memory.max", "268435456\n");
  EXPECT_EQ(memory_limit(kMachine, root), 256ULL << 20);
}

TEST_F(MachineMemory, GroupsOfVersionOne) {
  write("/proc/self/cgroup", "5:cpu,cpuacct:/a\n4:memory:/docker/17\n");
  write("/sys/fs/cgroup/memory/memory.limit_in_bytes", "134217728\n");
  EXPECT_EQ(memory_limit(kMachine, root), 128ULL << 20);
}

}  // namespace
}  // namespace connect_bridge
