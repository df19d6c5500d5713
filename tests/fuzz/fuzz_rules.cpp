// The rules against the second opinion on them: both say the same of every question, and so does a
// peer that got `accepts`. Input: lines of words.
//
//   rule                                  begins the next rule
//   export_topics /a/** /b                and the other keys of a rule
//   who anna crew                         the peer's name and groups; before the questions
//   ask import topic /a/x p/msg/A         or service; or a part of an action, with the names of
//   ask export send_goal /a p/action/Do   the action and its type
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/check.hpp"
#include "fuzz/slow.hpp"
#include "model/rule_opinions.hpp"

using namespace connect_bridge;

namespace {

// The second opinion is slow: what it tries grows with a power of the number of wildcards.
constexpr std::size_t kWordBytesMax = 64;
constexpr std::size_t kStarsMax = 4;
constexpr std::size_t kRulesMax = 6;
constexpr std::size_t kPatternsMax = 24;  // of all rules
constexpr std::size_t kQuestionsMax = 8;

std::string_view take_until(std::string_view& text, char end) {
  const auto at = text.find(end);
  const auto head = text.substr(0, at);
  text.remove_prefix(at == std::string_view::npos ? text.size() : at + 1);
  return head;
}

std::vector<std::string> words_of(std::string_view line) {
  std::vector<std::string> words;
  while (!line.empty()) {
    const auto word = take_until(line, ' ');
    if (!word.empty()) words.emplace_back(word.substr(0, kWordBytesMax));
  }
  return words;
}

template <class Lists>
auto* list_of(Rule& rule, const Lists& lists, std::string_view key) {
  const auto found = std::find_if(std::begin(lists), std::end(lists),
                                  [&](const auto& entry) { return entry.key == key; });
  return found == std::end(lists) ? nullptr : &std::invoke(found->list, rule);
}

class Case {
 public:
  void read(std::string_view text) {
    while (!text.empty()) {
      const auto words = words_of(take_until(text, '\n'));
      if (!words.empty()) read(words);
    }
  }

  void judge() {
    const Policy policy(std::move(rules_));
    const PeerAccepts accepts(policy.accepts(who_));
    for (const auto& [direction, asked] : questions_) {
      if (!is_sound(asked)) {
        CONNECT_CHECK(!policy.decide(direction, asked.what(), who_));
        CONNECT_CHECK(!accepts.takes(asked.what()));
        continue;
      }
      const auto opinions = model::opinions_of(policy, accepts, direction, asked, who_);
      if (!opinions.agree())
        std::fprintf(stderr, "%s\n",
                     model::to_text(opinions, policy, direction, asked, who_).c_str());
      CONNECT_CHECK(opinions.agree());
    }
  }

 private:
  void read(const std::vector<std::string>& words) {
    const std::string& key = words[0];
    if (key == "rule" && rules_.size() < kRulesMax) {
      rules_.emplace_back();
      rules_.back().treatment.calls_max = static_cast<std::uint32_t>(rules_.size());
    } else if (key == "who" && words.size() > 1) {
      who_ = {words[1], {words.begin() + 2, words.end()}};
    } else if (key == "ask" && words.size() == 5) {
      add_question(words);
    } else if (!rules_.empty()) {
      add_to_rule(words);
    }
  }

  void add_to_rule(const std::vector<std::string>& words) {
    Rule& rule = rules_.back();
    if (auto* names = list_of(rule, model::kNameLists, words[0]))
      names->assign(words.begin() + 1, words.end());
    auto* patterns = list_of(rule, model::kPatternLists, words[0]);
    for (std::size_t i = 1; patterns != nullptr && i < words.size(); ++i) {
      const std::string& text = words[i];
      auto pattern = Pattern::parse(text);
      const auto stars = static_cast<std::size_t>(std::count(text.begin(), text.end(), '*'));
      if (!pattern || stars > kStarsMax || ++patterns_ > kPatternsMax) continue;
      patterns->push_back(std::move(pattern).value());
    }
  }

  void add_question(const std::vector<std::string>& words) {
    if (questions_.size() == kQuestionsMax) return;
    const auto direction = words[1] == "import" ? Direction::kImport : Direction::kExport;
    model::Asked asked;
    asked.name = words[3];
    asked.type = words[4];
    if (words[2] == "service") asked.kind = InterfaceKind::kService;
    for (const auto part : kActionParts) {
      const std::string name = name_of_part(asked.name, part);
      if (!name.ends_with("/" + words[2])) continue;
      // The second opinion knows one type of the actions whose parts do not tell it.
      const bool same = type_of_part("x", part) == type_of_part("y", part);
      asked.action_type = same ? sim::kActionType : asked.type;
      asked.kind = kind_of(part);
      asked.type = type_of_part(asked.action_type, part);
      asked.name = name;
      break;
    }
    questions_.emplace_back(direction, std::move(asked));
  }

  // The second opinion does not check whether names and types are valid, nor whether there is a
  // type of an action where the part does not contain it.
  static bool is_sound(const model::Asked& asked) {
    const bool typed = asked.kind == InterfaceKind::kTopic ? is_topic_type(asked.type)
                                                           : is_service_type(asked.type);
    const bool part = part_of_action(asked.kind, asked.name, asked.type).has_value();
    const bool tells = asked.type.find("/action/") != std::string::npos;
    return typed && is_canonical_name(asked.name) &&
           (!part || tells || is_action_type(asked.action_type));
  }

  std::vector<Rule> rules_;
  std::size_t patterns_ = 0;
  Identity who_;
  std::vector<std::pair<Direction, model::Asked>> questions_;
};

void look(const std::uint8_t* data, std::size_t size) {
  Case one;
  one.read({reinterpret_cast<const char*>(data), size});
  one.judge();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return quickly("rules", [=] { look(data, size); });
}
