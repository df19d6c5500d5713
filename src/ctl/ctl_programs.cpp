#include "ctl/ctl_programs.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>

#include "config/checked_values.hpp"
#include "config/key_search.hpp"

namespace {

namespace fs = std::filesystem;

// Reads "key:=value" or "node:key:=value" behind -p.
std::optional<std::pair<std::string, std::string>> parameter_at(
    const std::vector<std::string>& words, std::size_t at) {
  if (at == 0 || (words[at - 1] != "-p" && words[at - 1] != "--param")) return std::nullopt;
  const std::size_t sign = words[at].find(":=");
  if (sign == std::string::npos) return std::nullopt;
  std::string key = words[at].substr(0, sign), value = words[at].substr(sign + 2);
  key.erase(0, key.rfind(':') + 1);
  const bool quoted = value.size() > 1 && (value[0] == '"' || value[0] == '\'');
  if (quoted && value.back() == value[0]) value = value.substr(1, value.size() - 2);
  return std::pair{std::move(key), std::move(value)};
}

// The user of a process, as a number; empty: there is no such process.
std::string user_of(int process) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  for (std::string word; status >> word;)
    if (word == "Uid:" && status >> word) return word;
  return {};
}

}  // namespace

std::string content_of(const fs::path& file, std::size_t end_bytes) {
  std::error_code none;
  if (!fs::is_regular_file(file, none)) return {};
  std::ifstream in(file, std::ios::binary);
  const std::uintmax_t size = fs::file_size(file, none);
  const bool is_cut = !none && size > end_bytes;
  if (is_cut) in.seekg(static_cast<std::streamoff>(size - end_bytes));
  std::ostringstream all;
  all << in.rdbuf();
  std::string text = all.str();
  // A cut line could hide a secret from the scrubber, which looks for whole ones.
  return is_cut ? text.substr(std::min(text.find('\n'), text.size() - 1) + 1) : text;
}

int process_of(const fs::path& socket) {
  const std::string name = socket.stem();
  const std::size_t dash = name.rfind('-');
  int process = 0;
  if (dash != std::string::npos)
    std::from_chars(name.data() + dash + 1, name.data() + name.size(), process);
  struct stat made {};
  const bool is_its_own =
      ::lstat(socket.c_str(), &made) == 0 && user_of(process) == std::to_string(made.st_uid);
  return is_its_own ? process : 0;
}

Program::Program(const std::string& where) : socket(where), process(process_of(where)) {
  node = "/" + fs::path(where).stem().string();
  node.erase(std::min(node.rfind('-'), node.size()));
  std::replace(node.begin(), node.end(), '.', '/');
  const fs::path facts = fs::path("/proc") / std::to_string(process);
  std::error_code none;
  folder = fs::read_symlink(facts / "cwd", none);
  std::istringstream in(content_of(facts / "cmdline"));
  for (std::string word; std::getline(in, word, '\0');) words.push_back(word);
}

std::vector<std::string> Program::parameter_files() const {
  std::vector<std::string> files;
  for (std::size_t i = 0; i + 1 < words.size(); ++i)
    if (words[i] == "--params-file") files.push_back(words[i + 1]);
  return files;
}

connect_bridge::ParameterMap Program::parameters() const {
  connect_bridge::ParameterMap found;
  for (std::size_t i = 0; i < words.size(); ++i)
    if (auto one = parameter_at(words, i)) found.insert_or_assign(one->first, one->second);
  return found;
}

std::string Program::command_line() const {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const auto one = parameter_at(words, i);
    const bool is_ours = one && !connect_bridge::is_ros_key(one->first);
    text += (i == 0 ? "" : " ") +
            (is_ours ? one->first + ":=" + connect_bridge::shown_to_others(one->first, one->second)
                     : words[i]);
  }
  return text;
}
