// Checks that nobody else may change a file that decides over rights.
#pragma once

#include <string>

namespace connect_bridge {

// Reason why a user beside root and the user of this program could change the file, as a sentence
// with the cure; empty: nobody could. The rules are those of StrictModes in OpenSSH. The file and
// all folders above it belong to root or to this user, and nobody else may write them. The same
// holds for each link on the path, with the folders of its target. Two exceptions pass: a folder
// with the sticky bit, and a group that only the owner is in (as in Debian's OpenSSH). A missing
// file passes, too: its reader reports it. Blocks as the file system and the user database do.
[[nodiscard]] std::string who_else_may_change(const std::string& file);

// The same for a file that was just read: a missing one does not pass. Whoever owns a folder above
// it could rename that folder away, so that nobody sees whose content was read. A pipe that this
// process was given (/dev/fd/3) passes: it has no path.
[[nodiscard]] std::string who_else_may_have_changed(const std::string& file);

}  // namespace connect_bridge
