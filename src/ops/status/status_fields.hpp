// The status as one table: a row for each field, of which JSON, metrics, the screen, the page and
// docs/status.md are made.
// One unit: the rows are one list, and who looks for a field has to search no second file.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "core/base/json.hpp"
#include "core/ports/status.hpp"
#include "ops/status/status_picture.hpp"

namespace connect_bridge {

enum class Unit : std::uint8_t { kNone, kBytes, kBytesPerSecond, kMilliseconds, kSeconds };

// Whether the status says who the people on the links are.
enum class Names : std::uint8_t { kShown, kHidden };

// The series of a field in the metrics. Milliseconds become seconds.
struct Series {
  // A gauge of topics and services is the sum of all links; kMost: their most.
  enum class Kind : std::uint8_t { kNone, kCounter, kGauge, kMost };
  Kind kind = Kind::kNone;
  std::string_view name{};
  std::string_view help{};   // the first field with this name has it
  std::string_view label{};  // tells the members of an object apart, or fields with one name
};

// The column of a field on the screen and the page.
struct Column {
  enum class As : std::uint8_t {
    kText,
    kWord,     // as text, "_" as a space
    kCount,    // nothing in place of 0
    kGrowth,   // a counter's, per second
    kReasons,  // an object of counts
  };
  // The narrowest view that has it: a phone and 80 columns, a wide window, a line that opens.
  enum class In : std::uint8_t { kNarrow, kWide, kDetail };
  std::string_view title{};  // empty: there is no column
  As as = As::kText;
  In in = In::kDetail;
  std::string_view part_of{};  // of kGrowth: the field that it is a part of, "1 of 10"
};

// The people who see a field of a server. A client's people are its own.
enum class SeenBy : std::uint8_t { kAll, kUser, kUserOfServer };

// `name`: the member of the JSON; "a.b" is the member b of the member a. `value`: null where the
// status has none.
template <class Of>
struct StatusField {
  std::string_view name;
  Unit unit;
  OrderedJson (*value)(const Of&);
  std::string_view says;  // for docs/status.md
  Series series{};
  Column column{};
  SeenBy seen_by = SeenBy::kAll;
};

[[nodiscard]] std::span<const StatusField<StatusPicture>> side_fields();
[[nodiscard]] std::span<const StatusField<LinkStatus>> link_fields();
[[nodiscard]] std::span<const StatusField<TopicStatus>> topic_fields();
[[nodiscard]] std::span<const StatusField<ServiceStatus>> service_fields();
[[nodiscard]] std::span<const StatusField<MissingName>> missing_fields();

// The form of a message that is not exact, as "video, fair"; empty: it is exact.
[[nodiscard]] std::string words_of(const SentAs& form);

// A code of the status ("newer_available") in words for people ("replaced by newer").
[[nodiscard]] std::string plain_words(std::string_view code);
// The same for `wheel` of a link; empty: there is no such code.
[[nodiscard]] std::string_view wheel_words(std::string_view code, bool at_robot);

// The columns of topics, services and missing names, and the words of codes, for the page's script.
[[nodiscard]] OrderedJson page_columns();
// The tables of docs/status.md.
[[nodiscard]] std::string status_tables();

}  // namespace connect_bridge
