// Lines and tables for a terminal of some width.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace connect_bridge {

struct ScreenSize {
  std::size_t rows = 0;     // of topics, calls and missing names together; more are counted
  std::size_t columns = 0;  // 0: no limit
  bool colour = false;
};

enum class Tone : std::uint8_t { kPlain, kGood, kWarn, kBad };

[[nodiscard]] std::string coloured(const std::string& text, Tone tone, bool colour);

// Words behind an indent, in lines of at most `columns`; 0: in one line.
[[nodiscard]] std::string wrapped(std::string_view text, std::size_t indent, std::size_t columns);

// The first column is a name and stays whole: where it is too long, it has a line of its own. So
// does the text of the last column.
class ScreenTable {
 public:
  struct Head {
    std::string title;
    bool wide = false;  // left out where the lines would be too long
  };
  struct Cell {
    std::string text;
    Tone tone = Tone::kPlain;
    std::string brief = {};  // in place of the text where the lines would be too long
  };

  explicit ScreenTable(std::vector<Head> heads) : heads_(std::move(heads)) {}

  // A row has as many cells as there are heads.
  void add(double weight, std::vector<Cell> cells) { rows_.push_back({weight, std::move(cells)}); }
  [[nodiscard]] std::size_t size() const { return rows_.size(); }
  // The heaviest rows first, in at most `rows` lines below the heads; at least one.
  [[nodiscard]] std::string text(std::size_t rows, const ScreenSize& size);

 private:
  struct Row {
    double weight = 0;
    std::vector<Cell> cells;
  };

  void choose_columns(std::span<Row> rows, std::size_t columns);
  void be_brief(std::span<Row> rows, std::size_t column);
  [[nodiscard]] std::size_t total() const;
  [[nodiscard]] std::string line_of(const Row& row, const ScreenSize& size) const;

  std::vector<Head> heads_;
  std::vector<Row> rows_;
  std::vector<std::size_t> widths_;  // 0: the column is left out
};

}  // namespace connect_bridge
