"""Faults in how fast data leaves, and in what is learnt of the path."""

from mutant import Mutant

PACING = [
    Mutant("the rate holds nothing back", "return rate_ == 0 ? now : free_at_;", "return now;"),
    Mutant("the window holds nothing back", "path_.in_flight_bytes() >= window() ||", "false &&"),
    Mutant("what waits for a repair flies", "is_repaired() ? std::min(", "false ? std::min("),
    Mutant("what waited for a repair tells a queue", "return waited &&", "return false &&"),
    Mutant("no queue is seen where all waits", "now - unhindered_at_ < rate_window()", "true"),
    Mutant("what follows is not asked to be acknowledged",
           "return !more_waits || now - path_.asked_at() >= ask_period() ||", "return false &&"),
    Mutant("a time frame's arrival tells a queue", "last->end == ack.received_bytes &&", ""),
    Mutant("a longer path is a queue", "path_.forget_base();", "", within="Pacer::judge_queue"),
    Mutant("our own queue makes the window larger", "3 * path_.lateness() / 4, round", "1h, 1h"),
    Mutant("a gap between packets is a pause",
           "return flight_.empty() && limited_end_ == sent_bytes_;", "return flight_.empty();"),
    Mutant("somebody else leaves nothing", "share_.begin(share_round(false), now);", ""),
    Mutant("a slower path is somebody else", "round.delivery >= kArrives * rate_", "true"),
    Mutant("all of the path is our share", "if (best_is_all_) rate_ =", "if (false) rate_ ="),
    Mutant("the share of a new connection does not grow", "bool best_is_all_ = false;",
           "bool best_is_all_ = true;"),
    Mutant("what TCP holds back does not arrive", "} else if (!round.tcp_limits) {", "} else {"),
    Mutant("the share stays", "now - needed_at_ > kStays", "false"),
    Mutant("a queue is the path's delay at once",
           "if (now - full_.since > 2 * full_.queue", "if (now - full_.since < 2 * full_.queue"),
]
