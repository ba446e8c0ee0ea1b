// Links to a process that is none: whatever it says or leaves out, the link answers.
#include "frontend/capture/dc1394/dc1394_link.h"

#include <gtest/gtest.h>

#include <chrono>
#include <random>
#include <thread>

#include "frontend/capture/dc1394/testing/fake_process.h"

namespace relmap::iidc::dc1394 {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::FakeProcess;

constexpr std::size_t kFrame = 6000;

StreamRequest request(std::size_t buffers) { return {kFrame, kFrame - 100, buffers}; }

class Iidc1394Link : public ::testing::Test {
 protected:
  void open() {
    const Status status = link.open_at(process.begin(), 42);
    ASSERT_TRUE(status.ok()) << status.to_string();
  }
  void start(std::size_t buffers = 4) {
    open();
    const Status status = link.start(request(buffers));
    ASSERT_TRUE(status.ok()) << status.to_string();
  }
  // What is left of it after it said something mad.
  std::string end() {
    const auto until = std::chrono::steady_clock::now() + seconds(60);
    while (std::chrono::steady_clock::now() < until) {
      const auto frame = link.next(milliseconds(100));
      if (frame.reason() == Reason::CAMERA_GONE) return frame.status().message();
    }
    return "it goes on";
  }

  FakeProcess process;
  const std::shared_ptr<RestartPause> pause = std::make_shared<RestartPause>();
  Dc1394Link link{pause};
};

TEST_F(Iidc1394Link, RegistersAreAskedFor) {
  process.answers = [](const Request& request, Message& message) {
    if (request.ask == Ask::kOpen) message.with("node 1");
    if (request.ask == Ask::kRead) {
      std::vector<std::uint64_t> values;
      for (std::uint32_t i = 0; i < request.count; ++i) values.push_back(request.subject + 4 * i);
      message.with(values);
    }
    if (request.ask == Ask::kWrite && request.amount == 13)
      message = Message::answer(request.number, {Reason::IO_ERROR, "refused"});
    return true;
  };
  open();
  EXPECT_EQ("node 1", link.place());
  std::vector<std::uint32_t> quadlets(35);
  ASSERT_TRUE(link.read(0x1000, quadlets).ok());
  for (std::uint32_t i = 0; i < quadlets.size(); ++i) EXPECT_EQ(0x1000 + 4 * i, quadlets[i]);
  EXPECT_TRUE(link.write(0x1000, 12).ok());
  EXPECT_EQ("IO_ERROR: refused", link.write(0x1000, 13).to_string());
}

TEST_F(Iidc1394Link, ManyThreadsReadAtOnce) {
  process.answers = [](const Request& request, Message& message) {
    message.with(std::array<std::uint64_t, 1>{request.subject});
    return true;
  };
  open();
  std::vector<std::thread> threads;
  for (std::uint32_t t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      for (std::uint32_t i = 0; i < 200; ++i) {
        std::uint32_t quadlet = 0;
        EXPECT_TRUE(link.read(1000 * t + i, {&quadlet, 1}).ok());
        EXPECT_EQ(1000 * t + i, quadlet);
      }
    });
  for (std::thread& thread : threads) thread.join();
}

TEST_F(Iidc1394Link, FramesComeInOrder) {
  start();
  EXPECT_EQ(Reason::WRONG_STATE, link.start(request(4)).reason());
  EXPECT_EQ(Reason::CAMERA_SILENT, link.next(milliseconds(10)).reason());
  for (std::uint8_t i = 0; i < 50; ++i) {
    process.send_frame(i, 1000 + i, i == 7 ? 3 : 0);
    const auto frame = link.next(seconds(60));
    ASSERT_TRUE(frame.ok()) << frame.status().to_string();
    EXPECT_EQ(kFrame, frame->size);
    EXPECT_EQ(i, frame->data.get()[kFrame - 1]);
    EXPECT_EQ(1000 + i, frame->arrival_us);
    EXPECT_EQ(i == 7 ? 3u : 0u, frame->overrun);
  }
}

TEST_F(Iidc1394Link, TheOldestFrameIsDroppedIfNoneIsTaken) {
  start(4);
  // The link makes room as soon as it comes to it.
  for (std::uint8_t i = 0; i < 20; ++i)
    while (!process.send_frame(i)) std::this_thread::sleep_for(milliseconds(1));
  std::uint64_t missing = 0;
  int last = -1;
  for (;;) {
    const auto frame = link.next(milliseconds(50));
    if (!frame.ok()) break;
    EXPECT_EQ(last + static_cast<int>(frame->overrun) + 1, frame->data.get()[0]);
    last = frame->data.get()[0];
    missing += frame->overrun;
  }
  EXPECT_EQ(19, last);
  EXPECT_GE(missing, 15u);
}

TEST_F(Iidc1394Link, LentFramesAreLeftAlone) {
  start(3);
  std::vector<RawFrame> kept;
  for (std::uint8_t i = 0; i < 2; ++i) {
    process.send_frame(i);
    kept.push_back(link.next(seconds(60)).or_throw());
  }
  for (std::uint8_t i = 2; i < 20; ++i) process.send_frame(i);
  std::this_thread::sleep_for(milliseconds(20));
  link.stop();
  EXPECT_EQ(0, kept[0].data.get()[0]);
  EXPECT_EQ(1, kept[1].data.get()[kFrame - 1]);
  EXPECT_EQ(Reason::WRONG_STATE, link.next(milliseconds(1)).reason());
  ASSERT_TRUE(link.start({2 * kFrame, kFrame, 3}).ok());
  process.send_frame(9);
  EXPECT_EQ(2 * kFrame, link.next(seconds(60)).or_throw().size);
  EXPECT_EQ(0, kept[0].data.get()[0]);
}

TEST_F(Iidc1394Link, FaultsAreReported) {
  start();
  process.say(Message::fault({Reason::SHORT_FRAME, "half of one"}));
  EXPECT_EQ("SHORT_FRAME: half of one", link.next(seconds(60)).status().to_string());
  process.send_frame(1);
  process.say(Message::fault({Reason::CAMERA_GONE, "unplugged"}));
  EXPECT_TRUE(link.next(seconds(60)).ok());
  EXPECT_EQ("CAMERA_GONE: unplugged", link.next(seconds(60)).status().to_string());
  EXPECT_TRUE(pause->allows_start().ok());
}

TEST_F(Iidc1394Link, ARefusedStartLeavesItAsItWas) {
  bool refuse = true;
  process.answers = [&](const Request& request, Message& message) {
    if (request.ask == Ask::kStart && std::exchange(refuse, false))
      message = Message::answer(request.number, {Reason::NO_BANDWIDTH, "none is left"});
    return true;
  };
  open();
  EXPECT_EQ("NO_BANDWIDTH: none is left", link.start(request(4)).to_string());
  EXPECT_TRUE(link.start(request(4)).ok());
  EXPECT_EQ(Reason::BUDGET_EXCEEDED, Dc1394Link(pause).start({std::size_t{1} << 40, kFrame, 4}).reason());
}

TEST_F(Iidc1394Link, TheEndOfTheProcessAnswersAllWaits) {
  process.answers = [this](const Request& request, Message&) {
    if (request.ask == Ask::kRead) process.end();
    return true;
  };
  start();
  std::thread waiter([this] { EXPECT_EQ(Reason::CAMERA_GONE, link.next(seconds(60)).reason()); });
  std::uint32_t quadlet = 0;
  EXPECT_EQ("CAMERA_GONE: the process that serves IEEE 1394 has ended (its end of the socket is closed)",
            link.read(0, {&quadlet, 1}).to_string());
  waiter.join();
  EXPECT_EQ(Reason::CAMERA_GONE, link.write(0, 1).reason());
  EXPECT_EQ(Reason::CAMERA_GONE, pause->allows_start().reason());
}

TEST_F(Iidc1394Link, AHangCountsAsTheEndOfTheProcess) {
  process.answers = [](const Request& request, Message&) { return request.ask != Ask::kRead; };
  open();
  std::uint32_t quadlet = 0;
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ("CAMERA_GONE: the process that serves IEEE 1394 has ended (it did not answer within 2 s and was killed)",
            link.read(0, {&quadlet, 1}).to_string());
  EXPECT_GE(std::chrono::steady_clock::now() - begin, seconds(2)) << "it was given its time";
}

TEST_F(Iidc1394Link, AnotherReleaseIsRefused) {
  process.hello.values[0] = 99;
  EXPECT_EQ("UNSUPPORTED: relmap-camera-1394 is of another release: it speaks version 99 of its protocol, not 1",
            link.open_at(process.begin(), 1).to_string());
}

TEST_F(Iidc1394Link, InvalidMessagesEndTheProcess) {
  start();
  process.say(std::vector<std::uint8_t>(17, 1));
  EXPECT_EQ("the process that serves IEEE 1394 has ended (it spoke nonsense, a packet of 17 bytes instead of " +
                std::to_string(sizeof(Message)) + ", and was killed)",
            end());
}

TEST_F(Iidc1394Link, TooLongAPacketEndsTheProcess) {
  start();
  process.say(std::vector<std::uint8_t>(5000, 1));
  EXPECT_NE(std::string::npos, end().find("a packet of 5000 bytes"));
}

TEST_F(Iidc1394Link, FramesInInvalidSlotsEndTheProcess) {
  for (const Message& mad : {Message::frame(4, kFrame, 0, 0), Message::frame(0xffff'ffff, kFrame, 0, 0),
                             Message::frame(0, kFrame + 1, 0, 0), Message::frame(0, kFrame - 101, 0, 0)}) {
    FakeProcess mad_process;
    Dc1394Link mad_link(pause);
    ASSERT_TRUE(mad_link.open_at(mad_process.begin(), 1).ok());
    ASSERT_TRUE(mad_link.start(request(4)).ok());
    mad_process.say(mad);
    EXPECT_EQ(Reason::CAMERA_GONE, mad_link.next(seconds(60)).reason());
  }
}

TEST_F(Iidc1394Link, AFrameTwiceInOneSlotEndsTheProcess) {
  start();
  process.say(Message::frame(1, kFrame, 0, 0));
  const auto kept = link.next(seconds(60));
  ASSERT_TRUE(kept.ok());
  process.say(Message::frame(1, kFrame, 0, 0));
  EXPECT_NE(std::string::npos, end().find("a frame in slot 1, which it has not"));
}

TEST_F(Iidc1394Link, AFrameWithoutAStreamEndsTheProcess) {
  open();
  process.say(Message::frame(0, kFrame, 0, 0));
  std::uint32_t quadlet = 0;
  Status status;
  for (int i = 0; i < 100 && status.reason() != Reason::CAMERA_GONE; ++i) status = link.read(0, {&quadlet, 1});
  EXPECT_NE(std::string::npos, status.message().find("a frame that nobody waits for"));
}

TEST_F(Iidc1394Link, AnUnrequestedAnswerEndsTheProcess) {
  start();
  process.say(Message::answer(1234, {}));
  EXPECT_NE(std::string::npos, end().find("an answer to request 1234, which is not open"));
}

TEST_F(Iidc1394Link, SurvivesAnyBytes) {
  std::mt19937 random(7);
  for (int round = 0; round < 100; ++round) {
    FakeProcess mad;
    Dc1394Link mad_link(pause);
    ASSERT_TRUE(mad_link.open_at(mad.begin(), 1).ok());
    ASSERT_TRUE(mad_link.start(request(4)).ok());
    for (int i = 0; i < 20; ++i) {
      const Message sane = Message::frame(static_cast<std::uint32_t>(random() % 6), random() % (2 * kFrame), 0, 0);
      const auto view = bytes_of(sane);
      std::vector<std::uint8_t> bytes(view.begin(), view.end());
      bytes[random() % 48] ^= static_cast<std::uint8_t>(1 << random() % 8);
      mad.say(bytes);
    }
    std::vector<RawFrame> kept;
    for (int i = 0; i < 20; ++i)
      if (auto frame = mad_link.next(milliseconds(1)); frame.ok()) {
        EXPECT_LE(frame->size, kFrame);
        kept.push_back(std::move(*frame));
      }
  }
}

}  // namespace
}  // namespace relmap::iidc::dc1394
