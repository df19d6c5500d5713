// A relay that is set up by commands alone: its files, and the line with which a robot gets to it.
#pragma once

#include <string>

#include "core/ports/url.hpp"

namespace connect_bridge {

// Where a relay has its files by default: $HOME/.connect_relay
[[nodiscard]] std::string relay_folder();

// Makes what is missing in the folder: a certificate for the host of this URL, a file for the
// robots' tokens, and relay.yaml, which listens at the URL's port. Empty, or what is wrong.
[[nodiscard]] std::string make_relay_files(const std::string& folder, const Url& url);

// Adds a token for the robot of this URL to those that the relay with this file knows. The line for
// the robot; empty: `problem` says why.
[[nodiscard]] std::string add_robot(const std::string& relay_file, const Url& url,
                                    std::string& problem);

}  // namespace connect_bridge
