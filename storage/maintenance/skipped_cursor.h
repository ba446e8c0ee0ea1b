// Reads the skipped sequences of a session, in order and past what is damaged. It reads a page at a time, so that a
// walk over the frames beside it holds little memory.
#pragma once

#include <deque>
#include <functional>
#include <string>

#include "storage/engine/engine.h"
#include "storage/graph/frame.h"

namespace relmap::storage {

class SkippedCursor {
 public:
  // `damaged` is called with the key of a record that cannot be read, and with what is wrong. An empty key stands for
  // all the records that follow.
  using Damaged = std::function<void(const std::string& key, const std::string& what)>;
  SkippedCursor(const EngineSnapshot& snapshot, SessionNumber session, Damaged damaged);

  // Null at the end.
  const Skipped* get() const { return page_.empty() ? nullptr : &page_.front(); }
  void next();

 private:
  void read();

  const EngineSnapshot& snapshot_;
  const SessionNumber session_;
  const Damaged damaged_;
  std::string from_;  // the key that the next page begins with; empty: there is none
  std::deque<Skipped> page_;
};

}  // namespace relmap::storage
