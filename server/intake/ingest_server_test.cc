// Messages for which the map has to be read keep nobody else waiting.
#include "server/intake/ingest_server.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <future>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "proto/base/crc32c.h"
#include "proto/keyframe/keyframe_samples.h"
#include "server/intake/testing/fake_sink.h"

namespace relmap::intake {
namespace {

class IngestServerTest : public testing::Test {
 protected:
  IngestServerTest() {
    sink_.sync_at_once = true;
    restart();
    for (std::uint32_t sequence = 0; sequence < 3; ++sequence) EXPECT_TRUE(send(kOld, sequence).get().ok());
    EXPECT_TRUE(is_acknowledged(kOld, 3));
    restart();
  }
  ~IngestServerTest() override { sink_.let_hang(0); }

  void restart() {
    server_.reset();
    server_ = std::make_unique<IngestServer>(sink_, budget_, BootId{++boot_});
  }
  std::future<Status> send(const SessionUuid& uuid, std::uint32_t sequence, std::int64_t later_us = 0,
                           const Sender& sender = {}) {
    Keyframe k = KeyframeSampler(4).keyframe();
    k.session.uuid = uuid;
    k.sequence = sequence;
    k.time_us = 1'700'000'000'000'000 + sequence * 100'000LL + later_us;
    for (TrackMeasurement& t : k.tracks) t.track.sequence = std::min(t.track.sequence, sequence);
    const Bytes payload = encode_keyframe(k);
    auto taken = std::make_shared<std::promise<Status>>();
    server_->take_payload(uuid, sequence, crc32c(payload), payload, sender,
                          [taken](const Status& status) { taken->set_value(status); });
    return taken->get_future();
  }
  template <typename Condition>
  static bool eventually(Condition condition) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::minutes(1);
    while (!condition() && std::chrono::steady_clock::now() < until)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return condition();
  }
  bool is_acknowledged(const SessionUuid& uuid, std::uint64_t next) {
    return eventually([&] { return server_->acknowledgement(uuid)->next_sequence == next; });
  }
  static bool waits(const std::future<Status>& taken) {
    return taken.wait_for(std::chrono::seconds(0)) == std::future_status::timeout;
  }

  const SessionUuid kOld = *SessionUuid::parse("11111111-2222-3333-4444-555555555555");
  const SessionUuid kNew = *SessionUuid::parse("99999999-2222-3333-4444-555555555555");
  std::uint8_t boot_ = 0;
  FakeSink sink_;
  storage::Budget budget_{std::size_t{1} << 30};
  std::unique_ptr<IngestServer> server_;
};

TEST_F(IngestServerTest, ASessionWhoseRecordIsReadKeepsNobodyElseWaiting) {
  sink_.let_hang(1);
  auto old = send(kOld, 3);
  ASSERT_TRUE(eventually([&] { return sink_.reading() == 1; }));
  for (std::uint32_t sequence = 0; sequence < 5; ++sequence) EXPECT_TRUE(send(kNew, sequence).get().ok());
  EXPECT_TRUE(is_acknowledged(kNew, 5));
  EXPECT_EQ(server_->stats().sessions, 1u);
  EXPECT_TRUE(waits(old));
  sink_.let_hang(0);
  EXPECT_TRUE(old.get().ok());
  EXPECT_TRUE(is_acknowledged(kOld, 4));
}

TEST_F(IngestServerTest, AnOldSequenceIsReadWhileOthersGoOn) {
  EXPECT_TRUE(send(kOld, 3).get().ok());
  sink_.let_hang(1);
  auto repeated = send(kOld, 0), other = send(kOld, 1, 7);
  ASSERT_TRUE(eventually([&] { return sink_.reading() == 1; }));
  EXPECT_TRUE(send(kOld, 4).get().ok()) << "its record is in memory";
  EXPECT_TRUE(send(kNew, 0).get().ok());
  EXPECT_TRUE(is_acknowledged(kOld, 5));
  EXPECT_TRUE(waits(repeated) && waits(other));
  sink_.let_hang(0);
  EXPECT_TRUE(repeated.get().ok() && other.get().ok());
  EXPECT_EQ(server_->stats().repeated_parts, 1u);
  EXPECT_EQ(server_->stats().parts_refused[index_of(Reason::SEQUENCE_CONFLICT)], 1u);
}

// Of the messages that wait until the map was read, a robot that sends many loses some of its own.
TEST_F(IngestServerTest, WhoAsksTheMapForMuchKeepsNobodyElseOut) {
  const SessionUuid other = *SessionUuid::parse("33333333-2222-3333-4444-555555555555");
  EXPECT_TRUE(send(other, 0).get().ok());
  EXPECT_TRUE(is_acknowledged(other, 1));
  restart();
  sink_.let_hang(1);
  std::vector<std::future<Status>> flood;
  for (int i = 0; i < 1500; ++i) flood.push_back(send(kOld, 3, i, {"hog"}));
  auto honest = send(other, 1, 0, {"cart"});
  EXPECT_TRUE(waits(honest)) << "it is in line, and not refused";
  sink_.let_hang(0);
  EXPECT_NE(honest.get().reason(), Reason::BUDGET_EXCEEDED);
  int refused = 0;
  for (auto& one : flood) refused += one.get().reason() == Reason::BUDGET_EXCEEDED;
  EXPECT_GE(refused, 1500 - 1024);
}

// Each message is answered, also those that wait when the server stops.
TEST_F(IngestServerTest, WhatWaitsForTheMapIsTakenInBeforeTheServerStops) {
  sink_.let_hang(1);
  auto old = send(kOld, 3);
  ASSERT_TRUE(eventually([&] { return sink_.reading() == 1; }));
  std::thread stopping([&] { server_->stop(); });
  EXPECT_TRUE(waits(old));
  sink_.let_hang(0);
  stopping.join();
  EXPECT_TRUE(old.get().ok());
  EXPECT_EQ(sink_.journal().size(), 4u);
  EXPECT_EQ(send(kOld, 4).get().reason(), Reason::SHUTTING_DOWN);
}

TEST_F(IngestServerTest, PartsOfASessionThatReturnsAreNotLost) {
  sink_.let_hang(1);
  Keyframe k = KeyframeSampler(4).keyframe();
  k.session.uuid = kOld;
  k.sequence = 3;
  k.time_us = 1'700'000'001'000'000;
  for (TrackMeasurement& t : k.tracks) t.track.sequence = std::min(t.track.sequence, k.sequence);
  const Bytes payload = encode_keyframe(k);
  const std::uint32_t crc = crc32c(payload), parts = count_parts(payload.size(), 600);
  for (std::uint32_t i = 0; i < parts; ++i) server_->take_part(cut_part(kOld, 3, payload, crc, 600, i));
  ASSERT_TRUE(eventually([&] { return sink_.reading() == 1; }));
  sink_.let_hang(0);
  EXPECT_TRUE(is_acknowledged(kOld, 4));
  EXPECT_EQ(server_->stats().parts, parts);
}

// News of closures may come long after the robot was heard, and its listeners must know whose they are.
TEST_F(IngestServerTest, NewsAreForTheRobotOfTheirSession) {
  std::mutex mutex;
  std::vector<std::pair<SessionUuid, std::string>> heard;
  const auto heard_by = server_->subscribe({{},
                                            [&](const PoseNews& news, const std::string& robot) {
                                              const std::lock_guard lock(mutex);
                                              heard.emplace_back(news.session, robot);
                                            },
                                            {}});
  PoseNews news;
  news.session = SessionUuid::random();  // it is not being taken in
  server_->tell(news, "cart");
  ASSERT_TRUE(eventually([&] {
    const std::lock_guard lock(mutex);
    return !heard.empty();
  }));
  const std::lock_guard lock(mutex);
  EXPECT_EQ(heard, (std::vector<std::pair<SessionUuid, std::string>>{{news.session, "cart"}}));
}

}  // namespace
}  // namespace relmap::intake
