#include "run/live_parameters.hpp"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <string>
#include <utility>

#include "config/describe.hpp"
#include "config/rule_changes.hpp"
#include "run/assembly.hpp"
#include "run/pairing_folder.hpp"

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

}  // namespace

LiveParameters::LiveParameters(boost::asio::io_context& io, ros::Node& node, Config config,
                               std::optional<PairingFolder> folder, Changes changes)
    : io_(io),
      node_(node),
      config_(std::move(config)),
      changes_(std::move(changes)),
      server_(node, server_options()),
      folder_(std::move(folder)) {
  if (folder_) files_.emplace_back(folder_->parameter_file());
  for (const auto& file : node_.facts().parameter_files) files_.emplace_back(file);
  for (const auto& [key, value] : config_.given)
    if (!node_.facts().parameter_overrides.contains(key)) added_.emplace(key, value);
}

ros::ParameterServerOptions LiveParameters::server_options() {
  ros::ParameterServerOptions options;
  options.entries = describe_parameters(config_);
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
  const std::string what = to_text(rule_changes(config_, *parsed.config));
  config_ = std::move(*parsed.config);
  changes_.policy(config_.policy);
  node_.log(LogLevel::kInfo, "rules: " + what);
  changes_.audit(AuditEvent::kRulesChanged, what);
  return {};
}

void LiveParameters::refuse(const std::string& why) {
  node_.log(LogLevel::kError, "the rules stay as they were: " + why);
  changes_.audit(AuditEvent::kRulesRefused, why);
}

void LiveParameters::check_files() {
  bool changed = false;
  for (auto& file : files_) changed = file.settled_change() || changed;
  if (changed) reload(true);
}

// Before the pairing has written its file, what it will write counts.
ParameterMap LiveParameters::read_again(std::string& problem) const {
  const auto given = node_.read_overrides_again();
  problem = given.problem;
  const bool stored = folder_ && folder_->has("params.yaml") && problem.empty();
  return filled(given.parameters, stored ? folder_->parameters(problem) : added_);
}

void LiveParameters::reload(bool changed) {
  if (files_.empty())
    return node_.log(LogLevel::kWarn,
                     "no parameter file was given: there is nothing to read again");
  std::string unread;
  const ParameterMap again = read_again(unread);
  if (!unread.empty()) {
    bool news = !changed;
    for (auto& file : files_) news = file.failed(unread) || news;
    return news ? refuse(unread) : void();
  }
  FileChanges found = file_changes(config_, again);
  if (found.problems.empty()) {
    Surroundings around = surroundings();
    around.readable = {};  // not checked: files of keys that need a restart
    found.problems = apply_change(config_, found.changes, around).problems;
  }
  if (!found.problems.empty()) return refuse("in the parameter file: " + joined(found.problems));
  if (!found.fixed.empty())
    node_.log(LogLevel::kWarn,
              joined(found.fixed) + ": changed in the parameter file; this needs a restart");
  if (found.changes.empty())
    return node_.log(LogLevel::kInfo, "the parameter file was read again; rules: none changed");
  if (const auto result = server_.set(std::move(found.changes)); !result.successful)
    node_.log(LogLevel::kError, "the parameter file was not applied: " + result.reason);
}

}  // namespace connect_bridge
