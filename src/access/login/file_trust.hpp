// Whether a file that decides over rights says what its owner wrote.
#pragma once

#include <string>

namespace connect_bridge {

// Who else than root and the user of this program could change what the file says, as a sentence
// with the cure; empty: nobody. As StrictModes of OpenSSH: the file and all folders above it, and
// each link on the way with the folders of its target, belong to root or to this user, and nobody
// else may write them. Passed are a folder with the sticky bit, and a group that only this user is
// in (as Debian's OpenSSH has it). What is missing is passed: whoever reads it will say so. Blocks
// as the file system and the user database do.
[[nodiscard]] std::string who_else_may_change(const std::string& file);

}  // namespace connect_bridge
