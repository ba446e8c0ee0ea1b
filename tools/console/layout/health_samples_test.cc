#include "tools/console/layout/health_samples.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "tests/support/patience.h"
#include "tools/console/layout/testing/fake_map.h"

namespace relmap::console {
namespace {

TEST(HealthSamples, KeepsItsConnectionUntilASampleFailsOrOtherCredentialsHold) {
  testing::FakeMap daemon;
  HealthOptions options;
  std::atomic<bool> anna_has_gone{false};
  options.connect = [&] { return daemon.connect("anna"); };
  options.credentials = [&] { return anna_has_gone ? "" : "anna"; };
  options.every = std::chrono::milliseconds(10);
  options.most = 1000;
  HealthSamples health(options);
  const auto until = std::chrono::steady_clock::now() + relmap::testing::kPatience;
  const auto takes = [&](std::size_t more, bool reachable) {
    const std::int64_t since = health.samples().empty() ? 0 : health.samples().back().time_ms;
    const auto taken = [&] {
      const auto samples = health.samples();
      return static_cast<std::size_t>(std::count_if(samples.begin(), samples.end(), [&](const HealthSample& sample) {
        return sample.time_ms > since && sample.reachable == reachable;
      }));
    };
    while (taken() < more && std::chrono::steady_clock::now() < until)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return taken() >= more;
  };
  ASSERT_TRUE(takes(20, true));
  EXPECT_EQ(daemon.connections(), 1);
  daemon.change([](auto& state) { state.refused["anna"] = Reason::UNAUTHENTICATED; });
  ASSERT_TRUE(takes(3, false));
  const int made = daemon.connections();
  EXPECT_GT(made, 2) << "a revoked token is not used on";
  daemon.change([](auto& state) { state.refused.clear(); });
  ASSERT_TRUE(takes(20, true));
  const int works = daemon.connections();
  ASSERT_TRUE(takes(20, true));
  EXPECT_EQ(daemon.connections(), works);
  anna_has_gone = true;
  ASSERT_TRUE(takes(20, true));
  EXPECT_EQ(daemon.connections(), works + 1) << "what she had shown is not used on";
}

}  // namespace
}  // namespace relmap::console
