#include "ops/status/screen_table.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace connect_bridge {
namespace {

constexpr std::string_view kGap = "  ";
constexpr std::size_t kNameMin = 20;
constexpr std::size_t kLastMax = 14;

}  // namespace

std::string coloured(const std::string& text, Tone tone, bool colour) {
  if (!colour || tone == Tone::kPlain) return text;
  constexpr const char* kCodes[] = {"", "32", "33", "31"};
  return fmt::format("\033[{}m{}\033[0m", kCodes[static_cast<std::size_t>(tone)], text);
}

std::string wrapped(std::string_view text, std::size_t indent, std::size_t columns) {
  std::string lines, line(indent, ' ');
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    const std::string_view word = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const bool first = line.size() == indent;
    if (!first && columns > 0 && line.size() + 1 + word.size() > columns) {
      lines += line + "\n";
      line.assign(indent, ' ');
      line += word;
    } else {
      line += (first ? "" : " ") + std::string(word);
    }
  }
  return lines + line + "\n";
}

std::string ScreenTable::text(std::size_t rows, const ScreenSize& size) {
  std::stable_sort(rows_.begin(), rows_.end(),
                   [](const Row& a, const Row& b) { return a.weight > b.weight; });
  const std::size_t count = std::min(rows, rows_.size());
  const std::span<Row> shown(rows_.data(), count);
  choose_columns(shown, size.columns);
  Row heads;
  for (const Head& head : heads_) heads.cells.push_back({head.title});
  std::string text = line_of(heads, size);
  std::size_t lines = 0, written = 0;
  for (const Row& row : shown) {
    const std::string more = line_of(row, size);
    lines += static_cast<std::size_t>(std::count(more.begin(), more.end(), '\n'));
    if (lines > rows && written > 0) break;
    text += more;
    ++written;
  }
  if (written < rows_.size())
    text += fmt::format("... and {} more (--json has all)\n", rows_.size() - written);
  return text;
}

// The wide columns go, the last first, until the lines are short enough; then texts become brief.
void ScreenTable::choose_columns(std::span<Row> rows, std::size_t columns) {
  widths_.clear();
  for (std::size_t i = 0; i < heads_.size(); ++i) {
    std::size_t width = heads_[i].title.size();
    for (const Row& row : rows) width = std::max(width, row.cells[i].text.size());
    widths_.push_back(width);
  }
  if (columns == 0) return;
  // A name or a last text that is longer has a line of its own.
  const std::size_t name = widths_.front();
  widths_.front() = std::min(name, columns / 2);
  widths_.back() = std::min(widths_.back(), kLastMax);
  for (std::size_t i = heads_.size(); i-- > 0 && total() > columns;)
    if (heads_[i].wide) widths_[i] = 0;
  for (std::size_t i = heads_.size(); i-- > 0 && total() > columns;) be_brief(rows, i);
  if (const std::size_t all = total(); all <= columns) {
    widths_.front() = std::min(name, widths_.front() + columns - all);
  } else {
    const std::size_t spare = widths_.front() - std::min(widths_.front(), kNameMin);
    widths_.front() -= std::min(spare, all - columns);
  }
}

void ScreenTable::be_brief(std::span<Row> rows, std::size_t column) {
  const auto brief = [&](const Row& row) { return !row.cells[column].brief.empty(); };
  if (widths_[column] == 0 || std::none_of(rows.begin(), rows.end(), brief)) return;
  widths_[column] = heads_[column].title.size();
  for (Row& row : rows) {
    Cell& cell = row.cells[column];
    if (!cell.brief.empty()) cell.text = cell.brief;
    widths_[column] = std::max(widths_[column], cell.text.size());
  }
}

std::size_t ScreenTable::total() const {
  std::size_t sum = 0;
  for (const std::size_t width : widths_) sum += width == 0 ? 0 : width + kGap.size();
  return sum - std::min(sum, kGap.size());
}

std::string ScreenTable::line_of(const Row& row, const ScreenSize& size) const {
  std::string line, behind;
  std::size_t end = 0;  // of what is visible
  for (std::size_t i = 0; i < widths_.size(); ++i) {
    const std::string& text = row.cells[i].text;
    if (widths_[i] == 0) continue;
    std::size_t used = text.size();
    if (i == 0 && used > widths_[0]) {
      line += text + "\n";
      used = 0;
    } else if (i > 0 && i + 1 == widths_.size() && used > 0 && size.columns > 0 &&
               end + used > size.columns) {
      behind = wrapped(text, 4, size.columns);
      break;
    } else {
      line += coloured(text, row.cells[i].tone, size.colour);
    }
    const std::size_t width = std::max(widths_[i], used) + kGap.size();
    line.append(width - used, ' ');
    end += width;
  }
  line.erase(line.find_last_not_of(' ') + 1);
  return line + "\n" + behind;
}

}  // namespace connect_bridge
