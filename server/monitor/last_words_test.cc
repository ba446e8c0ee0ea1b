#include "server/monitor/last_words.h"

#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <new>
#include <stdexcept>
#include <thread>

namespace relmap::monitor {
namespace {

using ::testing::ExitedWithCode;
using ::testing::KilledBySignal;

class LastWordsDeathTest : public ::testing::Test {
 protected:
  LastWordsDeathTest() {
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    name_reason_of_sudden_end();
  }
  // What operator new does where it finds no memory.
  static void run_out_of_memory() { std::get_new_handler()(); }
  static void run_out_of_memory_and_go_on() {
    try {
      run_out_of_memory();
    } catch (const std::bad_alloc&) {
    }
  }
  template <typename Thrower>
  [[noreturn]] static void in_a_thread(Thrower thrower) {
    std::thread(thrower).join();
    std::abort();
  }
  // A library may leave a thread that nobody joins where an exception passes.
  template <typename Thrower>
  static void past_a_thread(Thrower thrower) {
    const std::thread unjoined([] { std::this_thread::sleep_for(std::chrono::hours(1)); });
    thrower();
  }
};

TEST_F(LastWordsDeathTest, NameMemoryThatRanOut) {
  constexpr const char* kWords = "critical. BUDGET_EXCEEDED: out of memory; nothing acknowledged is lost";
  EXPECT_EXIT(in_a_thread(run_out_of_memory), ExitedWithCode(1), kWords);
  EXPECT_EXIT(past_a_thread(run_out_of_memory), ExitedWithCode(1), kWords);
}

TEST_F(LastWordsDeathTest, NameWhatElseNobodyHandles) {
  EXPECT_EXIT(in_a_thread([] { throw std::runtime_error("odd"); }), KilledBySignal(SIGABRT), "critical. INTERNAL: odd");
  EXPECT_EXIT(in_a_thread([] { throw 1; }), KilledBySignal(SIGABRT), "critical. INTERNAL: an unknown exception");
  EXPECT_EXIT(past_a_thread([] { throw std::runtime_error("odd"); }), KilledBySignal(SIGABRT),
              "critical. INTERNAL: terminated");
}

TEST_F(LastWordsDeathTest, HaveTheFormOfTheLog) {
  const auto end_as = [](LastWords words) {
    say_last_words_as(words);
    in_a_thread([] { throw std::runtime_error("odd \"one\"\nand more"); });
  };
  EXPECT_EXIT(end_as(LastWords::kText), KilledBySignal(SIGABRT),
              "^\\[relmapd\\] \\[critical\\] INTERNAL: odd 'one''and more\n$");
  EXPECT_EXIT(end_as(LastWords::kJournal), KilledBySignal(SIGABRT), "^<2>INTERNAL: odd 'one''and more\n$");
  EXPECT_EXIT(end_as(LastWords::kJson), KilledBySignal(SIGABRT),
              "^.\"level\":\"critical\",\"message\":\"INTERNAL: odd 'one''and more\".\n$");
}

TEST_F(LastWordsDeathTest, BlameNoMemoryThatRanOutBefore) {
  EXPECT_EXIT(
      {
        run_out_of_memory_and_go_on();
        std::terminate();
      },
      KilledBySignal(SIGABRT), "critical. INTERNAL: terminated");
  EXPECT_EXIT(in_a_thread([] {
                run_out_of_memory_and_go_on();
                throw std::runtime_error("odd");
              }),
              KilledBySignal(SIGABRT), "critical. INTERNAL: odd");
}

}  // namespace
}  // namespace relmap::monitor
