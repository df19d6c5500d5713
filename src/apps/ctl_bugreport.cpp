#include "apps/ctl_bugreport.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "apps/ctl_asked.hpp"
#include "auth/runtime_folder.hpp"
#include "config/document.hpp"
#include "ros/parameters/parameter_file.hpp"
#include "run/exit_codes.hpp"
#include "run/pairing_folder.hpp"
#include "run/scrub.hpp"
#include "run/system_facts.hpp"
#include "run/tar_gz.hpp"

namespace {

namespace fs = std::filesystem;
using connect_bridge::PackedFile;
using connect_bridge::Scrubber;

constexpr std::size_t kLogBytes = 512 << 10;  // the end of each
constexpr std::size_t kLogsMax = 6;
constexpr std::size_t kSecretFileBytesMax = 64 << 10;

constexpr char kAbout[] =
    R"(What is in here, for whoever is asked for help with ROS2 Connect:

versions.txt    of this tool; those of running programs are in their status
system.txt      of this machine: kernel, memory, settings, interfaces, variables of ROS
programs.txt    command lines of running servers and clients of this user
config/         parameter files, as they are understood: without comments
status/         what running programs tell (docs/status.md), with addresses and names of people
logs/           the ends of the newest log files

Tokens, passwords, private keys, and users and queries in addresses are replaced by (hidden).
Look through it before it is sent: topics, addresses and names of people are not.
)";

std::string content_of(const fs::path& file, std::size_t end_bytes) {
  std::ifstream in(file, std::ios::binary);
  in.seekg(0, std::ios::end);
  const auto size = static_cast<std::size_t>(std::max<std::streamoff>(0, in.tellg()));
  in.seekg(static_cast<std::streamoff>(size > end_bytes ? size - end_bytes : 0));
  std::ostringstream all;
  all << in.rdbuf();
  std::string text = all.str();
  // A line that is cut could hide a secret from who looks for whole ones.
  return size > end_bytes ? text.substr(std::min(text.find('\n'), text.size() - 1) + 1) : text;
}

// Of what has no size, such as the files of a process.
std::string all_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream all;
  all << in.rdbuf();
  return all.str();
}

// "FOLDER/connect_server-17.status": 17.
int process_of(const fs::path& socket) {
  const std::string name = socket.stem();
  int process = 0;
  const std::size_t from = name.rfind('-') + 1;
  std::from_chars(name.data() + from, name.data() + name.size(), process);
  return process;
}

struct Program {
  std::string socket;
  int process = 0;
  std::vector<std::string> words;  // its command line

  explicit Program(const std::string& where) : socket(where), process(process_of(where)) {
    std::istringstream in(all_of(folder() / "cmdline"));
    for (std::string word; std::getline(in, word, '\0');) words.push_back(word);
  }
  [[nodiscard]] fs::path folder() const { return fs::path("/proc") / std::to_string(process); }
  [[nodiscard]] std::vector<fs::path> parameter_files() const {
    std::vector<fs::path> files;
    std::error_code none;
    const fs::path at = fs::read_symlink(folder() / "cwd", none);
    for (std::size_t i = 0; i + 1 < words.size(); ++i)
      if (words[i] == "--params-file") files.push_back(at / words[i + 1]);
    return files;
  }
};

void add_once(std::vector<fs::path>& files, const fs::path& file) {
  std::error_code none;
  const fs::path whole = fs::absolute(file, none).lexically_normal();
  if (fs::is_regular_file(whole, none) &&
      std::find(files.begin(), files.end(), whole) == files.end())
    files.push_back(whole);
}

std::vector<fs::path> parameter_files(const BugreportOrder& order,
                                      const std::vector<Program>& programs) {
  std::vector<fs::path> files;
  for (const auto& file : order.files) add_once(files, file);
  for (const Program& program : programs)
    for (const auto& file : program.parameter_files()) add_once(files, file);
  for (const char* node : {"/connect_server", "/connect_client"})
    add_once(files, connect_bridge::PairingFolder(node).parameter_file());
  return files;
}

// What stands in the files that hold tokens may stand elsewhere by mistake.
void learn_files(Scrubber& scrubber, const connect_bridge::ParameterMap& parameters) {
  constexpr std::size_t kWordMin = 12;  // shorter ones are names of members
  for (const char* key :
       {"auth.token_file", "auth.jwt_keys", "listen.relay.token_file", "tls.private_key"}) {
    const std::string text =
        content_of(connect_bridge::string_at(parameters, key), kSecretFileBytesMax);
    for (std::size_t at = 0; at < text.size();) {
      const std::size_t end = std::min(text.find_first_of(" \t\r\n\"',:{}[]", at), text.size());
      if (end - at >= kWordMin) scrubber.learn(std::string_view(text).substr(at, end - at));
      at = end + 1;
    }
  }
}

// A file that is not understood is left out: who knows what is in it.
std::vector<PackedFile> configuration(const std::vector<fs::path>& files, Scrubber& scrubber) {
  std::vector<PackedFile> packed;
  for (const auto& file : files) {
    const auto read = connect_bridge::ros::read_parameter_file(file);
    std::string text = "# " + file.string() + "\n";
    if (!read.problems.empty())
      text += "# it cannot be read as a parameter file: ctl check says why\n";
    for (const auto& section : read.sections) {
      scrubber.learn(section.parameters);
      learn_files(scrubber, section.parameters);
      text += "\n# " + section.node + "\n" + connect_bridge::parameters_to_show(section.parameters);
    }
    packed.push_back({"config/" + std::to_string(packed.size() + 1) + ".yaml", text});
  }
  return packed;
}

fs::path log_folder() {
  const auto variable = [](const char* name) {
    const char* const value = std::getenv(name);
    return std::string{value != nullptr ? value : ""};
  };
  if (const std::string given = variable("ROS_LOG_DIR"); !given.empty()) return given;
  if (const std::string home = variable("ROS_HOME"); !home.empty()) return fs::path(home) / "log";
  return fs::path(variable("HOME")) / ".ros" / "log";
}

bool is_log_of_ours(const std::string& name) {
  return name.ends_with(".log") && (name.starts_with("server_") || name.starts_with("client_") ||
                                    name.starts_with("connect_"));
}

std::vector<PackedFile> logs() {
  std::vector<std::pair<fs::file_time_type, fs::path>> found;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(log_folder(), none))
    if (entry.is_regular_file(none) && is_log_of_ours(entry.path().filename()))
      found.emplace_back(entry.last_write_time(none), entry.path());
  std::sort(found.rbegin(), found.rend());
  found.resize(std::min(found.size(), kLogsMax));
  std::vector<PackedFile> packed;
  for (const auto& [time, file] : found)
    packed.push_back(
        {"logs/" + file.filename().string().substr(0, 80), content_of(file, kLogBytes)});
  return packed;
}

std::vector<PackedFile> statuses(const std::vector<Program>& programs) {
  std::vector<PackedFile> packed;
  for (const Program& program : programs) {
    const std::string name = "status/" + fs::path(program.socket).stem().string().substr(0, 80);
    Asked asked(program.socket, "/api/status");
    if (!asked.problem().empty()) {
      packed.push_back({name + ".txt", asked.problem() + "\n"});
      continue;
    }
    const auto json = connect_bridge::OrderedJson::parse(asked.rest(), nullptr, false);
    packed.push_back({name + ".json", json.is_object() ? json.dump(1) + "\n" : "no status\n"});
  }
  return packed;
}

std::string command_lines(const std::vector<Program>& programs) {
  if (programs.empty()) return "no server or client of this user runs here\n";
  std::string text;
  for (const Program& program : programs) {
    text += std::to_string(program.process) + ":";
    for (const auto& word : program.words) text += " " + word;
    text += "\n";
  }
  return text;
}

std::string time_text(std::time_t time, const char* format) {
  char text[64] = "";
  std::tm parts{};
  ::gmtime_r(&time, &parts);
  std::strftime(text, sizeof text, format, &parts);
  return text;
}

// A new file for its owner alone. What is wrong, or nothing.
std::string write_new(const std::string& file, const std::string& bytes) {
  const int handle = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (handle < 0) return std::strerror(errno);
  std::FILE* const out = ::fdopen(handle, "wb");
  const bool whole = std::fwrite(bytes.data(), 1, bytes.size(), out) == bytes.size();
  return std::fclose(out) == 0 && whole ? "" : std::strerror(errno);
}

}  // namespace

CLI::App* add_bugreport_command(CLI::App& app, BugreportOrder& order) {
  auto* report = app.add_subcommand(
      "bugreport",
      "Gather what helps to find a fault into one file: configuration, status, logs, versions, "
      "facts of this machine; without tokens, passwords and keys");
  report->footer("Exit code: 0 if it is written, 2 if not.");
  report->add_option("--config", order.files,
                     "A parameter file; several times. Those of programs that run, and of "
                     "pairings, are found without it");
  report->add_option("--output", order.output,
                     "The file to write. Without it: connect-bugreport-TIME.tar.gz here");
  return report;
}

int run_bugreport(const BugreportOrder& order) {
  const std::time_t now = std::time(nullptr);
  std::vector<Program> programs;
  for (const auto& socket : connect_bridge::status_sockets()) programs.emplace_back(socket);
  Scrubber scrubber;
  if (const char* const token = std::getenv("CONNECT_BRIDGE_TOKEN")) scrubber.learn(token);
  std::vector<PackedFile> files{{"README.txt", kAbout},
                                {"versions.txt", connect_bridge::version_text() + "\n"},
                                {"system.txt", connect_bridge::system_facts()},
                                {"programs.txt", command_lines(programs)}};
  for (auto&& more :
       {configuration(parameter_files(order, programs), scrubber), statuses(programs), logs()})
    files.insert(files.end(), more.begin(), more.end());
  const std::string folder = time_text(now, "connect-bugreport-%Y%m%d-%H%M%S");
  const std::string output = order.output.empty() ? folder + ".tar.gz" : order.output;
  for (PackedFile& file : files) {
    file.text = scrubber.scrubbed(file.text);
    std::printf("  %s, %zu bytes\n", file.name.c_str(), file.text.size());
    file.name = folder + "/" + file.name;
  }
  if (const std::string problem = write_new(output, tar_gz(files, now)); !problem.empty()) {
    std::fprintf(stderr, "%s: %s\n", output.c_str(), problem.c_str());
    return connect_bridge::kExitConfiguration;
  }
  std::printf(
      "%s\nLook through it before it is sent: topics, addresses and names of people are in "
      "it.\n",
      output.c_str());
  return 0;
}
