// What the daemon says if it has to end at once.
#pragma once

namespace relmap::ops {

// From now on an exception that nobody handles ends the process with a line that names its reason, and no thread is
// waited for: with exit code 1 if memory ran out (BUDGET_EXCEEDED), by abort() otherwise (INTERNAL). Nothing
// acknowledged is lost, since it is in the journal.
void name_reason_of_sudden_end();

}  // namespace relmap::ops
