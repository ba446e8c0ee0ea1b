// Lets each count of a sender pass once, although messages may overtake one another (RFC 4303, 3.4.3).
#pragma once

#include <bitset>
#include <cstddef>
#include <cstdint>

namespace relmap::ingest {

class ReplayWindow {
 public:
  static constexpr std::size_t kSize = 1024;  // a count that is further behind the highest one does not pass

  // True if the count has not passed before. 0 never passes.
  bool pass(std::uint64_t count) {
    if (count == 0 || (highest_ >= kSize && count <= highest_ - kSize)) return false;
    if (count > highest_) {
      // Counts between the highest and this one have not passed: their bits were of counts that have left the window.
      if (count - highest_ >= kSize) {
        passed_.reset();
      } else {
        for (std::uint64_t skipped = highest_ + 1; skipped < count; ++skipped) passed_.reset(skipped % kSize);
      }
      highest_ = count;
      passed_.set(count % kSize);
      return true;
    }
    if (passed_.test(count % kSize)) return false;
    passed_.set(count % kSize);
    return true;
  }

 private:
  std::uint64_t highest_ = 0;
  std::bitset<kSize> passed_;
};

}  // namespace relmap::ingest
