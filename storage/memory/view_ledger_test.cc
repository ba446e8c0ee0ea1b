#include "storage/memory/view_ledger.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <set>
#include <vector>

namespace relmap::storage {
namespace {

struct Part {
  std::uint64_t created, retired;
  std::size_t bytes;
};

// What views not older than `from` hold, part by part.
std::size_t held(const std::vector<Part>& parts, const std::set<std::uint64_t>& views, std::uint64_t from) {
  std::size_t bytes = 0;
  for (const Part& part : parts) {
    const auto view = views.lower_bound(std::max(part.created, from));
    if (view != views.end() && *view < part.retired) bytes += part.bytes;
  }
  return bytes;
}

TEST(ViewLedger, ChargesWhatOldViewsHoldAndCutsOffAsFewAsItMust) {
  for (std::uint32_t seed = 1; seed <= 50; ++seed) {
    std::mt19937 random(seed);
    const auto below = [&](std::uint64_t n) { return random() % n; };
    const auto budget = std::make_shared<Budget>(8'000);
    const std::size_t allowance = budget->allowance(Share::kViews);
    ViewLedger ledger(budget);
    std::set<std::uint64_t> views;
    std::vector<Part> parts;
    std::uint64_t version = 0, cut_off_below = 0;
    for (int step = 0; step < 400; ++step) {
      for (std::uint64_t part = below(4); part > 0 && version > 0; --part) {
        // Most parts are replaced in the next version; one that a failed commit held was replaced earlier.
        const std::uint64_t retired = below(8) == 0 ? 1 + below(version + 1) : version + 1;
        parts.push_back({below(retired), retired, 1 + below(200)});
        ledger.retire(parts.back().created, parts.back().retired, parts.back().bytes);
        std::uint64_t oldest = cut_off_below;
        for (auto view = views.lower_bound(oldest); held(parts, views, 0) > allowance && view != views.end(); ++view) {
          if (held(parts, views, oldest) <= allowance) break;
          oldest = *view + 1;
        }
        cut_off_below = oldest;
      }
      ledger.add(++version);
      views.insert(version);
      while (views.size() > 1 && below(3) == 0) {
        // Most views end at once, and some are kept.
        const auto ended = below(4) == 0 ? std::next(views.begin(), below(views.size())) : std::prev(views.end(), 2);
        ledger.remove(*ended);
        views.erase(ended);
      }
      ASSERT_EQ(budget->used(Share::kViews), held(parts, views, 0)) << "seed " << seed << ", step " << step;
      for (const std::uint64_t view : views)
        ASSERT_EQ(ledger.expired(view), view < cut_off_below) << "seed " << seed << ", step " << step;
    }
    EXPECT_GT(cut_off_below, 0u);
    for (const std::uint64_t view : views) ledger.remove(view);
    EXPECT_EQ(budget->used(Share::kViews), 0u);
  }
}

}  // namespace
}  // namespace relmap::storage
