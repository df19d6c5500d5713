"""Faults in what follows when a topic changes: its publishers, its type, its rules, its network."""

from mutant import Mutant

CHANGES = [
    Mutant("rules for listeners are seen at their demand",
           "QosOverride weakest = early_.rules_of_awaited();", "QosOverride weakest;"),
    Mutant("a rate holds up what publishers have kept",
           "if (age == Age::kKept || rate_.admit(bytes, now.steady)) return true;",
           "if (rate_.admit(bytes, now.steady)) return true;"),
    Mutant("what a worker has goes with its topic", "hurry(DropReason::kWithdrawn, now);", ""),
    Mutant("what a worker has goes with its origin",
           "hurry(DropReason::kUnknownOrigin, now, id);", ""),
    Mutant("a withdraw makes the loop stand",
           "if (at_once_.owed(now.steady) + bytes > kAtOnceMax) return std::nullopt;", ""),
    Mutant("another definition is not offered", "recheck(offer.link(), now);", "",
           within="ExportedTopic::on_type_hash"),
    Mutant("what was declined once is never offered again",
           "declined_under_ && *declined_under_ != link_.lists_accepted;", "false;",
           within="TopicOffer::is_current"),
    Mutant("what failed once stays with those that asked later",
           "context_.offers_due = context_.offers_due || closed > 0;", ""),
    Mutant("any change of the network needs a sign of life",
           "if (options_.role != Role::kClient || stopped_ || !changed.route) return;",
           "if (options_.role != Role::kClient || stopped_) return;"),
]
