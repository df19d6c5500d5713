// Files of a pairing, with which a program starts without a parameter file.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/parameter.hpp"
#include "core/ports/net_options.hpp"

namespace connect_bridge {

// The cure when a folder is in use already.
inline constexpr char kOwnName[] = "give this one a name: --ros-args -r __node:=NAME";

// The folder $ROS_HOME, or ~/.ros.
[[nodiscard]] std::string ros_home();

// The running server of a folder.
struct RunningServer {
  pid_t process = 0;
  std::uint16_t port = 0;  // on which it listens
};

// Other processes find this server by running() as long as this object lives.
class RunningMark {
 public:
  RunningMark(const std::string& file, std::uint16_t port);
  ~RunningMark();
  RunningMark(const RunningMark&) = delete;
  RunningMark& operator=(const RunningMark&) = delete;

 private:
  int handle_;
};

// The folder of one node: $ROS_HOME/connect_bridge/NODE, or ~/.ros/connect_bridge/NODE. It holds
// params.yaml, which is a ROS parameter file like any other, and the files that it names.
class PairingFolder {
 public:
  // `strict`: the folder is not used if another user may change it or its files (`strict_modes`).
  explicit PairingFolder(const std::string& node, bool strict = true);

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::string file(const std::string& name) const { return path_ + "/" + name; }
  [[nodiscard]] std::string parameter_file() const { return file("params.yaml"); }
  // File that asks a running server to let one client in (PairingOptions).
  [[nodiscard]] std::string invited_file() const { return file("invited"); }
  // File with an invitation's text for a person, if it is not printed.
  [[nodiscard]] std::string invitation_file() const { return file("invitation"); }
  // File of the RunningMark.
  [[nodiscard]] std::string running_file() const { return file("running"); }
  // The server that holds the RunningMark now; nullopt: none runs.
  [[nodiscard]] std::optional<RunningServer> running() const;
  [[nodiscard]] bool has(const std::string& name) const;
  // The file for the token of an invitation with this code; the same invitation, used again, finds
  // the same file. `kind`: the beginning of the file's name.
  [[nodiscard]] std::string token_file(const std::string& kind, const std::string& code) const;
  // Removes the file of a former token, if it is one of this folder and not in use now.
  void remove_former(const std::string& kind, const std::string& former,
                     const std::string& now) const;

  // Creates the folder, with the folders above it, for its owner alone. Returns the problem, also
  // if it exists and others may change it (strict); empty: none.
  [[nodiscard]] std::string make() const;
  // The parameters in params.yaml; empty: there is no such file. `problem` is set if it cannot be
  // read, or if another user may change it (strict).
  [[nodiscard]] ParameterMap parameters(std::string& problem) const;
  // The reason why this folder cannot store a pairing in which `robot` is the robot's end; empty:
  // it can. A folder holds the rights of one kind of pairing.
  [[nodiscard]] std::string other_kind(const ParameterMap& stored, Role robot) const;
  // The folder of another client that has paired with a robot and has its names below the same
  // prefix; empty: there is none.
  [[nodiscard]] std::string other_client(const std::string& prefix) const;
  // Replaces params.yaml. Returns the problem; empty: none.
  [[nodiscard]] std::string write_parameters(const ParameterMap& parameters) const;

 private:
  [[nodiscard]] std::string distrusted(const std::string& file) const;

  std::string path_;
  bool strict_;
};

// Whether the pairing's parameters are used: neither the given ones nor the environment have an
// address, a login or a certificate.
[[nodiscard]] bool goes_by_pairing(const ParameterMap& given);

// The given parameters, and those of `stored` that were not given. Rules count as one: if any is
// given, none is taken from `stored`.
[[nodiscard]] ParameterMap filled(const ParameterMap& given, const ParameterMap& stored);

}  // namespace connect_bridge
