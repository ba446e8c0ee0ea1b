#include "frontend/workflow/track_pairs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "frontend/capture/testing/file_size_limit.h"
#include "frontend/workflow/testing/workflow_fixture.h"

namespace relmap::workflow {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

class TrackPairsTest : public WorkflowTest {
 protected:
  TrackPairsTest() { options_.all_keyframes = true; }

  Status track(bool hold_back = false) {
    return run([&](workflow::Run& run) {
      testing_pairs::FakePairs<> source(script_);
      return track_pairs(run, {.source = source,
                               .name = "a street",
                               .hold_back = hold_back,
                               .read = [this](const capture::StereoFrame& pair) { read_.push_back(pair.index); },
                               .ended = [this] { ended_(); }});
    });
  }
  // The calls of the sink without interrupts, which another thread makes. Successive pushes are one.
  std::vector<std::string> calls() {
    std::vector<std::string> calls = daemon_.calls();
    std::erase(calls, "interrupt");
    calls.erase(std::unique(calls.begin(), calls.end()), calls.end());
    return calls;
  }
  // Time for the delivery's thread to notice that the run is to stop.
  void wait_for_looks() const { std::this_thread::sleep_for(10 * waits_.look); }
  void make_blank() {
    for (std::size_t i = 0; i < script_.pairs.size(); ++i)
      for (vision::Image* eye : {&script_.pairs[i]->left, &script_.pairs[i]->right})
        for (int y = 0; y < eye->height(); ++y)
          std::fill_n(eye->row(y), eye->width(), static_cast<std::uint8_t>(60 + 5 * i));
  }
  std::vector<std::uint32_t> sequences() const {
    std::vector<std::uint32_t> sequences;
    for (const Keyframe& keyframe : daemon_.pushed) sequences.push_back(keyframe.sequence);
    return sequences;
  }

  std::vector<std::uint64_t> read_;  // indices of the pairs that were read
  std::function<void()> ended_ = [] {};
};

TEST_F(TrackPairsTest, IntroducesASourceUnlessQuiet) {
  for (const bool quiet : {false, true}) {
    options_.quiet = quiet;
    const testing_pairs::FakePairs<> source(script_);
    EXPECT_TRUE(run([&](workflow::Run& run) { return introduce_stereo(run, source); }).ok());
    EXPECT_EQ(said_, quiet ? "" : "a street\n");
  }
}

TEST_F(TrackPairsTest, RefusesASourceWithOneEye) {
  script_.one_eye = true;
  const testing_pairs::FakePairs<> source(script_);
  const Status refused = run([&](workflow::Run& run) { return introduce_stereo(run, source); });
  EXPECT_EQ(refused.reason(), Reason::NOT_STEREO);
  EXPECT_THAT(refused.message(), ::testing::EndsWith("; --source images --mono makes places of its pictures"));
}

TEST_F(TrackPairsTest, ReadsTracksAndSendsEveryPairInOrder) {
  ASSERT_TRUE(track().ok());
  EXPECT_THAT(read_, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11));
  EXPECT_EQ(summary_.tracked, 12u);
  EXPECT_THAT(sequences(), ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11));
  EXPECT_EQ(daemon_.pushed[0].session.name, "a street");
  EXPECT_EQ(daemon_.opened.at(0).recording, "street, all keyframes, no pictures");
}

// Each part ends before those that it uses: the threads of the pipeline, the outputs, the delivery.
TEST_F(TrackPairsTest, EndsItsPartsInOrder) {
  options_.report = file("pairs.tsv");
  int ended = 0;
  ended_ = [&] {
    ++ended;
    EXPECT_EQ(read_.size(), 12u);
    EXPECT_EQ(summary_.pairs, 12u) << "all are counted";
    EXPECT_EQ(summary_.expected, 12u);
    EXPECT_EQ(daemon_.pushed.size(), 12u) << "the threads of the pipeline have ended";
    EXPECT_THAT(lines_of(options_.report), Not(Contains(StartsWith("# pairs"))));
  };
  daemon_.at_call = [&](const std::string& call) {
    if (call != "finish") return;
    EXPECT_EQ(ended, 1);
    EXPECT_THAT(lines_of(options_.report), Contains("# pairs\t12")) << "the report is complete before keyframes settle";
  };
  ASSERT_TRUE(track().ok());
  EXPECT_EQ(ended, 1);
  EXPECT_THAT(calls(), ElementsAre("open", "push", "finish", "end_session", "ignore", "close"));
}

TEST_F(TrackPairsTest, TheThreadThatInterruptsTheSinkHasEndedBeforeTheSinkIsLeft) {
  daemon_.at_call = [&](const std::string& call) {
    if (call != "ignore") return;
    stop_ = true;
    wait_for_looks();
  };
  ASSERT_TRUE(track().ok());
  EXPECT_FALSE(daemon_.interrupted);
}

TEST_F(TrackPairsTest, TheThreadThatInterruptsTheSinkHasEndedBeforeTheSinkIsClosedAfterAnError) {
  daemon_.takes = 3;
  daemon_.refuses_to_push = {Reason::SEQUENCE_CONFLICT, "other keyframes under that uuid"};
  daemon_.at_call = [&](const std::string& call) {
    if (call != "close") return;
    stop_ = true;
    wait_for_looks();
  };
  EXPECT_EQ(track().reason(), Reason::SEQUENCE_CONFLICT);
  EXPECT_FALSE(daemon_.interrupted);
  EXPECT_THAT(calls(), ElementsAre("open", "push", "close")) << "nothing is waited for";
}

TEST_F(TrackPairsTest, AnErrorEndsTheOutputsAndTheSource) {
  options_.report = file("pairs.tsv");
  daemon_.takes = 3;
  daemon_.refuses_to_push = {Reason::SESSION_DELETED, "by its operator"};
  int ended = 0;
  ended_ = [&] { ++ended; };
  EXPECT_EQ(track().to_string(), "SESSION_DELETED: by its operator");
  EXPECT_EQ(ended, 1);
  EXPECT_EQ(summary_.keyframes, 3u);
  EXPECT_EQ(summary_.pairs, 4u) << "with the pair whose keyframe was refused";
  EXPECT_THAT(lines_of(options_.report), Contains("# pairs\t4"));
}

// A sink that still takes keyframes gets those of all pairs that were read.
TEST_F(TrackPairsTest, AStopWhileReadingLosesNoPairThatWasRead) {
  options_.report = file("pairs.tsv");
  daemon_.takes_after_interrupt = true;
  script_.before = [&](std::size_t i) {
    if (i == 6) stop_ = true;
  };
  ASSERT_TRUE(track().ok());
  EXPECT_THAT(read_, ElementsAre(0, 1, 2, 3, 4, 5, 6)) << "the pair that was being read is the last";
  EXPECT_EQ(summary_.pairs, 7u);
  EXPECT_EQ(summary_.expected, 7u);
  EXPECT_THAT(sequences(), ElementsAre(0, 1, 2, 3, 4, 5, 6));
  EXPECT_THAT(lines_of(options_.report), Contains("# pairs\t7"));
  EXPECT_THAT(calls(), ElementsAre("open", "push", "finish", "ignore", "close")) << "the session goes on";
  EXPECT_EQ(daemon_.complete, false);
}

TEST_F(TrackPairsTest, ARunThatWasStoppedAnywhereIsContinuedWithoutAGap) {
  ASSERT_TRUE(track().ok());
  std::vector<std::int64_t> whole;
  for (const Keyframe& keyframe : daemon_.pushed) whole.push_back(keyframe.time_us);
  ASSERT_EQ(whole.size(), 12u);
  for (std::size_t stop_after = 1; stop_after < 12; stop_after += 3) {
    SCOPED_TRACE(stop_after);
    const auto forget = [&] {
      stop_ = daemon_.interrupted = false;
      summary_ = {};
    };
    forget();
    daemon_.last.reset();
    daemon_.pushed.clear();
    daemon_.pushed_one = [&](std::size_t count) {
      if (count != stop_after) return;
      stop_ = true;
      daemon_.await_interrupt();
    };
    ASSERT_TRUE(track().ok()) << "a stop is no failure";
    EXPECT_EQ(exit_code(), kInterrupted);
    ASSERT_EQ(daemon_.pushed.size(), stop_after);
    EXPECT_EQ(summary_.keyframes, stop_after);
    forget();
    daemon_.pushed_one = [](std::size_t) {};
    daemon_.last = daemon_.pushed.back();
    ASSERT_TRUE(track().ok());
    EXPECT_EQ(daemon_.complete, true);
    EXPECT_THAT(sequences(), ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11));
    for (std::size_t i = 0; i < daemon_.pushed.size(); ++i) EXPECT_EQ(daemon_.pushed[i].time_us, whole[i]) << i;
  }
}

TEST_F(TrackPairsTest, HeldBackKeyframesAreSentBeforeTheDeliveryEnds) {
  script_.pairs.resize(1, script_.pairs[0]);
  daemon_.at_call = [&](const std::string& call) {
    if (call != "push") return;
    EXPECT_EQ(summary_.expected, 1u) << "all pairs were counted before";
  };
  ASSERT_TRUE(track(true).ok());
  EXPECT_THAT(calls(), ElementsAre("open", "push", "finish", "end_session", "ignore", "close"));
}

TEST_F(TrackPairsTest, KeyframesOfARunThatTracksNothingAreSentOnlyIfNotHeldBack) {
  make_blank();
  const Status held = track(true);
  EXPECT_THAT(held.message(), StartsWith("none of 12 pairs"));
  EXPECT_THAT(daemon_.pushed, IsEmpty());
  EXPECT_THAT(calls(), ElementsAre("open", "finish", "end_session", "ignore", "close"));
  EXPECT_EQ(daemon_.complete, false);
  summary_ = {};
  EXPECT_EQ(track(false).to_string(), held.to_string());
  EXPECT_THAT(daemon_.pushed, Not(IsEmpty()));
}

TEST_F(TrackPairsTest, AReportThatIsNotCompleteFailsTheRunAfterItsDelivery) {
  options_.report = file("pairs.tsv");
  const capture::testing_files::FileSizeLimit full_disk(64);
  EXPECT_EQ(track().reason(), Reason::IO_ERROR);
  EXPECT_EQ(daemon_.pushed.size(), 12u);
  EXPECT_EQ(daemon_.complete, true);
  EXPECT_EQ(daemon_.ends, 1);
}

}  // namespace
}  // namespace relmap::workflow
