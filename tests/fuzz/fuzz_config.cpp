// Parameters of any keys and values: a Config or the list of what is wrong, never both, and never a
// secret in a text. Input: a flag byte, then lines of YAML as in a parameter file with dotted keys
// ("rule.a.import_topics: [/a, /b]"); lines after a line "---" are a change at run time.
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "config/document.hpp"
#include "config/explain.hpp"
#include "core/base/check.hpp"

using namespace connect_bridge;

namespace {

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

// The head of `text` up to `end`, which is taken away with it.
std::string_view take_until(std::string_view& text, char end) {
  const auto at = text.find(end);
  const auto head = text.substr(0, at);
  text.remove_prefix(at == std::string_view::npos ? text.size() : at + 1);
  return head;
}

template <class Number>
bool is_number(std::string_view text, Number& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc{} && end == text.data() + text.size();
}

// The value that rcl makes from a scalar or a list of strings; lists of other types begin with a
// '!'.
ParameterValue value_of(std::string_view text) {
  if (text == "true" || text == "false") return text == "true";
  if (text == "![]") return std::vector<bool>{};
  if (text == "![1]") return std::vector<std::int64_t>{1};
  std::int64_t whole = 0;
  if (is_number(text, whole)) return whole;
  double number = 0;
  if (is_number(text, number)) return number;
  if (text.size() < 2 || text.front() != '[' || text.back() != ']') return std::string{text};
  text = text.substr(1, text.size() - 2);
  std::vector<std::string> list;
  while (!text.empty()) list.emplace_back(trimmed(take_until(text, ',')));
  return list;
}

// Texts are searched for a token if it is written like this and nothing else is.
constexpr std::string_view kHush = "hush!";

void check_texts(const Parsed& parsed, const ParameterMap& given) {
  CONNECT_CHECK(parsed.config.has_value() == parsed.problems.empty());
  const auto token = given.find("auth.token");
  bool hushed = token != given.end();
  for (const auto& [key, value] : given) {
    const auto* text = std::get_if<std::string>(&value);
    const bool hush = text != nullptr && text->starts_with(kHush);
    if ((key == "auth.token") != hush || key.find(kHush) != std::string::npos) hushed = false;
    if (!hush && to_text(value).find(kHush) != std::string::npos) hushed = false;
  }
  const auto check = [&](const std::string& text) {
    CONNECT_CHECK(!hushed || text.find(kHush) == std::string::npos);
  };
  for (const Problem& problem : parsed.problems) {
    CONNECT_CHECK(!problem.expected.empty());
    check(to_text(problem));
  }
  if (!parsed.config) return;
  check(explain(*parsed.config));
  for (const std::string& warning : parsed.config->warnings) check(warning);
  for (const ParameterDescriptor& one : describe_parameters(*parsed.config)) {
    CONNECT_CHECK(one.name != "auth.token");
    if (one.value) check(to_text(*one.value));
  }
}

// A wrong rule must not become one that allows what no rule can allow.
void check_rights(const Config& config) {
  const Identity who{"ops", {"crew"}, 0};
  for (const auto direction : {Direction::kImport, Direction::kExport}) {
    const auto allowed = [&](const Interface& what) {
      return config.policy.decide(direction, what, who).has_value();
    };
    CONNECT_CHECK(!allowed({InterfaceKind::kService, "/n/get_parameters", "std_srvs/srv/SetBool"}));
    CONNECT_CHECK(!allowed({InterfaceKind::kTopic, "/f/_action/x", "std_msgs/msg/String"}));
    CONNECT_CHECK(!allowed({InterfaceKind::kTopic, "/a//b", "std_msgs/msg/String"}));
    if (config.policy.rules().empty())
      CONNECT_CHECK(!allowed({InterfaceKind::kTopic, "/a", "std_msgs/msg/String"}));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const Role role = (data[0] & 1) != 0 ? Role::kClient : Role::kServer;
  Surroundings around;
  around.token_in_environment = (data[0] & 2) != 0;
  if ((data[0] & 4) != 0) {
    around.unreadable = [](const std::string& file) {
      return file.size() % 2 == 0 ? Failure{} : Failure{Cause::kFileMissing, "x"};
    };
    around.installed = [](const std::string& type) { return type.size() % 2 == 0; };
  }
  ParameterMap given;
  std::vector<Parameter> changes;
  bool changing = false;
  std::string_view text{reinterpret_cast<const char*>(data + 1), size - 1};
  while (!text.empty()) {
    auto line = take_until(text, '\n');
    changing = changing || line == "---";
    const std::string key{trimmed(take_until(line, ':'))};
    if (changing) {
      changes.push_back({key, std::nullopt});
      if (!line.empty()) changes.back().value = value_of(trimmed(line));
    } else {
      given[key] = value_of(trimmed(line));
    }
  }
  const Parsed parsed = parse_config(given, role, around);
  check_texts(parsed, given);
  if (!parsed.config) return 0;
  const Config& config = *parsed.config;
  check_rights(config);
  const SideOptions options = side_options(config);
  CONNECT_CHECK(options.reassembly.message_bytes_max > 0);
  // What was accepted once is accepted again, as the same.
  const Parsed again = parse_config(config.given, role, around);
  CONNECT_CHECK(again.config && explain(*again.config) == explain(config));
  CONNECT_CHECK(apply_change(config, {}, around).config.has_value());
  const Parsed changed = apply_change(config, changes, around);
  CONNECT_CHECK(changed.config.has_value() == changed.problems.empty());
  if (changed.config) check_rights(*changed.config);
  return 0;
}
