// A relay that is set up by commands alone: its files, and the line with which a robot gets to it.
#pragma once

#include <string>

#include "access/login/secret.hpp"
#include "core/base/time.hpp"
#include "core/ports/url.hpp"

namespace connect_bridge {

// The default folder of a relay's files: .connect_relay in $HOME, or in the user's home without
// one.
[[nodiscard]] std::string relay_folder();

// Makes what is missing in the folder: a certificate for the host of this URL, a file for the
// robots' tokens, and relay.yaml, which listens at the URL's port. Empty, or what is wrong.
[[nodiscard]] std::string make_relay_files(const std::string& folder, const Url& url);

// The line for the robot of this URL at the relay with this file; its code, which works once and
// for 24 hours, is added to the robots' tokens. Empty: `problem` says why.
[[nodiscard]] std::string add_robot(const std::string& relay_file, const Url& url, Stamp now,
                                    std::string& problem);

// The printed text with a robot's registration command (secret_to_print()); the file is
// "FOLDER/robot7.line".
[[nodiscard]] std::string line_to_print(const std::string& robot, const std::string& line,
                                        bool terminal, const std::string& folder,
                                        std::string& problem);

// The name is from now on that of this token alone: it replaces the robot's entries in the file of
// tokens, with the codes of its lines, if this code is still one of them. Empty, or what is wrong.
[[nodiscard]] std::string hand_over(const std::string& token_file, const std::string& robot,
                                    const Digest& token, const Digest& code, Stamp now);

}  // namespace connect_bridge
