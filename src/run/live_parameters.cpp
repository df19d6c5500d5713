#include "run/live_parameters.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <chrono>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>

#include "access/login/secret.hpp"
#include "access/pairing/pairing_folder.hpp"
#include "config/document.hpp"
#include "config/key_search.hpp"
#include "config/rule_changes.hpp"
#include "ops/audit/audit_json.hpp"
#include "ops/doctor/host_check.hpp"
#include "ros/parameters/parameter_file.hpp"
#include "run/surroundings.hpp"

namespace connect_bridge {
namespace {

constexpr std::size_t kTold = 20;

std::string text_of(const Problem& problem) {
  return to_text(problem);
}
const std::string& text_of(const std::string& key) {
  return key;
}

template <class List>
std::string joined(const List& list) {
  std::string text;
  for (std::size_t i = 0; i < std::min(list.size(), kTold); ++i)
    text += (i == 0 ? "" : "; ") + text_of(list[i]);
  return list.size() <= kTold ? text
                              : text + "; and " + std::to_string(list.size() - kTold) + " more";
}

// True for a regular file, and for a missing one, which may appear later; false for a pipe.
bool can_be_read_again(const FileWatch& watch) {
  std::error_code failed;
  return std::filesystem::is_regular_file(watch.file(), failed) ||
         !std::filesystem::exists(watch.file(), failed);
}

bool has_parameters_for(const std::string& node, const std::string& file) {
  const ros::ParameterFile read = ros::read_parameter_file(file);
  return std::any_of(read.sections.begin(), read.sections.end(), [&](const auto& section) {
    return ros::node_name_matches(section.node, node) &&
           !std::all_of(section.parameters.begin(), section.parameters.end(),
                        [](const auto& parameter) { return is_ros_key(parameter.first); });
  });
}

}  // namespace

LiveParameters::LiveParameters(boost::asio::io_context& io, ros::Node& node, Config config,
                               std::optional<PairingFolder> folder, Changes changes)
    : io_(io),
      node_(node),
      config_(std::move(config)),
      changes_(std::move(changes)),
      server_(node, server_options()),
      folder_(std::move(folder)) {
  speaking_ = speaking_files();
  regular_ = node_.facts().parameter_files;
  std::erase_if(regular_, [](const auto& file) { return !ros::can_be_read_twice(file); });
  if (folder_) files_.emplace_back(folder_->parameter_file());
  for (const auto& file : node_.facts().parameter_files) files_.emplace_back(file);
  for (const auto& [key, value] : config_.given)
    if (!node_.facts().parameter_overrides.contains(key)) added_.emplace(key, value);
  // The files were read seconds ago, so only a second reading finds a change since then.
  if (std::all_of(files_.begin(), files_.end(), can_be_read_again))
    for (auto& file : files_) static_cast<void>(file.failed({}));
}

ros::ParameterServerOptions LiveParameters::server_options() {
  ros::ParameterServerOptions options;
  options.entries = [this] { return describe_parameters(config_); };
  options.set = [this](const std::vector<Parameter>& p) { return set(p); };
  options.describe = [this](const std::string& name) {
    return describe_parameter(name, config_.role);
  };
  options.use_sim_time = changes_.use_sim_time;
  options.wake = [this] { boost::asio::post(io_, [this] { answer(); }); };
  return options;
}

void LiveParameters::answer() {
  if (server_.drain()) boost::asio::post(io_, [this] { answer(); });
}

ros::SetResult LiveParameters::set(const std::vector<Parameter>& parameters) {
  Parsed parsed = apply_change(config_, parameters, {});
  if (!parsed.config) {
    std::string reason = joined(parsed.problems);
    refuse(reason);
    return {false, std::move(reason)};
  }
  for (const auto& warning : parsed.config->warnings) node_.log(LogLevel::kWarn, warning);
  const RuleChanges rules = rule_changes(config_, *parsed.config);
  const auto others = settings_changed(config_, *parsed.config);
  std::string what = others.empty() || !rules.none() ? "rules: " + to_text(rules) : "";
  if (!others.empty())
    what += (what.empty() ? "" : "; ") + ("changed: " + fmt::format("{}", fmt::join(others, ", ")));
  config_ = std::move(*parsed.config);
  changes_.config(config_);
  node_.log(LogLevel::kInfo, what);
  changes_.audit(AuditEvent::kRulesChanged, what);
  return {};
}

void LiveParameters::refuse(const std::string& why) {
  node_.log(LogLevel::kError, "the parameters stay as they were: " + why);
  changes_.audit(AuditEvent::kRulesRefused, why);
}

void LiveParameters::refuse_files(const std::string& why) {
  refused_files_ = {rfc3339(std::chrono::system_clock::now()), why};
  refuse(why);
}

void LiveParameters::check_files() {
  bool changed = false;
  for (auto& file : files_) changed = file.settled_change() || changed;
  if (changed) return reload(true);
  const auto is_missing = [](const auto& file) { return file.is_missing(); };
  // Nothing reads them before one appears.
  if (lacks_means_ && std::all_of(files_.begin(), files_.end(), is_missing))
    lacks_means_ = lacks_means_to_read();
}

// The pairing's parameters count even before it has written its file.
ParameterMap LiveParameters::read_again(std::string& problem) const {
  const auto given = node_.read_overrides_again();
  problem = given.problem;
  const bool stored = folder_ && folder_->has("params.yaml") && problem.empty();
  return filled(given.parameters, stored ? folder_->parameters(problem) : added_);
}

// A file may be empty on a full disk, or while it is copied. rcl accepts that, and a client would
// then use the default rules in place of its own.
std::string LiveParameters::emptied_file(const ParameterMap& again) const {
  const bool lost = std::any_of(config_.given.begin(), config_.given.end(),
                                [&](const auto& entry) { return !again.contains(entry.first); });
  if (!lost) return {};
  const std::vector<std::string> speaking = speaking_files();
  for (const auto& file : speaking_)
    if (std::find(speaking.begin(), speaking.end(), file) == speaking.end())
      return file + " has nothing for " + node_.facts().full_name + " any longer";
  return {};
}

bool LiveParameters::lacks_means_to_read() const {
  return std::any_of(files_.begin(), files_.end(),
                     [](const auto& file) { return lacks_means_to_open(file.file()); });
}

// Pipes cannot be read twice, so they are assumed to still have parameters for us.
std::vector<std::string> LiveParameters::speaking_files() const {
  std::vector<std::string> speaking = node_.facts().parameter_files;
  std::erase_if(speaking, [&](const auto& file) {
    std::error_code ignored;
    return std::filesystem::is_regular_file(file, ignored) &&
           !has_parameters_for(node_.facts().full_name, file);
  });
  return speaking;
}

void LiveParameters::reload(bool changed) {
  if (files_.empty())
    return node_.log(LogLevel::kWarn,
                     "no parameter file was given: there is nothing to read again");
  std::string unread = config_.reached_by_others ? no_longer_regular(config_, regular_) : "";
  const ParameterMap again = unread.empty() ? read_again(unread) : ParameterMap{};
  lacks_means_ = !unread.empty() && lacks_means_to_read();
  if (unread.empty() && config_.reached_by_others)
    unread = who_may_change_rules(config_, node_.facts().parameter_files);
  if (unread.empty() && changed && !std::exchange(has_looked_, true) &&
      again == filled(node_.facts().parameter_overrides, added_)) {
    refused_files_.reset();
    speaking_ = speaking_files();
    return;
  }
  if (unread.empty())
    if (const std::string emptied = emptied_file(again); !emptied.empty())
      return refuse_files(emptied);
  if (!unread.empty()) {
    bool news = !changed;
    for (auto& file : files_) news = file.failed(unread) || news;
    return news ? refuse_files(unread) : void();
  }
  Surroundings around = surroundings();
  // Files of keys that need a restart are not checked.
  around.unreadable = {};
  around.distrusted = {};
  FileChanges found = file_changes(config_, again, around);
  if (found.problems.empty())
    found.problems = apply_change(config_, found.changes, around).problems;
  if (!found.problems.empty())
    return refuse_files("in the parameter file: " + joined(found.problems));
  refused_files_.reset();
  speaking_ = speaking_files();
  needs_restart_ = found.fixed;
  if (!found.fixed.empty())
    node_.log(LogLevel::kWarn,
              joined(found.fixed) + ": changed in the parameter file; this needs a restart");
  if (found.changes.empty())
    return node_.log(LogLevel::kInfo, "the parameter file was read again; none changed");
  if (const auto result = server_.set(std::move(found.changes)); !result.successful)
    node_.log(LogLevel::kError, "the parameter file was not applied: " + result.reason);
}

}  // namespace connect_bridge
