// The commands of `ctl`, each in a file of its own name.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

// Says on standard error what is wrong, in lines. Returns the exit code.
int complain(const std::string& lines, int exit_code);

// Each adds its command to the program. When its arguments are parsed it runs, and sets the exit
// code of the program; what that means is in its help.

// A private authority and the certificates that it signs.
void add_certs_command(CLI::App& app, int& exit_code);
// A token for a client, and its entry for the server's token file.
void add_token_command(CLI::App& app, int& exit_code);
// Why rules allow an interface or not.
void add_explain_command(CLI::App& app, int& exit_code);
// The activity of a running side, on one screen.
void add_status_command(CLI::App& app, int& exit_code);
// Why it does not work, with cause and cure.
void add_doctor_command(CLI::App& app, int& exit_code);
// The findings for this user's programs, as text.
[[nodiscard]] std::string doctor_report();
// One file for whoever is asked for help.
void add_bugreport_command(CLI::App& app, int& exit_code);
// How good the link to a server is.
void add_ping_command(CLI::App& app, int& exit_code);
void add_bench_command(CLI::App& app, int& exit_code);
