// The configuration in use, and the parameters of the node that show and change it.
#pragma once

#include <boost/asio/io_context.hpp>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "access/login/file_watch.hpp"
#include "access/pairing/pairing_folder.hpp"
#include "config/config.hpp"
#include "core/ports/audit.hpp"
#include "ops/status/status_picture.hpp"
#include "ros/node/node.hpp"
#include "ros/services/parameter_server.hpp"

namespace connect_bridge {

// Runs on the thread of the io_context.
class LiveParameters {
 public:
  struct Changes {
    // Called when keys that may change at run time have changed.
    std::function<void(const Config& now)> config;
    std::function<void(bool on)> use_sim_time;
    // Called for the audit log: the change, or the reason of its refusal.
    std::function<void(AuditEvent event, const std::string& what)> audit;
  };

  // `folder`: the pairing's folder, whose file of parameters is read again, too.
  LiveParameters(boost::asio::io_context& io, ros::Node& node, Config config,
                 std::optional<PairingFolder> folder, Changes changes);

  [[nodiscard]] const Config& config() const { return config_; }
  // The files as they are now were refused; empty: they were not.
  [[nodiscard]] const std::optional<RefusedParameters>& refused_files() const {
    return refused_files_;
  }
  // The keys that a restart would change, by the files as they were last accepted.
  [[nodiscard]] const std::vector<std::string>& needs_restart() const { return needs_restart_; }
  // Reads the parameter files again if one has changed and is not being written. The first check
  // after the start always reads, and logs nothing if nothing has changed. Blocks as long as the
  // disk does.
  void check_files();
  // Whether they have changed, and descriptors or memory to read them are lacking.
  [[nodiscard]] bool lacks_means() const { return lacks_means_; }
  // Reads them in any case. What may change does, as a whole or not at all; the log says what
  // changed, what is wrong, and what else has changed and needs a restart.
  void reload() { reload(false); }

 private:
  [[nodiscard]] ros::ParameterServerOptions server_options();
  // Reads the files again. `changed`: the files have changed; a problem is then logged once.
  void reload(bool changed);
  ros::SetResult set(const std::vector<Parameter>& parameters);
  void answer();
  void refuse(const std::string& why);
  void refuse_files(const std::string& why);
  // The parameters of the node's files and arguments, and of the pairing. `problem`: the reason if
  // they cannot be read.
  [[nodiscard]] ParameterMap read_again(std::string& problem) const;
  // Whether one of the files cannot be opened because descriptors or memory are lacking now.
  [[nodiscard]] bool lacks_means_to_read() const;
  // Reports a file that no longer has parameters for this node, if keys in use are gone; empty:
  // none.
  [[nodiscard]] std::string emptied_file(const ParameterMap& again) const;
  // The files of --params-file that have parameters for this node.
  [[nodiscard]] std::vector<std::string> speaking_files() const;

  boost::asio::io_context& io_;
  ros::Node& node_;
  Config config_;
  const Changes changes_;
  ros::ParameterServer server_;
  const std::optional<PairingFolder> folder_;
  std::vector<FileWatch> files_;
  ParameterMap added_;  // parameters that the pairing added at the start to files and -p
  std::vector<std::string> regular_;  // files of --params-file that are no pipes
  // The files with parameters for this node at their last use; at first all files.
  std::vector<std::string> speaking_;
  bool lacks_means_ = false;
  std::optional<RefusedParameters> refused_files_;
  std::vector<std::string> needs_restart_;
  bool has_looked_ = false;  // whether a change since the program read them was looked for
};

}  // namespace connect_bridge
