// docs/config.md, made from the table.
#include <fmt/format.h>

#include "config/config.hpp"

namespace connect_bridge {
namespace {

constexpr char kHead[] = R"(# Parameters

*Made by `ctl config-doc` from the table in `src/config`; change it there.*

The two programs are ROS nodes, and these are their ROS parameters: give them in a parameter file
(`ros2 run connect_bridge server --ros-args --params-file robot.yaml`) or one by one
(`-p listen.port:=9091`). `config/` has complete examples. `ctl check FILE` says in words what a
file means.

All parameters are checked at start. A key that is unknown, a value that is out of range, two keys
that contradict each other: every problem is told, with the key, the value and what was expected,
and nothing is opened. Numbers may be written without a decimal point; a list must be a list even
if it has one entry. `use_sim_time` and `qos_overrides.*` are left to ROS.

*Run time* says whether `ros2 param set` may change the parameter while the node runs. A change
that leads to any problem is refused as a whole. Secrets do not appear among the node's
parameters.
)";

constexpr char kRules[] = R"(
## How rules work

A rule is a group of name patterns with a direction, with whom it is for, and with how messages
are treated. `rules` lists their names in order; `rule.<name>.*` are the keys of each.

```yaml
connect_server:
  ros__parameters:
    rules: [drive, camera, base]
    rule:
      drive:
        import_topics: [/cmd_vel]
        types: [geometry_msgs/msg/Twist]
        identities: [ops]
        priority: urgent
        max_age: 0.3
      camera: {export_topics: ["/camera/**"], priority: bulk, max_rate: 15.0}
      base: {export_topics: [/tf, /tf_static, /odom], deny: ["/camera/secret/**"]}
```

- **Direction.** *export*: an interface of this side is offered to the peer. *import*: an
  interface of the peer is made to exist here. Both sides have rules, and both must agree: a
  robot's `import_topics: [/cmd_vel]` takes what an operator's rules export.
- **Default.** What no rule allows is not exchanged. A server without rules exchanges nothing and
  says so loudly. A client without rules imports and exports everything but `/rosout`: topics,
  services, actions and parameters; what it really gets is what the server's rules allow.
- **Order.** The first rule that allows an interface decides its treatment. Put the special ones
  first.
- **deny wins.** A `deny` pattern of any rule that is for this peer takes the name away from all
  rules, whatever their order. A rule may consist of `deny` alone.
- **Patterns** are absolute names. `*` stands for any characters within one part of a name, `**`
  for whole parts, one or more at the end and any number elsewhere: `/camera/*` matches
  `/camera/info`, not `/camera/left/info`; `/camera/**` matches both, and not `/camera`. Hidden
  parts (`/_x`) are allowed only by a pattern that spells out the `_`; a `deny` covers them, too.
- **For whom.** `identities` and `groups` narrow a rule to who logged in; it applies to those who
  are among the identities or in one of the groups. With neither it applies to everyone who is
  logged in.
- **types** narrows a rule to types, by their full names, without wildcards.
- **Services** are opened by `export_services` and `import_services` as topics are by theirs: a
  service of this side that the peer may call is exported.
- **Actions** are opened by the name of the action alone, as one thing: its hidden services and
  topics (`/fib/_action/send_goal` ...) need no patterns of their own, and no pattern for topics or
  services opens them, not even `/**`. In `types` stands the action's type. A `deny` of any of its
  parts denies the action.
- **Parameters.** `parameters` names nodes. It opens their six parameter services and their
  messages on `/parameter_events`, in both directions, whatever `types` says; no other pattern opens
  them. A `deny` takes away a node by its name or single services: with `/**/set_parameters*` what
  is opened can be read and not set.
- **Calls.** `calls_max`, `server_queue` and `call_timeout` treat services, and the services of
  actions and parameters. The side with the real server applies them. `calls_max` calls of a service
  are under way for one peer, later ones wait for their turn, and beyond 1000 waiting they are
  refused. A caller that is refused or whose call timed out gets no answer, as ROS has it; both logs
  say so. A goal's result may take hours: asking for it counts against neither `calls_max` nor
  `call_timeout`.
- **The queue of a server.** DDS throws away the oldest request of a full queue without a word, and
  no graph tells how long a server's queue is. By ROS's default it keeps 10 requests, so at most
  `server_queue` (10) requests of all peers together are handed over that the server may not have
  taken yet. An answer proves that it has taken all the requests before that one; without an answer
  it is presumed to have taken them after 5 s (requests for results: 1 s). A server that works on
  more than 10 calls at once therefore gets more only every 5 s, unless it answers meanwhile: for
  such a server give the length of its real queue, or 0 to hand over every request at once.
- **At run time** rules can change one parameter at a time: define `rule.new.*` first, then name
  it in `rules`. Until it is named, it has no effect. Rights are evaluated again for everything
  that is open. `clock` and `clock_rate` need a restart.

### Examples

Everything of the robot may be seen, nothing may be sent to it:

```yaml
    rules: [watch]
    rule:
      watch: {export_topics: ["/**"]}
```

A robot that is driven by goals, whose controller can be tuned but by nobody but the crew:

```yaml
    rules: [navigate, tune]
    rule:
      navigate:
        export_actions: [/navigate_to_pose, "/arm/*"]
        export_services: ["/map_server/*"]
        call_timeout: 10.0
      tune: {parameters: [/controller_server], groups: [crew]}
```

Commands that are late are worse than none; keep only the newest:

```yaml
    rules: [drive]
    rule:
      drive:
        import_topics: [/cmd_vel, /joy]
        priority: urgent
        max_age: 0.2
        qos: {depth: 1}
```

A thin link, maps and clouds squeezed:

```yaml
    rules: [big, all]
    rule:
      big:
        export_topics: [/map, "/points/*"]
        priority: bulk
        compression: "zstd:6"
        max_rate: 2.0
        max_bytes_per_second: 200000
      all: {export_topics: ["/**"], compression: lz4}
```

A simulator beyond the link, whose time drives this side (a client). With `clock: publish` the
peer's /clock is not forwarded; this side makes its own from the peer's time:

```yaml
    url: ws://localhost:9090/
    rules: [time, all]
    rule:
      time: {import_topics: [/clock], clock: publish, clock_rate: 100}
      all: {import_topics: ["/**"], export_topics: [/cmd_vel]}
```

Two robots at one operator: one client each, with `prefix: /robot1` and `prefix: /robot2`. The
robot's /scan is /robot1/scan here, and what is published here on /robot1/cmd_vel is the robot's
/cmd_vel. Rules speak of /scan and /cmd_vel, so they are the same for each robot.

## Login and TLS

A server that listens beyond loopback must have a login, and TLS unless `allow_plaintext: true` (a
trusted network, or a proxy that does TLS in front of it). The token is taken from the first that
is given: `auth.token`, `auth.token_file`, the environment variable `CONNECT_BRIDGE_TOKEN`. A URL
must not carry a user or a password.
)";

std::string used_by_text(UsedBy used_by) {
  if (used_by == UsedBy::kBoth) return "both";
  return used_by == UsedBy::kServer ? "server" : "client";
}

// In a cell of a table a bar would end the cell, and <name> would be taken for HTML.
std::string code(std::string_view text) {
  std::string escaped;
  for (const char c : text) escaped += c == '|' ? std::string("\\|") : std::string(1, c);
  return "`" + escaped + "`";
}

std::string allowed_text(const KeySpec& spec) {
  if (!spec.words.empty()) {
    std::string text;
    for (const std::string& word : spec.words) text += (text.empty() ? "" : ", ") + code(word);
    return text;
  }
  if (spec.min && spec.max) {
    return fmt::format("{:.15g} to {:.15g}{}{}", *spec.min, *spec.max, spec.unit.empty() ? "" : " ",
                       spec.unit);
  }
  return "";
}

std::string row(const KeySpec& spec) {
  std::string help = spec.help;
  if (spec.secret) help += " Secret.";
  return fmt::format("| {} | {} | {} | {} | {} | {} | {} |\n", code(spec.key), name_of(spec.type),
                     spec.fallback ? code(to_text(*spec.fallback)) : "", allowed_text(spec),
                     used_by_text(spec.used_by), spec.changeable ? "yes" : "", help);
}

}  // namespace

std::string config_document() {
  std::string text = kHead;
  std::string section;
  for (const KeySpec& spec : key_table()) {
    if (spec.section != section) {
      section = spec.section;
      text += fmt::format("\n## {}\n\n", section);
      text += "| key | type | default | allowed | for | run time | meaning |\n";
      text += "| --- | --- | --- | --- | --- | --- | --- |\n";
    }
    text += row(spec);
  }
  return text + kRules;
}

}  // namespace connect_bridge
