#include "ros/parameters/yaml_problems.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <iterator>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include "core/wire/text.hpp"

namespace connect_bridge::ros {
namespace {

constexpr std::size_t kTextShown = 100;  // bytes
constexpr std::string_view kParameters = "ros__parameters";

std::string place(const std::string& file, int line) {
  return file + ":" + std::to_string(line) + ": ";
}

// What rcl takes a scalar for.
std::string_view kind_of(const YAML::Node& node) {
  constexpr auto kBools = std::to_array<std::string_view>(
      {"Y", "y", "yes", "Yes", "YES", "true",  "True",  "TRUE",  "on",  "On",  "ON",
       "N", "n", "no",  "No",  "NO",  "false", "False", "FALSE", "off", "Off", "OFF"});
  const std::string& text = node.Scalar();
  if (node.Tag() == "!" || text.empty()) return "text";  // in quotes
  if (std::find(kBools.begin(), kBools.end(), text) != kBools.end()) return "true or false";
  char* end = nullptr;
  errno = 0;
  static_cast<void>(std::strtol(text.c_str(), &end, 0));
  if (errno == 0 && *end == '\0') return "whole numbers";
  const bool is_special = text.front() == '.' || text.find(".inf") == 1;
  errno = 0;
  static_cast<void>(std::strtod(text.c_str() + (is_special ? text.find('.') + 1 : 0), &end));
  return errno == 0 && *end == '\0' ? "numbers with a point" : "text";
}

// Whether this is KEY:VALUE, which YAML takes for one text: a URL is none.
bool lacks_blank(std::string_view text) {
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos || colon == 0 || colon + 1 >= text.size()) return false;
  const std::string_view key = text.substr(0, colon), value = text.substr(colon + 1);
  const auto is_of_key = [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '.';
  };
  return std::all_of(key.begin(), key.end(), is_of_key) && value.front() != ' ' &&
         value.front() != '\t' && !value.starts_with("//");
}

std::string lacks_blank_text(std::string_view text) {
  const std::string key(text.substr(0, text.find(':')));
  return "a blank is missing behind the colon: `" + to_text(key, kTextShown) + ": ...`";
}

// Looks for keys that are given twice, and for what rcl refuses with the line alone: keys without a
// value, lists of several kinds. Keys are compared by their whole names, as rcl joins them:
// `rule.drive: {...}` and `rule: {drive: {...}}` are the same, and so are `/a/b: {...}` and
// `/a: {b: {...}}` for nodes.
class KeyCheck {
 public:
  explicit KeyCheck(std::string file) : file_(std::move(file)) {}

  void look_into_document(const YAML::Node& document) {
    has_parameters_ = false;
    look_into(document, "", kOfNodes);
    if (document.IsNull() || has_parameters_) return;
    found.if_refused.insert(found.if_refused.begin(),
                            place(file_, document.Mark().line + 1) +
                                "expected `/**:` and below it, indented, `ros__parameters:` (of "
                                "a relay's file `relay --check FILE` says what is wrong)");
  }

  YamlProblems found;

 private:
  static constexpr char kOfNodes = '/';
  static constexpr char kOfParameters = '.';

  // `name`: of the node itself; empty: the whole document. `separator` joins the names in it.
  void look_into(const YAML::Node& node, const std::string& name, char separator) {
    if (!node.IsMap()) return;
    for (const auto& entry : node) look_at(entry.first, entry.second, name, separator);
  }

  void look_at(const YAML::Node& key, const YAML::Node& value, const std::string& map,
               char separator) {
    const std::string text = key.IsScalar() ? key.Scalar() : "~";
    const bool is_joined = map.empty() || map.back() == separator;
    const std::string name = is_joined ? map + text : map + separator + text;
    const int line = key.Mark().line + 1;
    const std::string at = place(file_, line) + "\"" + to_text(text, kTextShown) + "\" ";
    const auto [first, is_new] = lines_.try_emplace(name, line);
    if (!is_new)
      found.certain.push_back(at + "is given twice, first in line " +
                              std::to_string(first->second));
    if (text == kParameters) {
      has_parameters_ = true;
      if (map.empty())
        found.if_refused.push_back(at + "stands below a node's name: indent it below `/**:`");
      else if (value.IsNull())
        found.if_refused.push_back(at + "has nothing below it: indent the parameters further");
      else if (value.IsScalar() && lacks_blank(value.Scalar()))
        found.if_refused.push_back(place(file_, value.Mark().line + 1) +
                                   lacks_blank_text(value.Scalar()));
    } else if (separator == kOfNodes && value.IsSequence()) {
      found.if_refused.push_back(at + "is no node's name: indent it below `ros__parameters:`");
    } else if (value.IsNull() && lacks_blank(text)) {
      found.if_refused.push_back(place(file_, line) + lacks_blank_text(text));
    } else if (value.IsNull()) {
      found.if_refused.push_back(at + "has no value; a list stands in brackets: [/one, /two]");
    }
    // The keys in what is there again were told with it. What stands before its key is an alias,
    // which rcl does not take, and may contain itself.
    const bool is_alias = value.Mark().pos < key.Mark().pos;
    if (is_alias || !is_new) return;
    if (value.IsSequence()) look_at_list(at, value);
    look_into(value, name, text == kParameters ? kOfParameters : separator);
  }

  void look_at_list(const std::string& at, const YAML::Node& list) {
    std::string_view kind;
    for (const YAML::Node& entry : list) {
      if (!entry.IsScalar()) {
        found.if_refused.push_back(at +
                                   "is a list with another list or a map in it: only text, "
                                   "numbers, or true and false can stand there");
        return;
      }
      const std::string_view now = kind_of(entry);
      if (!kind.empty() && now != kind) {
        found.if_refused.push_back(
            fmt::format("{}is a list of {} with {} in it ({}): write all alike, text in quotes", at,
                        kind, now, to_text(entry.Scalar(), kTextShown)));
        return;
      }
      kind = now;
    }
  }

  const std::string file_;
  std::map<std::string, int> lines_;  // of each key, by its whole name: where it was first given
  bool has_parameters_ = false;       // ros__parameters stands in this document
};

// The first line, of the first so many, that a tab indents; 0: none.
int line_with_tab(std::string_view text, int lines) {
  for (int line = 1; line <= lines && !text.empty(); ++line) {
    const std::string_view one = text.substr(0, text.find('\n'));
    if (one.substr(0, one.find_first_not_of(" \t")).find('\t') != std::string_view::npos)
      return line;
    text.remove_prefix(std::min(one.size() + 1, text.size()));
  }
  return 0;
}

// A quotation mark or a bracket that begins in a line and is not closed where it has to be.
struct LeftOpen {
  char what = 0;  // 0: none
  int line = 0;
  std::size_t column = 0;
};

// Where an error is, a quoted text of several lines is one whose end was forgotten. Comments do not
// count. In texts without quotation marks brackets are in pairs, as far as they are in patterns.
LeftOpen left_open(std::string_view text) {
  std::vector<LeftOpen> brackets;
  LeftOpen quote;
  int line = 1;
  std::size_t line_at = 0;
  char before = '\n';
  for (std::size_t i = 0; i < text.size(); before = text[i++]) {
    const char c = text[i];
    const std::size_t column = i - line_at + 1;
    if (c == '\n') {
      ++line;
      line_at = i + 1;
    }
    if (quote.what != 0) {
      if (c == '\n') return quote;
      const char next = i + 1 < text.size() ? text[i + 1] : '\n';
      const bool is_escape = quote.what == '"' ? c == '\\' : c == '\'' && next == '\'';
      if (is_escape && next != '\n')
        ++i;
      else if (c == quote.what)
        quote = {};
      continue;
    }
    const bool is_begin = std::string_view(" \t\n[{,:").find(before) != std::string_view::npos;
    if (c == '#' && is_begin) {
      while (i + 1 < text.size() && text[i + 1] != '\n') ++i;
    } else if ((c == '"' || c == '\'') && is_begin) {
      quote = {c, line, column};
    } else if (c == '[' || c == '{') {
      brackets.push_back({c, line, column});
    } else if ((c == ']' || c == '}') && !brackets.empty()) {
      if (brackets.back().what != (c == ']' ? '[' : '{')) return brackets.back();
      brackets.pop_back();
    }
  }
  return quote.what != 0 || brackets.empty() ? quote : brackets.front();
}

// The first line, of the first so many, in which KEY:VALUE stands; 0: none.
int line_without_blank(std::string_view text, int lines, std::string& found) {
  for (int line = 1; line <= lines && !text.empty(); ++line) {
    const std::string_view one = text.substr(0, text.find('\n'));
    const std::size_t from = std::min(one.find_first_not_of(' '), one.size());
    const std::string_view word = one.substr(from, one.find_first_of(" ,[{#", from) - from);
    if (lacks_blank(word)) {
      found = word;
      return line;
    }
    text.remove_prefix(std::min(one.size() + 1, text.size()));
  }
  return 0;
}

// What a message of yaml-cpp means in a parameter file, and the cure.
struct OfParser {
  std::string_view message, cure;
};
constexpr OfParser kOfParser[] = {
    {"alias not found after *", "a text that begins with * stands in quotation marks: \"*\""},
    {"illegal character found while scanning alias",
     "a text that begins with * stands in quotation marks: \"*/x\""},
    {"the referenced anchor is not defined",
     "a text that begins with * stands in quotation marks: \"*/x\""},
    {"anchor not found after &", "a text that begins with & stands in quotation marks"},
    {"unknown token", "a text that begins with @, % or ` stands in quotation marks"},
    {"illegal flow end", "a bracket closes here, and none of its kind is open"},
    {"illegal map value",
     "this line is indented further than the key before it, which has a value; or its value has a "
     "colon in it and needs quotation marks"},
    {"illegal block entry", "a list of several lines begins below its key: \"- /one\""},
    {"end of map not found",
     "this line is indented as none before it; keys of one map stand in one column"},
    {"unknown escape character", "in \"double\" quotation marks a \\ stands as \\\\"},
};

std::string left_open_text(const std::string& file, const LeftOpen& open) {
  return fmt::format("{}:{}:{}: a {} that is not closed", file, open.line, open.column, open.what);
}

std::string no_yaml(const std::string& file, const YAML::Exception& error, std::string_view text) {
  // The parser may find a fault of a line at the beginning of the next one.
  if (const int line = line_with_tab(text, error.mark.line + 1); line > 0)
    return place(file, line) + "a tab; YAML indents with spaces";
  std::string key;
  if (const int line = line_without_blank(text, error.mark.line + 1, key); line > 0)
    return place(file, line) + lacks_blank_text(key);
  if (const LeftOpen open = left_open(text); open.what != 0) return left_open_text(file, open);
  std::string problem = file + ":" + std::to_string(error.mark.line + 1) + ":" +
                        std::to_string(error.mark.column + 1) + ": ";
  const auto known = std::find_if(std::begin(kOfParser), std::end(kOfParser), [&](const auto& one) {
    return error.msg.starts_with(one.message);
  });
  return problem + error.msg +
         (known == std::end(kOfParser) ? "" : ": " + std::string(known->cure));
}

}  // namespace

YamlProblems yaml_problems(const std::string& file, std::istream& in) {
  const std::string text(std::istreambuf_iterator<char>(in), {});
  KeyCheck keys(file);
  try {
    for (const YAML::Node& document : YAML::LoadAll(text)) keys.look_into_document(document);
  } catch (const YAML::Exception& error) {
    keys.found.certain.push_back(no_yaml(file, error, text));
  }
  // yaml-cpp closes at the end what rcl does not.
  if (const LeftOpen open = left_open(text); open.what != 0 && keys.found.if_refused.empty())
    keys.found.if_refused.push_back(left_open_text(file, open));
  if (const int line = line_with_tab(text, static_cast<int>(text.size())); line > 0)
    keys.found.if_refused.insert(keys.found.if_refused.begin(),
                                 place(file, line) + "a tab; YAML indents with spaces");
  return std::move(keys.found);
}

}  // namespace connect_bridge::ros
