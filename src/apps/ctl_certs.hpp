// `ctl certs`: a private authority and the certificates that it signs.
#pragma once

#include <CLI/CLI.hpp>

#include "net/authority.hpp"

namespace connect_bridge {

// Its arguments go to `order`, which must outlive the parsing.
CLI::App* add_certs_command(CLI::App& app, CertificateOrder& order);

// Returns the exit code; prints what was made and which parameters use it.
int run_certs(const CertificateOrder& order);

}  // namespace connect_bridge
