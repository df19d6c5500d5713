// `ctl token`: a token for a client, and its entry for the server's token file.
#pragma once

#include <string>
#include <vector>

struct TokenRequest {
  std::string identity;
  std::vector<std::string> groups;
  std::string expires;  // a date in UTC; empty: never, or `days`
  int days = 0;         // from now on; 0: no limit
  std::string comment;
  std::string file;     // the server's; empty: the entry is printed only
  bool remove = false;  // the identity's entries are removed from the file instead
};

// The token is written to standard output only, so that it can be redirected into a file; the entry
// is appended to the file, or written to standard error. Returns the exit code: 0, or 2 with what
// is wrong on standard error and nothing changed.
int make_token(const TokenRequest& request);

// Removes what `request` names. Returns the exit code: 0, or 2 with what is wrong on standard error
// and nothing changed.
int remove_token(const TokenRequest& request);
