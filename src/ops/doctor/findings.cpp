#include "ops/doctor/findings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "core/base/json.hpp"

namespace connect_bridge {
namespace {

constexpr bool kHint = true;
constexpr bool kFault = false;

constexpr Finding kFindings[] = {
    // ---- the way to the server
    {"host_unknown", kFault, "the name of the server cannot be resolved",
     "check the host in `url`, and the name server of this network"},
    {"resolver_silent", kFault, "no name server answers, so the name of the server is not known",
     "check this machine's network and name server (/etc/resolv.conf), or give an IP address in "
     "`url`"},
    {"port_closed", kFault, "nobody listens at this address and port",
     "start the server; check the port in `url` (443 if it names none) against `listen.port` (9090 "
     "by default). For other machines the server needs `listen.address`: by default it listens on "
     "127.0.0.1 alone, with 0.0.0.0 on IPv4 alone, with * on all. A name that leads to 127.x.x.x "
     "is this machine itself (/etc/hosts)"},
    {"no_route", kFault, "this machine has no route to the address",
     "look at this machine's own network: cable, Wi-Fi, gateway (ip route)"},
    {"no_answer", kFault, "nothing answers at this address",
     "check the address: has the server another one now, or is that of its name an old one "
     "(/etc/hosts), or one of a container or another network (172.17.x.x)? `server --pair HOST` "
     "names the one that clients reach. Check the firewall: one TCP port must be open at the "
     "server"},
    {"server_silent", kFault, "something accepts the connection there and does not answer",
     "look at the server: is its process stopped or overloaded? Others do the same: a forwarded "
     "port, tunnel or balancer (ssh -L, DNAT) without a server behind it; a proxy whose PROXY "
     "header the server does not expect (its log says so); a TLS port that ws:// dials; a path "
     "that loses large packets only (a tunnel: try a smaller mtu), or that delays by seconds since "
     "an upload or download fills it"},
    {"path_wrong", kFault, "an HTTP server answers, and has nothing at this path",
     "check the path in `url` against the configuration of the proxy"},
    {"proxy_without_server", kFault, "a proxy answers, and has no server behind it",
     "start the server; check where the proxy forwards to, and whether with TLS (nginx: proxy_pass "
     "http:// or https://)"},
    {"proxy_without_upgrade", kFault,
     "a proxy or web server does not pass on the WebSocket upgrade",
     "let it forward `Upgrade` and `Connection` by HTTP/1.1 (docs/proxies.md)"},
    {"http_login", kFault,
     "a proxy or web server before the server wants a login of its own, or forbids this path",
     "let it pass this path without a login: the bridge has its own"},
    {"captive_portal", kFault,
     "a page answers in place of the server: a captive portal or web site",
     "log in to this network with a browser; check `url`, also against where it is sent to"},
    {"proxy_unreachable", kFault, "the HTTP proxy cannot be reached",
     "check the proxy's address, or do without: `http_proxy: none`, or no_proxy in the "
     "environment"},
    {"proxy_silent", kFault, "the HTTP proxy is there, and does not answer CONNECT",
     "check whether it reaches the server, or do without: `http_proxy: none`, or no_proxy in the "
     "environment"},
    {"proxy_login", kFault, "the HTTP proxy wants another login", "set `http_proxy_login`"},
    {"proxy_refuses", kFault, "the HTTP proxy does not connect to this server",
     "have the proxy allow it (many allow port 443 alone), or set `http_proxy` to another one, or "
     "to none"},
    {"clock_or_certificate_early", kFault, "the server's certificate is not valid yet",
     "set this machine's clock; else the server's certificate was made with a wrong clock"},
    {"certificate_expired", kFault, "a certificate has expired",
     "make another one (`ctl certs`), or renew it; check the clock of this machine"},
    {"certificate_ends_soon", kHint, "the certificate in use ends soon",
     "renew it; a running side takes the new files by itself"},
    {"certificate_foreign", kFault, "the server's certificate is of an authority unknown here",
     "does the address still belong to that machine (DHCP, /etc/hosts)? `tls.ca` names the file of "
     "the authority that signed it: copy the server's again (ca.crt of `ctl certs`; behind a relay "
     "the robot's, not the relay's), or set `tls.pin`. If the issuer "
     "is an intermediate authority, append its certificate to the server's `tls.certificate`. If "
     "the server does not know the issuer, a firewall that inspects TLS shows a certificate of its "
     "own"},
    {"certificate_name", kFault, "the server's certificate is for another name",
     "does the address still belong to that machine (DHCP, /etc/hosts)? Then dial a name that is "
     "in the certificate, or set `tls.pin`"},
    {"certificate_purpose", kFault, "the server's certificate is not for servers",
     "`tls.certificate` of the server names server.crt of `ctl certs`, not a client's"},
    {"certificate_pin", kFault, "the server has another key than the one that is pinned",
     "pair again; or, if the key was changed on purpose, add its pin to `tls.pin`"},
    {"certificate_files", kFault, "certificate and private key do not fit, or cannot be read",
     "name the files that belong together in `tls.certificate` and `tls.private_key`, the key "
     "without a passphrase (openssl pkey -in KEY -out PLAIN), of RSA with at least 2048 bits; "
     "`tls.ca` names certificates, never a key"},
    {"client_certificate", kFault, "the server wants a certificate of the client, or another one",
     "set `tls.certificate` and `tls.private_key` to files of the authority in the server's "
     "`tls.ca`; or, if clients need none, take `tls.ca` out of the server's file, which demands "
     "it"},
    {"tls_to_plain_port", kFault, "the server does not speak TLS at this port",
     "dial ws:// instead of wss://, or give the server a certificate. Or is it another program's "
     "port (SSH)?"},
    {"plain_to_tls_port", kFault, "the server speaks TLS at this port",
     "dial wss:// instead of ws://. If `url` has wss://, a proxy before the server forwards "
     "without TLS (nginx: proxy_pass https://)"},
    {"not_this_program", kFault, "what answers there is no ROS2 Connect server",
     "check host and port; rosbridge has the same default port"},
    {"name_not_served", kFault, "what answers has no server of this name (TLS)",
     "check the host in `url` against the names that the proxy there knows; a relay knows robots: "
     "wss://ROBOT@relay.example/"},
    {"relay_unreachable", kFault, "the relay cannot be reached",
     "start the relay; check its address (`url`, at the robot `listen.relay.url`), this machine's "
     "network, and the firewall before the relay"},
    {"relay_refuses", kFault, "the relay refuses this robot",
     "`relay --robot NAME` at the relay prints another line: pair with it again, or put its token "
     "into `listen.relay.token_file`"},
    {"relay_certificate", kFault, "the relay's certificate or key is not the one that is expected",
     "check `listen.relay.ca` and `listen.relay.pin`, and this machine's clock; pair with the "
     "relay again if its key was changed on purpose"},
    {"relay_token_missing", kFault, "there is no usable token for the relay",
     "put the token that `relay --robot NAME` gives into `listen.relay.token_file`"},
    {"relay_is_none", kFault, "what answers there is no relay",
     "check host and port in `listen.relay.url`; a proxy before the relay must pass TLS through"},
    {"relay_fails", kFault, "the connection to the relay fails",
     "look at the log of this side and of the relay"},
    {"no_robot_here", kHint, "none of the robots of this relay is connected",
     "start one with `listen.relay.url`; `ctl doctor` there says what is in its way"},
    {"tls_fails", kFault, "the TLS handshake fails",
     "look at the log of both sides; a proxy or firewall in between may not pass TLS on"},
    {"robot_not_at_relay", kFault, "the relay has no such robot now",
     "check the robot's name in `url`, and the robot's own connection to the relay. A client whose "
     "connections fail again and again gets this answer, too: the first line of its log says why"},
    {"robots_with_one_token", kFault,
     "another machine has the token of this robot: a copied disk, and clients cannot tell which of "
     "the two they drive",
     "at the copy, delete its folder `connect_server`; pair it by a registration command for "
     "another name (`relay --robot`)"},
    {"version", kFault, "the two programs speak other versions of the protocol",
     "install the same version at both sides"},
    {"login_refused", kFault, "the server refuses the login",
     "the server's log says why. A token: is its entry in the server's token file, has it expired "
     "(`ctl token`), is it written without quotes? A JWT: are its issuer and audience those of "
     "`auth.jwt_issuer` and `auth.jwt_audience`, its key in `auth.jwt_keys`, has it expired? A "
     "certificate: is its authority in the server's `tls.ca`? Have both ends one `auth.method`?"},
    {"login_timeout", kFault, "the login was not complete in time",
     "look at the server's log; its login method or the path is slow"},
    {"login_not_tried", kHint, "the way to the server is fine; no login was tried",
     "--token-file FILE, or CONNECT_BRIDGE_TOKEN, tries it"},
    {"login_expired", kFault, "the login has ended: the token or certificate has expired",
     "make a new one (`ctl token`, `ctl certs`)"},
    {"login_withdrawn", kFault, "the credential was withdrawn at the server",
     "make a new one (`ctl token`)"},
    {"login_not_judged", kFault, "the server's login method gives no answer",
     "look at the server's log: the keys or its login service are not reachable"},
    {"too_many_connections", kFault, "the server has no place for this login",
     "end other connections, or raise `connections_max`, of which one identity has half"},
    {"dialed_itself", kFault, "the client has reached its own process", "check `url`"},
    {"link_silent", kFault, "the path is silent for longer than `dead_after`",
     "look at the network; a larger `dead_after` helps where silences are usual"},
    {"connection_lost", kFault, "the connection ended without a word of the other side",
     "look whether the server still runs, and at the network"},
    {"peer_stops", kFault, "the server was stopped", "start it again"},
    {"link_fails", kFault, "the link does not come up", "look at the log of both sides"},

    // ---- a parameter file
    {"file_missing", kFault, "a file that is named does not exist",
     "check its name and its folder; a relative name begins where the program was started"},
    {"file_not_permitted", kFault, "this user may not read a file",
     "chown it to the user of the program, or run the program as its owner"},
    {"file_unreadable", kFault, "a file cannot be read", "check its name, and what it is"},
    {"file_unwritable", kFault, "a file cannot be written",
     "make its folder, let the user of the program write there, and free its disk if it is full"},
    {"start_warns", kHint, "the program starts with this file, and warns",
     "do what the warning says; if it names no cure, look for its words in docs/troubles.md"},
    {"yaml_wrong", kFault, "the parameter file is not what ROS reads",
     "correct the line: blanks indent, never tabs; each key stands once, and has a value"},
    {"section_missing", kFault, "the parameter file has nothing for this program",
     "name its section as the node: /connect_server, /connect_client, or /** for every node"},
    {"token_missing", kFault, "there is no usable token",
     "make one (`ctl token`) and name its file in `auth.token_file`; the file is plain text "
     "(ASCII), not UTF-16 as of PowerShell's >"},
    {"file_distrusted", kFault, "other users of this machine may change or read a file that counts",
     "chmod it, or keep it elsewhere"},
    {"file_readable", kHint, "other users of this machine may read a secret", "chmod 600 the file"},
    {"port_taken", kFault, "another program listens at this address and port",
     "end it (ss -ltnp shows it), or choose another `listen.port`"},
    {"port_not_permitted", kFault, "this user may not listen at a port below 1024",
     "a larger `listen.port`, a socket of systemd (docs/service.md), or CAP_NET_BIND_SERVICE. For "
     "a server of another user, ask as that user"},
    {"port_hidden", kHint, "only another user sees whether the server can listen at its port",
     "ask as the user of the server, or as root: who listens there may be this server"},
    {"address_not_here", kFault, "this machine has no such address",
     "correct `listen.address` (ip addr shows them); \"*\" takes all"},
    {"prefix_wrong", kFault, "the prefix or a remapped name is no name",
     "write it as /robot1, with letters, digits and _"},
    {"url_wrong", kFault, "the URL is none", "write it as wss://robot.example:9090"},
    {"key_unknown", kFault, "a parameter does not exist", "correct its name (docs/config.md)"},
    {"rule_wrong", kFault, "a rule is wrong", "correct it (docs/config.md, \"Rules\")"},
    {"file_wrong", kFault, "a parameter is wrong", "correct it (docs/config.md)"},
    {"rule_allows_nothing", kHint, "there is no rule that lets anything cross",
     "write a rule with what is to cross (docs/config.md, \"Rules\")"},
    {"max_age_and_latched", kHint,
     "a rule with `max_age` has a latched topic: late subscribers get nothing",
     "no `max_age` on rules with /tf_static, /map or /robot_description"},

    // ---- a running side
    {"nobody_runs", kFault, "no server or client of this user runs here",
     "start it. If it ends at once, its last line says why, and `ctl doctor FILE` with its "
     "parameter file names the cure (a node with a name of its own needs a section of that name "
     "there, or /**). If it runs as another user, or with another XDG_RUNTIME_DIR, "
     "name its socket as that user: `ctl doctor SOCKET`, `ctl status SOCKET`"},
    {"program_silent", kFault, "a program runs here and does not answer",
     "it is stopped (kill -CONT), or hangs: look at its log, else end it and start it again"},
    {"not_linked", kFault, "the client has no link", "see the other findings, and the log"},
    {"nobody_linked", kHint, "nobody is linked with this server",
     "start a client (two servers do not link); `ctl doctor FILE` there says what is in its way"},
    {"same_name", kHint, "two programs here have one node name in one domain",
     "give one of them another name (--ros-args -r __node:=NAME), or end the one that is too many"},
    {"names_collide", kHint,
     "two programs here bring topics of the same name into one graph: with two robots, what they "
     "say is mixed",
     "give each robot a `prefix`; two ways to one robot need no change"},
    {"identity_twice", kFault,
     "two peers with one identity and one node name are linked: two robots with one token, or one "
     "whose program runs twice",
     "give each robot a token of its own (`ctl token`), or end the program that is too many"},
    {"one_graph", kFault,
     "both ends of the link are in one ROS graph, so the nodes see each other without the bridge "
     "and nothing crosses",
     "give one end another ROS_DOMAIN_ID; or, on one network, both "
     "ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST"},
    {"robot_word", kFault, "both ends take themselves for the robot, or both for the operator",
     "set the same word in `robot` at both ends: server, or client if the robot dials"},
    {"parameters_refused", kFault,
     "a changed parameter file was refused: what was before stays in use",
     "correct it (`ctl check FILE`); it is read again at once"},
    {"file_refused", kFault,
     "a file or a key address of the running program cannot be used as it is now: what was read "
     "before stays in use",
     "correct it: it is read again at once. Until then nobody who is new in it comes in, and "
     "the program does not start again"},
    {"needs_restart", kFault, "it was changed in the parameter file, and is as it was",
     "start this program again: the other keys of the file apply at once"},
    {"loopback_alone", kHint,
     "nobody is linked, and the server listens on the loopback alone: other machines do not reach "
     "it",
     "set `listen.address`, or pair with `server --pair`; a client on this machine, or a proxy or "
     "tunnel here, needs no change. One end must run a client: two servers do not link"},
    {"clients_refused", kHint,
     "nobody is linked, and connections that come are refused before their login",
     "the text that was seen decides. \"does not trust the authority\": give the client this "
     "server's authority (`tls.ca`) or pin, and append intermediate certificates to "
     "`tls.certificate`. \"showed no certificate\": sign one for the client, or take `tls.ca` out "
     "of this server's file. \"HTTP 426\": let the proxy before this server pass on the upgrade "
     "(docs/proxies.md). \"plain HTTP on a TLS port\": `url` at the client begins with wss://. "
     "Any other text may be a stranger: `ctl doctor FILE` at the client says what is in its way"},
    {"proxy_header_unexpected", kHint,
     "nobody is linked, and connections began with a header of the PROXY protocol, which this side "
     "does not expect",
     "if a proxy of yours stands before this server: `listen.proxy_header: proxy_protocol`, and "
     "the proxy's own address in `listen.trusted_proxies`; or let it send none (HAProxy: no "
     "send-proxy). Strangers send such headers, too: they need nothing"},
    {"wrong_logins", kHint, "somebody came with a wrong login",
     "the server's log says who and why. `auth.method` token: make one for who is to come (`ctl "
     "token`); jwt: compare issuer, audience, key and expiry of the JWT with `auth.jwt_issuer`, "
     "`auth.jwt_audience` and `auth.jwt_keys`; certificate: sign one with the authority in "
     "`tls.ca`. Both ends need one `auth.method`"},
    {"token_expired", kHint,
     "somebody comes with a wrong login, and this identity's token has expired",
     "check the clock of this machine (date). If it is right, make another token (`ctl token`), "
     "and give it to the client"},
    {"no_rule", kHint, "no rule of this side allows a name that a node here uses",
     "add the name to a rule of this side, below the key of its direction and kind: export_topics, "
     "import_topics, export_services, export_actions ..."},
    {"other_peer", kHint, "a rule of this side allows it, and not to this peer",
     "add the peer's identity or group to the rule; or let the peer log in as one that it names"},
    {"denied", kHint, "a rule of this side denies it", "change `deny` of this rule"},
    {"rule_type", kFault, "the rule of this side is for another type",
     "use the type of the rule (Twist is not TwistStamped), or change `types`"},
    {"not_taken", kFault, "the rules of the peer do not let it in, for this login or this type",
     "change the rules at the other side, or its `remap`; or publish by the name that the peer "
     "listens to"},
    {"not_given", kFault, "the rules of the peer do not let it out, for this login or this type",
     "change the rules at the other side: topics, services and actions have keys of their own, and "
     "`parameters` names the nodes whose parameters cross. Or is the name here in the wrong "
     "namespace?"},
    {"other_type", kFault, "it has another type at the other side",
     "use the same type at both sides"},
    {"outside_prefix", kHint,
     "a topic that the peer listens to is not below the `prefix` of this side",
     "if it is meant for this peer, publish it below `prefix`; without `prefix` each name of this "
     "graph is meant for the peer"},
    {"not_there", kHint, "nobody publishes or serves it at the other side",
     "start that node; does it use the same name, namespace, domain, discovery range and prefix? "
     "Nodes of another computer need ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET, and multicast or "
     "ROS_STATIC_PEERS"},
    {"type_not_installed", kFault, "the type is not installed where it has to be",
     "install the package there, or source its workspace before the bridge starts"},
    {"definitions_differ", kFault,
     "the type or its definition is another one at the other side, or at another node here",
     "use the same type, and the same version of its package, at both sides; for another "
     "definition `allow_type_mismatch` helps. Where two nodes of one side publish the name with "
     "two types, rename one"},
    {"declined", kFault, "the importing side cannot take it", "its reason says why"},
    {"qos", kFault, "a subscriber requests a quality of service that no publisher offers",
     "change the QoS of the subscriber or the publisher. Where the publisher does offer it, `qos` "
     "of a rule at one of the two sides has taken it away"},
    {"lost_in_middleware", kFault,
     "messages are lost in the middleware before the bridge gets them: the publisher's shared "
     "memory is too small for them",
     "give the publishing node config/fastdds_large_data.xml (docs/troubles.md, \"Large images\"), "
     "and /dev/shm room for it (in Docker --shm-size=1g)"},
    {"lost_in_bursts", kFault,
     "messages are lost in the middleware before the bridge takes them: more come at once than "
     "`qos.depth` holds, or the bridge is held up",
     "set a larger `qos.depth` in the rule, such as 1000; where the bridge is held up, find out "
     "first what else uses the processor"},
    {"nothing_arrives", kHint,
     "it has a publisher and is demanded, and no message has reached the bridge yet",
     "does it publish (ros2 topic hz)? A lifecycle node does only while it is active (ros2 "
     "lifecycle get), one with `use_sim_time` only while /clock runs. If it does, its shared "
     "memory does not reach the bridge: run both as one user, in containers with --ipc=host; or "
     "with FASTDDS_BUILTIN_TRANSPORTS=UDPv4. From another computer large messages need their UDP "
     "fragments: look at its firewall and mtu"},
    {"publisher_stops", kHint,
     "a sensor is subscribed to, has come steadily and has stopped; its publisher is still in "
     "the graph",
     "look at the node and its device: log, cable, driver (ros2 topic hz). A lifecycle node "
     "publishes only while it is active (ros2 lifecycle get), one with `use_sim_time` only "
     "while /clock runs"},
    {"no_listener", kHint, "nobody subscribes at the other side, so nothing is sent",
     "subscribe there"},
    {"published_here_too", kHint,
     "it comes from the other side, and a node here publishes it, too: subscribers get both",
     "stop one of the two, or give this side a `prefix`; for commands a multiplexer decides "
     "(docs/recipes.md)"},
    {"two_of_one_driver", kHint,
     "two nodes of one operator publish these commands: one of them drives, and the other's are "
     "dropped",
     "end one of the two, or put a multiplexer before the bridge (twist_mux, docs/recipes.md)"},
    {"halts_nothing", kFault,
     "`halt_after` has no effect on this type: when its sender falls silent, nothing stops the "
     "robot",
     "cross the speed itself (Twist, TwistStamped, AckermannDrive or its stamped form), so that "
     "`halt_after` publishes a zero (docs/driving.md)"},
    {"rule_hidden", kHint,
     "a rule before it allows all of its names, so it decides nothing and its other keys have no "
     "effect",
     "put it before that rule in `rules`: the first rule that allows a name decides"},
    {"several_servers", kHint,
     "several nodes here serve it: each call reaches all of them, and the first answer counts",
     "end all but one of them"},
    {"server_ends", kHint, "calls are lost at its server, and none is answered",
     "look at the log of the node that serves it: does it crash in these calls, or is it killed?"},
    {"path_too_long", kFault,
     "the path takes longer than a rule's `max_age`, so what crosses is too old when it arrives",
     "raise `max_age` above that time, or use a faster path"},
    {"path_slow", kHint, "the path answers late: something fills it, or it is very long",
     "look for an upload or download beside the bridge; limit it, or give the bridge its own share "
     "at the router"},
    {"urgent_is_heavy", kFault,
     "more is published than the link carries, and an urgent topic takes most: all others wait "
     "behind it",
     "`priority: bulk` for it; urgent is for small messages such as commands"},
    {"served_here_too", kHint,
     "a node here serves it, too: calls of nodes here do not reach the server at the other side",
     "end the server here, or give this side a `prefix`"},
    {"path_silent", kFault,
     "nothing comes from the other end, and what was sent is not acknowledged: the path may be "
     "dead",
     "look at the network; a smaller `dead_after` (by default 3 s) ends such a connection sooner"},
    {"drops_rate", kHint, "a rule's `max_rate` or `max_bytes_per_second` drops messages",
     "raise it, if all of them are to arrive"},
    {"drops_max_age", kFault, "messages are older than a rule's `max_age`",
     "raise it; send less, if the link is full"},
    {"stamps_old", kFault,
     "every message is older than a rule's `max_age`, and the clocks of the machines agree: it is "
     "a latched one, or its stamps are of another time",
     "a latched topic (a map) needs a rule without `max_age`. Else look at the clock of the "
     "publisher: another machine, `use_sim_time`, a recording"},
    {"clocks_apart", kHint,
     "the clocks of the machines differ: nodes that compare stamps (tf2) fail on it",
     "synchronize both clocks (chrony)"},
    {"clocks_differ", kFault,
     "the clocks of the machines differ, and the age of messages is counted by them",
     "synchronize both clocks (chrony), or take `max_age` away"},
    {"publisher_ahead", kFault,
     "the clock of a driver's machine is ahead of that of its bridge, so ages are guessed",
     "synchronize both clocks (chrony)"},
    {"drops_too_large", kFault, "messages are larger than a side takes",
     "raise `max_message_size` at both sides"},
    {"link_too_thin", kFault, "more is published than the link carries",
     "`max_rate` or `keep: newest` in the rule, a smaller picture, or `compression`"},
    {"own_limit", kFault, "more is published than a limit of this side lets out",
     "raise it, if the path may carry more; else `max_rate`, a smaller picture or `compression`"},
    {"path_loses", kFault, "the path loses packets, and much is sent again",
     "look at the radio, cable or tunnel; `congestion_control: bbr` carries more on such a path"},
    {"drops_memory", kFault, "a peer's share of `memory_max` is used up",
     "raise `memory_max`, or send less"},
    {"memory_full", kFault, "`memory_max` is nearly used up", "raise it, or send less"},
    {"path_full", kFault, "data waits on the path: all of it is late",
     "send less; look for what else fills this path (docs/proxies.md)"},
    {"loop_slow", kFault, "the bridge was held up, and all its links waited",
     "look for what else uses the processor; large messages cost it, too. On a laptop: was it "
     "suspended?"},
    {"processor_limited", kFault,
     "the group of the program was throttled in at least half of its periods since it began: it "
     "uses up the processor time that it may have, and stands still then",
     "raise its limit (CPUQuota of systemd, --cpus of Docker, cpu.max of the cgroup); what is "
     "lost or late may only follow from it"},
    {"program_replaced", kHint, "the program was replaced on the disk, and the former one runs on",
     "start this program again"},
    {"calls_wait", kHint, "calls have had no answer for 10 s and more",
     "look at the node that serves it: does it hang, or is it stopped? A server may need its time; "
     "`call_timeout` in the rule limits the wait"},
    {"calls_refused", kFault, "calls are refused, or fail at the other side",
     "the logs of both sides say why: a limit (`calls_max`, `max_message_size`), or a record that "
     "`audit.required` wants"},
    {"service_silent", kFault, "a server does not answer calls",
     "look at the node that serves it; `call_timeout` in the rule is the time that it has"},
    {"another_drives", kHint,
     "another peer drives the robot by this topic, and commands are dropped",
     "let that driver stop, or take the wheel: service ~/drive of the operator's side "
     "(docs/driving.md)"},
    {"let_go_first", kHint, "the robot was halted, and its driver has not let go since",
     "centre the stick or release the key; where that comes back, commands come more seldom than "
     "`halt_after`, or the path stalls: raise it"},
    {"connections_forgotten", kFault,
     "each connection falls silent at the same age: something on the path forgets it (NAT, "
     "firewall, VPN)",
     "let it keep TCP connections longer, or use another path; the bridge is never idle"},
    {"connections_ended", kFault,
     "the other end, or something on the path, ends the connection again and again",
     "is the program there killed, or started again and again (its log, systemctl status)? Else "
     "look at proxies and firewalls between both ends: an idle timeout there (nginx: "
     "proxy_read_timeout) has to be longer than a third of `dead_after`. Connections of one age "
     "end by a limit of their lifetime (a balancer's): raise it"},
    {"program_restarts", kFault,
     "links of one program (identity, node name and address) are lost without a word, and new "
     "ones follow, again and again",
     "look there at its log and at what starts it (systemctl status, journalctl -k): does it "
     "crash, is it killed, does the memory not suffice? Several people with one token need "
     "tokens of their own. What was kept for lost links goes after `resume.seconds`"},
    {"link_breaks", kFault, "the link breaks again and again",
     "look at the network between both ends; a larger `dead_after` bridges silences. Ask `ctl "
     "doctor` at the other end, too"},
    {"large_packets_vanish", kFault,
     "connections open at once, and fall silent again and again: large packets vanish on the path "
     "(MTU)",
     "try a smaller mtu (ip link set dev DEVICE mtu 1280) or sysctl -w net.ipv4.tcp_mtu_probing=1; "
     "let ICMP pass through the firewalls"},
    {"audit_fails", kFault, "the audit log cannot be written", "free its disk, or change its file"},
    {"nothing_here", kHint,
     "this side exports nothing: no node here publishes or serves what a rule names",
     "is the bridge in the domain (ROS_DOMAIN_ID), discovery range and RMW of the nodes? Do rules "
     "name it under the right key (export_topics, export_services, export_actions)?"},

    // ---- this machine
    {"domain_differs", kHint, "the bridge is in another ROS_DOMAIN_ID than this shell",
     "to see the bridge's graph from here, set the same one in this shell"},
    {"domain_wrong", kFault,
     "the ROS_DOMAIN_ID of this shell is none: no program of ROS starts here",
     "set a number from 0 to 232 (export ROS_DOMAIN_ID=0)"},
    {"rmw_differs", kFault, "the bridge has another RMW_IMPLEMENTATION than this shell",
     "start both with the same one"},
    {"rmw_missing", kFault,
     "the RMW that RMW_IMPLEMENTATION names is not installed: no program of ROS starts",
     "install its package (ros-$ROS_DISTRO-rmw-cyclonedds-cpp for rmw_cyclonedds_cpp) and source "
     "ROS again; or unset RMW_IMPLEMENTATION"},
    {"discovery_range", kFault, "the discovery range keeps nodes and bridge apart",
     "the same ROS_AUTOMATIC_DISCOVERY_RANGE (and ROS_LOCALHOST_ONLY) for both, and not OFF"},
    {"middleware_differs", kHint,
     "a variable of the middleware differs between the bridge and this shell: they may not find "
     "the same nodes",
     "start the bridge with the variables of the nodes (discovery server, profiles, static peers), "
     "or without"},
    {"user_differs", kHint, "the bridge runs as another user than this shell",
     "run it as the user of the nodes: Fast DDS's shared memory delivers nothing between users"},
    {"shared_memory_small", kHint, "there is little shared memory: large messages may vanish",
     "free /dev/shm; in Docker --shm-size=1g"},
    {"no_bbr", kHint, "this host does not allow bbr: on paths that lose packets little arrives",
     "sysctl -w net.ipv4.tcp_allowed_congestion_control=\"reno cubic bbr\""},
};

}  // namespace

std::span<const Finding> all_findings() {
  return kFindings;
}

const Finding* finding_of(std::string_view id) {
  const auto found = std::find_if(std::begin(kFindings), std::end(kFindings),
                                  [&](const Finding& finding) { return finding.id == id; });
  return found == std::end(kFindings) ? nullptr : &*found;
}

namespace {

bool is_hint(const Found& one) {
  const Finding* finding = finding_of(one.id);
  return one.is_hint || (finding && finding->is_hint);
}

}  // namespace

std::vector<Found> gathered(const std::vector<Found>& found) {
  constexpr std::size_t kNamesMax = 4;
  struct Group {
    Found first;
    std::size_t subjects = 1;
  };
  std::vector<Group> groups;
  for (const Found& one : found) {
    const bool hint = is_hint(one);
    const auto group = std::find_if(groups.begin(), groups.end(), [&](const Group& known) {
      return known.first.id == one.id && known.first.program == one.program &&
             is_hint(known.first) == hint && !known.first.subject.empty() && !one.subject.empty() &&
             (hint || known.first.detail == one.detail);
    });
    if (group == groups.end()) {
      groups.push_back({one});
      continue;
    }
    if (group->subjects++ < kNamesMax) group->first.subject += ", " + one.subject;
    if (group->first.detail != one.detail) group->first.detail.clear();
    group->first.waits = group->first.waits || one.waits;
  }
  std::vector<Found> all;
  for (Group& group : groups) {
    if (group.subjects > kNamesMax)
      group.first.subject += fmt::format(" and {} more", group.subjects - kNamesMax);
    all.push_back(std::move(group.first));
  }
  return all;
}

std::vector<Found> sorted(std::vector<Found> found) {
  const auto rank = [](const Found& one) { return (is_hint(one) ? 2 : 0) + (one.waits ? 0 : 1); };
  std::stable_sort(found.begin(), found.end(),
                   [&](const Found& a, const Found& b) { return rank(a) < rank(b); });
  return found;
}

std::string report_text(const std::vector<Found>& found) {
  if (found.empty())
    return "nothing is wrong, as far as can be seen from here; the other end may see more\n";
  std::string text;
  for (const Found& one : sorted(found)) {
    const Finding* finding = finding_of(one.id);
    if (!finding) continue;
    text += fmt::format("{}{}{}{}\n", is_hint(one) ? "hint: " : "",
                        one.program.empty() ? "" : one.program + ": ",
                        one.subject.empty() ? "" : one.subject + ": ", finding->cause);
    if (!one.detail.empty()) text += "  seen: " + one.detail + "\n";
    text += fmt::format("  do:   {}   [{}]\n", finding->cure, finding->id);
  }
  return text;
}

std::string report_json(const std::vector<Found>& found) {
  OrderedJson findings = OrderedJson::array();
  for (const Found& one : sorted(found)) {
    const Finding* finding = finding_of(one.id);
    if (!finding) continue;
    findings.push_back({{"id", finding->id},
                        {"hint", is_hint(one)},
                        {"program", one.program},
                        {"subject", one.subject},
                        {"detail", one.detail},
                        {"waits", one.waits},
                        {"cause", finding->cause},
                        {"cure", finding->cure}});
  }
  const OrderedJson report = {{"findings", findings}};
  return report.dump(1, ' ', false, OrderedJson::error_handler_t::replace) + "\n";
}

bool has_fault(const std::vector<Found>& found) {
  return std::any_of(found.begin(), found.end(),
                     [](const Found& one) { return finding_of(one.id) && !is_hint(one); });
}

}  // namespace connect_bridge
