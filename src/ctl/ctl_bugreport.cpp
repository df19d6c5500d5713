#include <fcntl.h>
#include <fmt/chrono.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <iterator>
#include <memory>
#include <regex>
#include <string>
#include <vector>

#include "access/login/runtime_folder.hpp"
#include "access/pairing/pairing_folder.hpp"
#include "config/document.hpp"
#include "config/key_search.hpp"
#include "ctl/ctl_asked.hpp"
#include "ctl/ctl_commands.hpp"
#include "ctl/ctl_programs.hpp"
#include "ctl/scrub.hpp"
#include "ctl/status_text.hpp"
#include "ctl/system_facts.hpp"
#include "ros/parameters/parameter_file.hpp"
#include "run/exit_codes.hpp"

namespace {

using namespace connect_bridge;
namespace fs = std::filesystem;

// A part of the report, under its name.
struct Section {
  std::string name;
  std::string text;
};

struct BugreportOrder {
  std::vector<std::string> files;  // parameter files beside those of running programs
  std::string output;              // empty: a name with the time, in the present folder
};

constexpr const char* kNodes[] = {"/connect_server", "/connect_client"};
constexpr std::size_t kLogBytes = 512 << 10;  // bytes from the end of each log
constexpr std::size_t kLogsMax = 6;
constexpr std::size_t kSecretFileBytesMax = 64 << 10;

constexpr char kAbout[] =
    R"(What is in here, for whoever is asked for help with ROS2 Connect:

versions.txt    of this tool; those of running programs are in their status
system.txt      of this machine: kernel, memory, settings, interfaces, variables of ROS
programs.txt    command lines of running servers and clients of this user
config/         parameter files, as they are understood: without comments
doctor.txt      what `ctl doctor` says of them
status/         what running programs tell (docs/status.md), with addresses and names of people
logs/           the ends of the newest log files

Tokens, passwords, private keys, and users and queries in addresses are replaced by (hidden).
Look through it before it is sent: topics, addresses and names of people are not.
Each part begins with a line of ==== and its name.
)";

// A parameter file, and the folders to which its relative names belong: those of the programs that
// use it, or of this one.
struct ConfigurationFile {
  fs::path file;
  std::vector<fs::path> folders;
  bool is_left = false;  // of a pairing: no running program uses it
};

void add_once(std::vector<ConfigurationFile>& files, const fs::path& file, const fs::path& folder) {
  std::error_code none;
  const fs::path whole = fs::absolute(folder / file, none).lexically_normal();
  if (!fs::is_regular_file(whole, none)) return;
  const auto known =
      std::find_if(files.begin(), files.end(), [&](const auto& one) { return one.file == whole; });
  if (known == files.end()) return files.push_back({whole, {folder}});
  known->folders.push_back(folder);
}

// The parameters of a program's files and command line; the last one that names a key has it.
ParameterMap given_to(const Program& program) {
  ParameterMap given;
  std::error_code none;
  for (const std::string& name : program.parameter_files()) {
    const fs::path file = program.folder / name;
    if (!fs::is_regular_file(file, none)) continue;
    for (const auto& section : ros::read_parameter_file(file).sections)
      if (ros::node_name_matches(section.node, program.node))
        for (const auto& [key, value] : section.parameters) given.insert_or_assign(key, value);
  }
  for (const auto& [key, value] : program.parameters()) given.insert_or_assign(key, value);
  return given;
}

std::vector<ConfigurationFile> parameter_files(const BugreportOrder& order,
                                               const std::vector<Program>& programs) {
  std::vector<ConfigurationFile> files;
  for (const auto& file : order.files) add_once(files, file, {});
  for (const Program& program : programs)
    for (const auto& file : program.parameter_files()) add_once(files, file, program.folder);
  for (const char* node : kNodes) {
    const std::size_t before = files.size();
    add_once(files, PairingFolder(node).parameter_file(), {});
    if (files.size() == before) continue;
    files.back().is_left = std::none_of(programs.begin(), programs.end(), [&](const auto& one) {
      return one.node == node && goes_by_pairing(given_to(one));
    });
  }
  return files;
}

// Secrets in files of tokens and keys may stand elsewhere by mistake.
void learn_files(Scrubber& scrubber, const ParameterMap& parameters, const fs::path& folder) {
  constexpr std::size_t kWordMin = 12;  // shorter ones are names of members
  for (const char* key :
       {"auth.token_file", "auth.jwt_keys", "listen.relay.token_file", "tls.private_key"}) {
    const std::string text = content_of(folder / string_at(parameters, key), kSecretFileBytesMax);
    for (std::size_t at = 0; at < text.size();) {
      const std::size_t end = std::min(text.find_first_of(" \t\r\n\"',:{}[]", at), text.size());
      if (end - at >= kWordMin) scrubber.learn(std::string_view(text).substr(at, end - at));
      at = end + 1;
    }
  }
}

// An unknown key in a section of ours is a mistake, and its value may be a secret. In another
// program's section it is that program's key.
bool is_ours(const std::string& section, const std::vector<Program>& programs) {
  const auto matches = [&](const std::string& node) {
    return ros::node_name_matches(section, node);
  };
  return std::any_of(std::begin(kNodes), std::end(kNodes), matches) ||
         std::any_of(programs.begin(), programs.end(),
                     [&](const Program& program) { return matches(program.node); });
}

// A file that cannot be parsed is left out, since it may contain anything.
std::vector<Section> configuration(const std::vector<ConfigurationFile>& files,
                                   const std::vector<Program>& programs, Scrubber& scrubber) {
  for (const Program& program : programs) {
    scrubber.learn(program.parameters());
    learn_files(scrubber, program.parameters(), program.folder);
  }
  std::vector<Section> packed;
  for (const auto& [file, folders, is_left] : files) {
    auto read = ros::read_parameter_file(file);
    std::string text = "# " + file.string() + "\n";
    if (is_left) text += "# a pairing; not used by a running program\n";
    if (!read.problems.empty())
      text += "# it cannot be read as a parameter file: ctl check says why\n";
    for (auto& section : read.sections) {
      if (read.sections.size() > 1 && !is_ours(section.node, programs))
        std::erase_if(section.parameters,
                      [](const auto& entry) { return find_key(entry.first) == nullptr; });
      if (section.parameters.empty()) continue;
      scrubber.learn(section.parameters);
      for (const auto& folder : folders) learn_files(scrubber, section.parameters, folder);
      text += "\n# " + section.node + "\n" + parameters_to_show(section.parameters);
    }
    packed.push_back({"config/" + std::to_string(packed.size() + 1) + ".yaml", text});
  }
  return packed;
}

fs::path log_folder() {
  const char* const given = std::getenv("ROS_LOG_DIR");
  if (given != nullptr && *given != '\0') return given;
  return fs::path(ros_home()) / "log";
}

// rcl names the log of any program with such a name "server_PID_TIME.log".
bool may_be_our_log(const std::string& name) {
  static const std::regex form("(server|client)_[0-9]+_[0-9]+[.]log");
  return std::regex_match(name, form);
}

bool is_log_of(const std::vector<Program>& programs, const std::string& name,
               const std::string& text) {
  // This matches programs that have exited, too, in any namespace.
  const auto logged_by = [&](std::string logger) {
    std::replace(logger.begin(), logger.end(), '/', '.');
    return text.find("[" + logger.substr(1) + "]") != std::string::npos ||
           text.find(logger + "]") != std::string::npos;
  };
  return std::any_of(std::begin(kNodes), std::end(kNodes), logged_by) ||
         std::any_of(programs.begin(), programs.end(), [&](const Program& program) {
           return logged_by(program.node) ||
                  name.find("_" + std::to_string(program.process) + "_") != std::string::npos;
         });
}

std::vector<Section> logs(const std::vector<Program>& programs) {
  std::vector<std::pair<fs::file_time_type, fs::path>> found;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(log_folder(), none))
    if (entry.is_regular_file(none) && may_be_our_log(entry.path().filename()))
      found.emplace_back(entry.last_write_time(none), entry.path());
  std::sort(found.rbegin(), found.rend());
  std::vector<Section> packed;
  for (const auto& [time, file] : found) {
    const std::string text = content_of(file, kLogBytes);
    if (packed.size() < kLogsMax && is_log_of(programs, file.filename(), text))
      packed.push_back({"logs/" + file.filename().string(), text});
  }
  return packed;
}

std::vector<Section> statuses(const std::vector<Program>& programs) {
  std::vector<Section> packed;
  for (const Program& program : programs) {
    const std::string name = "status/" + fs::path(program.socket).stem().string();
    Asked asked(program.socket, "/api/status");
    if (!asked.problem().empty()) {
      packed.push_back({name + ".txt", asked.problem() + "\n"});
      continue;
    }
    const auto json = read_status_in_order(asked.rest());
    packed.push_back({name + ".json", json.is_object() ? json.dump(1) + "\n" : "no status\n"});
  }
  return packed;
}

std::string command_lines(const std::vector<Program>& programs) {
  if (programs.empty()) return "no server or client of this user runs here\n";
  std::string text;
  for (const Program& program : programs) {
    text += std::to_string(program.process) + ": " + program.command_line() + "\n";
  }
  return text;
}

// Writes a new file for its owner alone. Returns the problem; empty: none.
std::string write_new(const std::string& file, const std::string& bytes) {
  const int handle = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (handle < 0) return std::strerror(errno);
  std::FILE* const out = ::fdopen(handle, "wb");
  const bool whole = std::fwrite(bytes.data(), 1, bytes.size(), out) == bytes.size();
  return std::fclose(out) == 0 && whole ? "" : std::strerror(errno);
}

int run_bugreport(const BugreportOrder& order) {
  std::vector<Program> programs;
  for (const auto& socket : status_sockets()) programs.emplace_back(socket);
  Scrubber scrubber;
  if (const char* const token = std::getenv("CONNECT_BRIDGE_TOKEN")) scrubber.learn(token);
  std::vector<Section> parts{{"about.txt", kAbout},
                             {"versions.txt", version_text() + "\n"},
                             {"system.txt", system_facts()},
                             {"programs.txt", command_lines(programs)},
                             {"doctor.txt", doctor_report()}};
  for (auto&& more : {configuration(parameter_files(order, programs), programs, scrubber),
                      statuses(programs), logs(programs)})
    parts.insert(parts.end(), more.begin(), more.end());
  std::string text;
  for (const Section& part : parts) {
    const std::string shown = scrubber.scrubbed(part.text);
    std::printf("  %s, %zu bytes\n", part.name.c_str(), shown.size());
    text += "==== " + part.name + "\n" + shown + (shown.ends_with('\n') ? "" : "\n");
  }
  const std::string output =
      order.output.empty()
          ? fmt::format("connect-bugreport-{:%Y%m%d-%H%M%S}.txt", fmt::gmtime(std::time(nullptr)))
          : order.output;
  if (const std::string problem = write_new(output, text); !problem.empty())
    return complain(output + ": " + problem, kExitConfiguration);
  std::printf(
      "%s\nLook through it before it is sent: topics, addresses and names of people are in "
      "it.\n",
      output.c_str());
  return 0;
}

}  // namespace

void add_bugreport_command(CLI::App& app, int& exit_code) {
  const auto order = std::make_shared<BugreportOrder>();
  auto* report = app.add_subcommand(
      "bugreport",
      "Gather what helps to find a fault into one file: configuration, status, logs, versions, "
      "facts of this machine; without tokens, passwords and keys");
  report->footer("Exit code: 0 if it is written, 2 if not.");
  report->add_option("--config", order->files,
                     "A parameter file; several times. Those of programs that run, and of "
                     "pairings, are found without it");
  report->add_option("--output", order->output,
                     "The file to write. Without it: connect-bugreport-TIME.txt here");
  report->callback([order, &exit_code] { exit_code = run_bugreport(*order); });
}
