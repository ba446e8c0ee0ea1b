// What the daemon says if it has to end at once.
#pragma once

namespace relmap::monitor {

// From now on an exception that nobody handles ends the process with a line that names its reason, and no thread is
// waited for: with exit code 1 if memory ran out (BUDGET_EXCEEDED), by abort() otherwise (INTERNAL). Nothing
// acknowledged is lost, since it is in the journal.
void name_reason_of_sudden_end();

// The form of these words, which is that of the log (log.h).
enum class LastWords { kText, kJson, kJournal };
void say_last_words_as(LastWords words);

}  // namespace relmap::monitor
