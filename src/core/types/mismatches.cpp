#include "core/types/mismatches.hpp"

#include <algorithm>
#include <string_view>

#include "core/types/type_difference.hpp"

namespace connect_bridge {
namespace {

std::string_view why_unknown(bool asked, bool here) {
  if (!asked) return "too many such lines wait for definitions";
  return here ? "the peer does not tell its definition" : "this side does not tell its definition";
}

}  // namespace

bool Mismatches::begin(Mismatch mismatch, const Now& now) {
  const auto& [type, hash] = mismatch.there;
  const std::string key = mismatch.used ? "type_mismatch_used " : "type_mismatch ";
  // By type and hash, not by topic: however many topics have the type, it has one line. That it is
  // used nevertheless is another message.
  if (!mismatch.account->told.first(key + type + " " + hash)) return false;
  const auto own = std::count_if(lines_.begin(), lines_.end(), [&](const Line& line) {
    return line.mismatch.account == mismatch.account;
  });
  Line line{std::move(mismatch), {}, now.steady + kPatience, {}, {}};
  // Still one line, but without the difference: a peer that offers thousands of wrong types makes
  // this side look up no more than a few at a time, and takes no places from the lines of others.
  if (lines_.size() >= kWaitingMax || static_cast<std::size_t>(own) >= kAccountWaitingMax) {
    write(line);
    return false;
  }
  line.lookup = outputs_.new_lookup();
  outputs_.push(LookUpType{line.lookup, line.mismatch.there.first, line.mismatch.hash_here});
  lines_.push_back(std::move(line));
  return true;
}

bool Mismatches::waits_for(const Definition& there) const {
  return std::any_of(lines_.begin(), lines_.end(),
                     [&](const Line& line) { return !line.there && line.mismatch.there == there; });
}

void Mismatches::on_there(const Definition& there, const std::string& text) {
  for (Line& line : lines_)
    // Empty, too, is an answer: the line does not wait any longer for this side of it.
    if (!line.there && line.mismatch.there == there) line.there = text;
  write_complete();
}

void Mismatches::on_gone(const Definition& there) {
  std::erase_if(lines_, [&](const Line& line) {
    if (line.mismatch.there != there) return false;
    write(line);
    return true;
  });
}

void Mismatches::on_looked_up(const TypeLookedUp& found) {
  for (Line& line : lines_)
    if (!line.here && line.lookup == found.lookup) line.here = found.text;
  write_complete();
}

void Mismatches::write_complete() {
  std::erase_if(lines_, [this](const Line& line) {
    if (!line.here || !line.there) return false;
    write(line);
    return true;
  });
}

void Mismatches::on_time(const Now& now) {
  // What has not come by now is left out: an incomplete line is better than none.
  while (!lines_.empty() && lines_.front().until <= now.steady) {
    const Line line = std::move(lines_.front());
    lines_.erase(lines_.begin());
    write(line);
  }
}

std::optional<TimePoint> Mismatches::deadline() const {
  if (lines_.empty()) return std::nullopt;
  return lines_.front().until;
}

void Mismatches::write(const Line& line) {
  const Mismatch& told = line.mismatch;
  const auto here = parse_description(line.here.value_or(""));
  const auto there = parse_description(line.there.value_or(""));
  std::string text = told.what + ": the definition of " + told.there.first + " here (" +
                     shortened_hash(told.hash_here) + ") is not that of " + told.peer + " (" +
                     shortened_hash(told.there.second) + "): ";
  text += here && there ? difference(here.value(), there.value())
                        : "how they differ is not known, because " +
                              std::string{why_unknown(bool(line.lookup), bool(here))};
  text += told.used ? ". Messages that do not fit the definition here are dropped"
                    : ". Install the same version of its package on both sides, or set "
                      "allow_type_mismatch in the rule";
  outputs_.log(told.used ? LogLevel::kWarn : LogLevel::kError, std::move(text));
}

}  // namespace connect_bridge
