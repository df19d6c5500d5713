// The tables of docs/config.md, made from the table of keys.
#include <fmt/format.h>

#include "config/config.hpp"

namespace connect_bridge {
namespace {

// Where the tables go in the template of the manual.
constexpr std::string_view kMark = "@TABLES@\n";

std::string used_by_text(UsedBy used_by) {
  if (used_by == UsedBy::kBoth) return "both";
  return used_by == UsedBy::kServer ? "server" : "client";
}

// In a cell of a table a bar would end the cell, and <name> would be taken for HTML.
std::string code(std::string_view text) {
  std::string escaped;
  for (const char c : text) escaped += c == '|' ? std::string("\\|") : std::string(1, c);
  return "`" + escaped + "`";
}

std::string allowed_text(const KeySpec& spec) {
  if (!spec.words.empty()) {
    std::string text;
    for (const std::string& word : spec.words) text += (text.empty() ? "" : ", ") + code(word);
    return text;
  }
  if (spec.min && spec.max) {
    return fmt::format("{:.15g} to {:.15g}{}{}", *spec.min, *spec.max, spec.unit.empty() ? "" : " ",
                       spec.unit);
  }
  return "";
}

std::string row(const KeySpec& spec) {
  std::string help = spec.help;
  if (spec.secret) help += " Secret.";
  return fmt::format("| {} | {} | {} | {} | {} | {} | {} |\n", code(spec.key), type_text(spec.type),
                     spec.fallback ? code(to_text(*spec.fallback)) : "", allowed_text(spec),
                     used_by_text(spec.used_by), spec.changeable ? "yes" : "", help);
}

}  // namespace

std::string config_tables() {
  std::string text, section;
  for (const KeySpec& spec : key_table()) {
    if (spec.section != section) {
      text += fmt::format("{}## {}\n\n", section.empty() ? "" : "\n", spec.section);
      text += "| key | type | default | allowed | for | run time | meaning |\n";
      text += "| --- | --- | --- | --- | --- | --- | --- |\n";
      section = spec.section;
    }
    text += row(spec);
  }
  return text;
}

std::optional<std::string> config_document(std::string_view manual) {
  const std::size_t at = manual.find(kMark);
  if (at == std::string_view::npos) return std::nullopt;
  std::string text{manual};
  return text.replace(at, kMark.size(), config_tables());
}

}  // namespace connect_bridge
