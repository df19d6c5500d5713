"""Faults in what a peer with a login may cost: lines of the log, memory, time to compare names."""

from mutant import Mutant

COSTS = [
    Mutant("renewals fill the log",
           "if (const auto end = link.account->lines.take(now))"
           " outputs.log(level, std::move(text) + *end);",
           "outputs.log(level, std::move(text)); (void)link; (void)now;", within="log_renewal"),
    Mutant("messages that are too large fill the log",
           'link_.account->told.first(name + " has messages that are too large")',
           "dropped_.of(DropReason::kTooLarge) == 0"),
    Mutant("calls that are refused here fill the log",
           "log_calls(serving_.outputs, link_.account->calls_served.refusals,",
           "LogLimit fresh; log_calls(serving_.outputs, fresh,",
           within="Attachment::note_refusal"),
    Mutant("calls that a peer refuses fill the log",
           "log_calls(mirroring_.outputs, link_.account->calls_made.refusals,",
           "LogLimit fresh; log_calls(mirroring_.outputs, fresh,", within="Feed::on_refuse"),
    Mutant("a long pattern ends at its 64th character",
           "std::exchange(carry, places >> (kBits - 1))",
           "0 * std::exchange(carry, places >> (kBits - 1))"),
    Mutant("a peer may tell any number of wildcards",
           "io.check(size.wildcards <= kWildcardsMax, ...);", ""),
    Mutant("a type opens the names of all rules", "[&](std::size_t rule) { return rules[rule]; }",
           "[](std::size_t) { return true; }"),
    Mutant("call numbers are used up without a pace",
           "!link_.account->attaches.take(now.steady)", "false", within="Attachment::on_message"),
    Mutant("what nobody takes is kept",
           "to->channel && to->channel->wants(message->demand);",
           "!to->channel || to->channel->wants(message->demand);"),
    Mutant("a service has types without end", "return others >= kTypesOfServiceMax;",
           "return others >= 1000;"),
    Mutant("a publisher takes another's place in the queue",
           "queue.depth = of_all(origins.size(), depth);", "queue.depth = depth;"),
    Mutant("compressed bodies larger than any",
           "frame.body_bytes > compressed_bytes_max(frame.raw_bytes)", "false"),
]
