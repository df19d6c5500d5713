// The findings of `ctl doctor`: one list, which the program, its tests and the documents use.
// One unit: the findings are one list, and who words a cure reads its neighbours.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace connect_bridge {

struct Finding {
  std::string_view id;   // a word of [a-z0-9_]
  bool is_hint = false;  // may be as it is to be; else something does not work
  std::string_view cause;
  std::string_view cure;
};

// Sorted by nothing but their subject; ids are unique.
[[nodiscard]] std::span<const Finding> all_findings();
// Null: there is none.
[[nodiscard]] const Finding* finding_of(std::string_view id);

// One that was made.
struct Found {
  std::string_view id;
  std::string subject;       // a topic, file or link; empty: the whole
  std::string detail = {};   // what was seen; may be empty
  bool waits = false;        // somebody waits for what does not work
  std::string program = {};  // the one of several that it is about; empty: the only one
  bool is_hint = false;      // though the finding is a fault: a peer says so, or nobody waits

  friend bool operator==(const Found&, const Found&) = default;
};

// One for each id and detail, with the subjects of all: hints differ by their subjects alone.
[[nodiscard]] std::vector<Found> gathered(const std::vector<Found>& found);
// Faults for which somebody waits come first, then other faults, then hints in the same way.
[[nodiscard]] std::vector<Found> sorted(std::vector<Found> found);

// For people; with a headline if nothing was found.
[[nodiscard]] std::string report_text(const std::vector<Found>& found);
// {"findings": [{"id", "hint", "program", "subject", "detail", "waits", "cause", "cure"}]}
[[nodiscard]] std::string report_json(const std::vector<Found>& found);
// Whether something does not work.
[[nodiscard]] bool has_fault(const std::vector<Found>& found);

}  // namespace connect_bridge
