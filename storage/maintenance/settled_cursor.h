// What a session settled without a frame, in order, past what is damaged: read a page at a time, so that a walk beside
// it holds little.
#pragma once

#include <deque>
#include <functional>
#include <string>

#include "storage/engine/engine.h"
#include "storage/graph/frame.h"

namespace relmap::storage {

class SettledCursor {
 public:
  // `damaged` is told the key of a record that cannot be read (empty: the rest of them) and what is wrong.
  using Damaged = std::function<void(const std::string& key, const std::string& what)>;
  SettledCursor(const EngineSnapshot& snapshot, SessionNumber session, Damaged damaged);

  // Null at the end.
  const Settled* get() const { return page_.empty() ? nullptr : &page_.front(); }
  void next();

 private:
  void read();

  const EngineSnapshot& snapshot_;
  const SessionNumber session_;
  const Damaged damaged_;
  std::string from_;  // the key that the next page begins with; empty: there is none
  std::deque<Settled> page_;
};

}  // namespace relmap::storage
