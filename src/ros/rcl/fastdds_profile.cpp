#include "ros/rcl/fastdds_profile.hpp"

#include <link.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "ros/rcl/shared_memory.hpp"

namespace connect_bridge::ros {
namespace {

// Differences between versions 2 and 3. Each refuses a file with the other's element.
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

// The version that is loaded in this process; null: none.
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

// True if Fast DDS uses shared memory. rmw_fastrtps brings its own transports, shared memory among
// them, if the discovery range is this machine alone. Fast DDS then ignores its variable for the
// built-in transports.
bool shares_memory() {
  const char* const transports = std::getenv("FASTDDS_BUILTIN_TRANSPORTS");
  const char* const range = std::getenv("ROS_AUTOMATIC_DISCOVERY_RANGE");
  const bool local = range != nullptr && std::string_view(range) == "LOCALHOST";
  if (transports == nullptr || local) return true;
  const std::string_view chosen(transports);
  return !chosen.starts_with("UDP") && chosen != "NONE";
}

// The limit is an eighth of the free memory: other participants need room, too, and a segment
// without memory behind it ends the process.
bool has_room(std::size_t segment_bytes) {
  struct statvfs memory {};
  return std::getenv("FASTDDS_BUILTIN_TRANSPORTS") == nullptr &&
         statvfs("/dev/shm", &memory) == 0 &&
         memory.f_bavail * memory.f_frsize / 8 >= segment_bytes;
}

std::string segment_of(std::size_t bytes) {
  return R"(  <transport_descriptors>
    <transport_descriptor>
      <transport_id>connect_bridge</transport_id>
      <type>SHM</type>
      <segment_size>)" +
         std::to_string(bytes) + R"(</segment_size>
    </transport_descriptor>
  </transport_descriptors>
)";
}

std::string text_for(const Version& version, std::size_t segment_bytes) {
  const std::string period = version.period;
  const bool has_segment = segment_bytes > 0 && has_room(segment_bytes);
  // User transports come before the built-in ones.
  const char* const transports =
      has_segment ? "<userTransports><transport_id>connect_bridge</transport_id></userTransports>"
                  : "";
  return R"(<?xml version="1.0" encoding="UTF-8"?>
<profiles xmlns="http://www.eprosima.com">
)" + (has_segment ? segment_of(segment_bytes) : "") +
         R"(  <participant profile_name="connect_bridge" is_default_profile="true">
    <rtps>)" +
         transports + R"(<builtin><discovery_config>
      <leaseAnnouncement><sec>0</sec><nanosec>500000000</nanosec></leaseAnnouncement>
    </discovery_config></builtin></rtps>
  </participant>
  <data_writer profile_name="connect_bridge" is_default_profile="true">
    <times><)" +
         period + "><sec>0</sec><nanosec>100000000</nanosec></" + period + R"(></times>
  </data_writer>
</profiles>
)";
}

// Creates a new file with this text, readable only for its owner. Empty: `problem` has the reason.
// A file without a name (memfd_create) will not do: Fast DDS 3 needs a path for realpath().
std::string new_file(const std::string& text, std::string& problem) {
  std::error_code error;
  const auto temporary = std::filesystem::temp_directory_path(error);
  const std::filesystem::path folders[] = {error ? "/tmp" : temporary, "/dev/shm"};
  for (const auto& folder : folders) {
    std::string path = folder / "connect_bridge_XXXXXX.xml";
    const int file = mkstemps(path.data(), 4);
    if (file >= 0) errno = ENOSPC;  // for a text that is written only in part
    const bool written =
        file >= 0 && write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size());
    problem += (problem.empty() ? "" : ", ") + folder.string() + ": " +
               std::generic_category().message(errno);
    if (file >= 0) close(file);
    if (written) return path;
    if (file >= 0) unlink(path.c_str());
  }
  return {};
}

// The domain id, read as rcl reads it.
unsigned int domain() {
  const char* variable = std::getenv("ROS_DOMAIN_ID");
  return variable ? static_cast<unsigned int>(std::strtoul(variable, nullptr, 10)) : 0;
}

}  // namespace

FastDdsProfile::FastDdsProfile(bool is_loaded, std::size_t segment_bytes) {
  const Version* const version = is_loaded ? loaded_version() : nullptr;
  if (!version || user_has_profiles()) return;
  if (shares_memory()) {
    const std::string of_users = problem_of_users(shared_files(), geteuid(), domain());
    if (!of_users.empty()) problems_.push_back(of_users);
  }
  std::string problem;
  path_ = new_file(text_for(*version, segment_bytes), problem);
  if (path_.empty()) {
    problems_.push_back("cannot write a file with settings for Fast DDS (" + problem +
                        "): beside large messages commands may be up to 3 s late, and images may "
                        "be lost; TMPDIR can name another folder");
    return;
  }
  variable_ = version->variable;
  setenv(variable_, path_.c_str(), 1);
}

void ask_for_whole_graph(bool is_loaded) {
  if (!is_loaded || !loaded_version() || getenv("ROS_DISCOVERY_SERVER") == nullptr) return;
  setenv("ROS_SUPER_CLIENT", "TRUE", 0);
}

FastDdsProfile::~FastDdsProfile() {
  if (path_.empty()) return;
  unsetenv(variable_);
  unlink(path_.c_str());
}

}  // namespace connect_bridge::ros
