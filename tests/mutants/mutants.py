"""One-line faults, each of which a test must notice: (name, file, exact old text, new text)."""
from typing import NamedTuple


class Mutant(NamedTuple):
    name: str
    file: str
    old: str
    new: str


MUTANTS = [
    # ---- rights
    Mutant("export right skipped", "src/core/side/exports_offers.cpp",
           "  if (!decision || !accepted_by(*link.accepts, what)) return std::nullopt;\n",
           "  if (!decision) decision.emplace();\n"),
    Mutant("import right skipped", "src/core/side/imports.cpp",
           '  if (!decision)\n    return decline(link, offer.channel, "not_permitted", '
           '"no rule allows importing " + offer.name);\n',
           "  if (!decision) decision.emplace();\n"),
    Mutant("deny ignored", "src/core/policy/policy.cpp",
           "    if (denied(what, opening, covered)) return std::nullopt;\n",
           "    (void)covered;\n"),
    Mutant("hidden names match wildcards", "src/core/policy/pattern.cpp",
           "  if (hidden == Hidden::kSpelledOut && is_hidden(token) && !is_hidden(pattern)) "
           "return false;\n",
           "  (void)hidden;\n"),
    Mutant("changed rules do not withdraw", "src/core/side/exports_offers.cpp",
           "    if (it->second.channel) withdraw(topic, link);\n    topic.links.erase(it);\n",
           "    if (decision) continue;\n    return;\n"),
    Mutant("expiry ignored", "src/core/side/side_links.cpp",
           "expires != 0 && now.system >= expires)\n", "false)\n"),
    # ---- flow
    Mutant("acknowledgements dropped", "src/core/flow/outbox.cpp",
           "    ack_ = frame;\n    return;\n", "    return;\n"),
    Mutant("data budget without end", "src/core/flow/outbox.cpp",
           "  if (data_bytes_ > options_.data_bytes_max) "
           "keep_data_budget(at->second.priority());\n",
           ""),
    Mutant("window ignored", "src/core/flow/outbox.cpp",
           "  return unacknowledged_bytes() + packet_bytes <= ",
           "  return reserve < UINT64_MAX || packet_bytes <= "),
    Mutant("acknowledgement of what was not sent", "src/core/flow/outbox.cpp",
           "  if (received_bytes > sent_bytes_) return false;\n",
           "  if (received_bytes > sent_bytes_) return true;\n"),
    Mutant("urgent last", "src/core/flow/class_schedule.cpp",
           "  if (!classes_[0].turns.empty()) return 0;\n  std::size_t best = kPriorities;\n",
           "  std::size_t best = kPriorities;\n"),
    Mutant("parts do not interleave", "src/core/flow/class_schedule.cpp",
           "  if (turns.size() == 1) return;\n", "  if (!turns.empty()) return;\n"),
    Mutant("lifespan unchecked", "src/core/flow/channel_queue.cpp",
           "  if (is_older(message.stamp, options_.lifespan, now)) "
           "return DropReason::kLifespan;\n",
           ""),
    Mutant("keep-last keeps all", "src/core/flow/channel_queue.cpp",
           "    while (waiting_.size() >= options_.depth) "
           "drop_oldest_waiting(DropReason::kQueueDepth);\n",
           ""),
    Mutant("sequence unchecked", "src/core/flow/reassembly.cpp",
           "  if (!is_after(frame.sequence, stream.last_sequence)) {\n",
           "  if (frame.sequence == 0 && is_after(1, stream.last_sequence)) {\n"),
    Mutant("abort ignored", "src/core/flow/reassembly.cpp",
           "    close(stream);\n    return std::optional<InMessage>{};\n",
           "    return std::optional<InMessage>{};\n"),
    Mutant("unfinished messages without limit", "src/core/flow/reassembly.cpp",
           "  if (open_bytes_ + frame.body_bytes > options_.open_bytes_max) {\n",
           "  if (options_.open_bytes_max == 0) {\n"),
    # ---- link
    Mutant("silence unnoticed", "src/core/link/link.cpp",
           "  if (now.steady >= last_heard_ + options_.dead_after)\n",
           "  if (now.steady < last_heard_)\n"),
    Mutant("clock offset inverted", "src/core/link/clock_estimate.cpp",
           "((reply.t2 - reply.t1) + (reply.t3 - t4)) / 2",
           "((reply.t1 - reply.t2) + (t4 - reply.t3)) / 2"),
    # ---- side
    Mutant("mirrors outlive their link", "src/core/side/imports_mirrors.cpp",
           "now) {\n  remove_candidates(link, false, now);\n}\n",
           "now) {\n  (void)link;\n  (void)now;\n}\n"),
    Mutant("demand without subscribers", "src/core/side/imports.cpp",
           "topic && !topic->subscribers.empty();\n", "topic;\n"),
    Mutant("end of demand ignored", "src/core/side/exports_data.cpp",
           "    exported.demanded = demand.on;\n", "    exported.demanded = true;\n"),
    Mutant("duplicates published", "src/core/side/imports_data.cpp",
           "  if (repeats && message.stamp != 0 && message.stamp <= mirror.last_stamp) {\n",
           "  if (repeats && message.stamp < 0) {\n"),
    Mutant("history not sent", "src/core/side/exports_data.cpp",
           "      send_history(*topic, exported, link, now);\n", ""),
    Mutant("max_age unchecked at the importer", "src/core/side/imports_data.cpp",
           "    if (age > channel.decision.treatment.max_age) "
           "return channel.dropped.add(DropReason::kMaxAge);\n",
           ""),
    Mutant("small overtakes what is decompressed", "src/core/side/imports_data.cpp",
           "  if (channel.decoding.empty() && message.codec == Codec::kNone) {\n",
           "  if (message.codec == Codec::kNone) {\n"),
    Mutant("loops not noticed", "src/core/side/imports_mirrors.cpp",
           "!mirror.is_local && !claims_.taken(gid) &&\n"
           "                      !is_of_this_graph(candidates.front().link);\n",
           "!claims_.taken(gid);\n"),
    Mutant("claims of others ignored", "src/core/side/claims.cpp",
           "    if (claim.side < own_) taken_.insert(",
           "    if (claim.side == own_) taken_.insert("),
    Mutant("every claim holds", "src/core/side/claims.cpp",
           "    if (claim.side < own_) taken_.insert(", "    taken_.insert("),
    Mutant("bridges taken for nodes", "src/core/side/graph_view.cpp",
           "    if (!bridges.empty()) {\n", "    if (bridges.empty()) {\n"),
    Mutant("unknown origins dropped", "src/core/side/exports_data.cpp",
           "  if (topic.parked.empty()) outputs_.push(RefreshGraph{});\n",
           "  if (topic.parked.empty()) return outputs_.push(RefreshGraph{});\n"),
    Mutant("no second dial", "src/core/side/dialer.cpp",
           "  next_ = now + wait;\n", "  if (failures_ == 1) next_ = now + wait;\n"),
]
