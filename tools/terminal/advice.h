// Where an operator reads what to do about a reason: the line that leads to `relmap-admin explain`.
#pragma once

#include <string>
#include <vector>

#include "proto/base/reason.h"

namespace relmap::terminal {

// Whether somebody who looks after a daemon has something to do about it: its disk, its credentials, its machine, a
// robot's camera or spool. Not so an answer to a question, nor what is wrong with what was typed.
bool is_operational(Reason reason);

// "relmap-admin explain DISK_FULL READ_ONLY tells what to do", of those that are operational, each once; empty if none
// is.
std::string advice_on(const std::vector<Reason>& reasons);

// The operational reasons that `text` names, in its order.
std::vector<Reason> operational_in(const std::string& text);

}  // namespace relmap::terminal
