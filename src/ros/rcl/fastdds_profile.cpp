#include "ros/rcl/fastdds_profile.hpp"

#include <link.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string_view>
#include <system_error>

namespace connect_bridge::ros {
namespace {

// What differs between versions. Each refuses a file with the element of the other.
struct Version {
  const char* library;
  const char* variable;
  const char* period;
};
constexpr Version kVersions[] = {
    {"/libfastdds.so", "FASTDDS_DEFAULT_PROFILES_FILE", "heartbeat_period"},   // 3
    {"/libfastrtps.so", "FASTRTPS_DEFAULT_PROFILES_FILE", "heartbeatPeriod"},  // 2
};

int note_version(dl_phdr_info* info, std::size_t, void* found) {
  const std::string_view name(info->dlpi_name);
  for (const Version& version : kVersions)
    if (name.find(version.library) != std::string_view::npos)
      *static_cast<const Version**>(found) = &version;
  return 0;
}

// The one that is in this process; null: none.
const Version* loaded_version() {
  const Version* found = nullptr;
  dl_iterate_phdr(note_version, static_cast<void*>(&found));
  return found;
}

bool user_has_profiles() {
  for (const Version& version : kVersions)
    if (std::getenv(version.variable)) return true;
  return access("DEFAULT_FASTDDS_PROFILES.xml", F_OK) == 0 ||
         access("DEFAULT_FASTRTPS_PROFILES.xml", F_OK) == 0;
}

std::string text_for(const Version& version) {
  const std::string period = version.period;
  return R"(<?xml version="1.0" encoding="UTF-8"?>
<profiles xmlns="http://www.eprosima.com">
  <data_writer profile_name="connect_bridge" is_default_profile="true">
    <times><)" +
         period + "><sec>0</sec><nanosec>100000000</nanosec></" + period + R"(></times>
  </data_writer>
</profiles>
)";
}

// A new file with this text, readable for its owner alone; empty: it could not be written.
std::string new_file(const std::string& text) {
  std::error_code error;
  std::string path = std::filesystem::temp_directory_path(error) / "connect_bridge_XXXXXX.xml";
  const int file = error ? -1 : mkstemps(path.data(), 4);
  if (file < 0) return {};
  const bool written = write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  close(file);
  if (written) return path;
  unlink(path.c_str());
  return {};
}

}  // namespace

FastDdsProfile::FastDdsProfile(bool is_loaded) {
  const Version* const version = is_loaded ? loaded_version() : nullptr;
  if (!version || user_has_profiles()) return;
  path_ = new_file(text_for(*version));
  if (path_.empty()) return;
  variable_ = version->variable;
  setenv(variable_, path_.c_str(), 1);
}

FastDdsProfile::~FastDdsProfile() {
  if (path_.empty()) return;
  unsetenv(variable_);
  unlink(path_.c_str());
}

}  // namespace connect_bridge::ros
