#include "server/rpc/edit_log.h"

#include <gtest/gtest.h>

#include <future>
#include <vector>

namespace relmap::rpc {
namespace {

Result<std::uint64_t> number(std::uint64_t sequence) { return sequence; }

TEST(EditLog, AnotherEditWaitsForTheOneThatRunsOrGivesUp) {
  EditLog edits;
  std::promise<void> begun, end;
  auto first = std::async(std::launch::async, [&] {
    return edits.once("first", "content", {}, [&](const storage::EditKey&) {
      begun.set_value();
      end.get_future().wait();
      return number(1);
    });
  });
  begun.get_future().wait();
  Deadline now;
  now.at = std::chrono::steady_clock::now();
  EXPECT_EQ(edits.once("second", "content", now, [](const storage::EditKey&) { return number(2); }).reason(),
            Reason::DEADLINE);

  // Those that find the edit done do not run one, and must not keep the others waiting.
  std::vector<std::future<Result<std::uint64_t>>> others;
  for (int i = 0; i < 8; ++i)
    others.push_back(std::async(std::launch::async, [&edits, i] {
      return edits.once(i % 2 == 0 ? "first" : "", "content", {},
                        [i](const storage::EditKey&) { return number(10 + static_cast<std::uint64_t>(i)); });
    }));
  end.set_value();
  EXPECT_EQ(first.get().or_throw(), 1u);
  for (std::size_t i = 0; i < others.size(); ++i) EXPECT_EQ(others[i].get().or_throw(), i % 2 == 0 ? 1 : 10 + i);
  EXPECT_EQ(edits.once("second", "content", now, [](const storage::EditKey&) { return number(2); }).or_throw(), 2u)
      << "nothing runs any more";
}

TEST(EditLog, AnEditThatThrowsOrIsRefusedMayBeDoneAgain) {
  EditLog edits;
  EXPECT_THROW((void)edits.once("key", "content", {},
                                [](const storage::EditKey&) -> Result<std::uint64_t> {
                                  throw StatusError(Status(Reason::IO_ERROR, "disk"));
                                }),
               StatusError);
  const auto refused = edits.once("key", "content", {}, [](const storage::EditKey&) -> Result<std::uint64_t> {
    return {Reason::WRONG_STATE, "not now"};
  });
  EXPECT_EQ(refused.reason(), Reason::WRONG_STATE);
  EXPECT_EQ(edits.once("key", "content", {}, [](const storage::EditKey&) { return number(3); }).or_throw(), 3u);
  EXPECT_EQ(edits.once("key", "content", {}, [](const storage::EditKey&) { return number(4); }).or_throw(), 3u)
      << "it was done";
  EXPECT_EQ(edits.once("key", "other", {}, [](const storage::EditKey&) { return number(4); }).reason(),
            Reason::INVALID_ARGUMENT);
}

TEST(EditLog, KnowsTheEditsThatTheMapRemembers) {
  storage::EditKey done;
  EditLog before;
  EXPECT_EQ(before.once("key", "content", {}, [&](const storage::EditKey& named) { return done = named, number(7); })
                .or_throw(),
            7u);
  EXPECT_EQ(done.key, "key");

  EditLog edits({{7, done}});
  EXPECT_EQ(edits.once("key", "content", {}, [](const storage::EditKey&) { return number(8); }).or_throw(), 7u);
  EXPECT_EQ(edits.once("key", "other", {}, [](const storage::EditKey&) { return number(8); }).reason(),
            Reason::INVALID_ARGUMENT);
}

}  // namespace
}  // namespace relmap::rpc
