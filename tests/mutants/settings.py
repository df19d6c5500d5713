"""Faults in how parameters are read: what a file allows, and what is refused before the start."""

from mutant import Mutant

SETTINGS = [
    # who may come
    Mutant("without TLS anybody may be reached",
           "if (!values_.flag(\"allow_plaintext\")) {", "if (false) {"),
    Mutant("a client dials another machine without TLS",
           "if (!syntax::is_loopback(url->host)) {", "if (false) {"),
    Mutant("no login is needed beyond this machine",
           "if (config_.auth.method == \"none\") {", "if (false) {", within="check_listen"),
    Mutant("behind proxies no login is needed",
           "if (!beyond && config_.listen.trusted_proxies.empty()) return;",
           "if (!beyond) return;"),
    Mutant("proxies without TLS are others, too",
           "!config_.listen.trusted_proxies.empty() && !values_.flag(...);", "false;"),
    Mutant("all that begins with 127 is this machine", "return ipv4->front() == 127;",
           "return ipv4->front() >= 127;"),
    Mutant("one address of this machine is enough",
           "return std::all_of(addresses.begin(), addresses.end(), [](const std::string& address) {"
           " return is_loopback(address); });",
           "return std::any_of(addresses.begin(), addresses.end(), [](const std::string& address) {"
           " return is_loopback(address); });"),
    Mutant("every address is a proxy's", "&& *bits > 0", ""),
    Mutant("a key without its certificate",
           "if (key && !certificate) add(\"tls.certificate\", ...);", ""),
    Mutant("keys come without TLS",
           "if (url && !url->secure && !is_loopback(url->host)) return std::nullopt;", ""),
    Mutant("a pin is any text", "text.size() == 44 && text[43] == '=' &&", ""),
    # rules
    Mutant("a client without rules lets the server call its services",
           "rule.import_actions = syntax::parse_patterns({\"/**\"});",
           "rule.import_actions = syntax::parse_patterns({\"/**\"});"
           " rule.export_services = syntax::parse_patterns({\"/**\"});"),
    Mutant("logs of nodes cross", "rule.deny = syntax::parse_patterns({\"/rosout\"});", ""),
    Mutant("the peer's clock comes, too",
           "if (!clock_from.empty()) set.rules.push_back(clock_rule(clock_from));", ""),
    Mutant("parameters of a server are imported",
           "role == Role::kServer ? rule.export_parameters : rule.import_parameters;",
           "role == Role::kClient ? rule.export_parameters : rule.import_parameters;"),
    Mutant("a rule without effect is silent",
           "if (moment == Moment::kStart) {", "if (moment == Moment::kRunning) {"),
    Mutant("a rule that allows nothing is silent", "if (!allows_or_denies(values, name)) {",
           "if (false) {"),
    Mutant("without a login a rule is for somebody", "if (names->empty()) continue;", "continue;",
           within="read_policy"),
    Mutant("a peer is announced more than it can compare",
           "if (count > max)", "if (false)", within="check_announced"),
    Mutant("a misspelt type is silent",
           "|| around_.installed(type)) continue;", "|| true) continue;"),
    # changes
    Mutant("what needs a restart changes",
           "if (fixed && !has(current, key, *spec, value)) {", "if (false) {"),
    Mutant("half of a change is applied",
           "if (!parsed.problems.empty()) parsed.config.reset();", ""),
    Mutant("a rule that is gone stays", "if (!now.contains(key)) compare(key, std::nullopt);", "",
           within="file_changes"),
    # secrets
    Mutant("a token is shown", "spec.secret || has_login ? kHidden", "has_login ? kHidden"),
    Mutant("a misspelt key shows a token", "may_be_secret(key, nearest) ? kHidden : to_text(value)",
           "to_text(value)"),
    Mutant("a password of a proxy is shown", "spec.secret || has_login ? kHidden",
           "spec.secret ? kHidden"),
    Mutant("a user's password in a URL is shown", "authority.replace(0, at, \"...\");", ""),
    # proxies of the environment
    Mutant("no_proxy ends with any letters",
           "host.ends_with(\".\" + name)", "host.ends_with(name)"),
    Mutant("this machine is reached through a proxy",
           "if (!variable || syntax::is_loopback(host)) return std::nullopt;",
           "if (!variable) return std::nullopt;"),
]
