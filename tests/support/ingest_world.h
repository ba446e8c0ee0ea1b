// Both ends of the keyframe protocol in simulated time: a robot's publisher and a daemon's intake, with a channel
// between them that loses, doubles, reorders and damages messages, and a disk that forgets what was not synced.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <random>
#include <variant>

#include "frontend/publishing/publisher_core.h"
#include "server/intake/intake.h"
#include "server/intake/testing/fake_sink.h"

namespace relmap::testing {

struct Channel {
  double loss = 0, doubled = 0, damaged = 0;
  int delay_ms = 2, jitter_ms = 0;
};

class IngestWorld {
 public:
  IngestWorld(std::uint64_t seed, Channel channel);
  virtual ~IngestWorld() = default;

  static SessionUuid session();

  // Keyframe `sequence`; `mutate` makes it bad.
  template <typename Mutate>
  void push(std::uint32_t sequence, Mutate&& mutate) {
    Keyframe k = good_keyframe(sequence);
    mutate(k);
    push(k);
  }
  void push(std::uint32_t sequence) { push(good_keyframe(sequence)); }

  // One millisecond.
  void step();
  // Until all is settled; false if that takes longer.
  bool run(int limit_ms);
  void crash();

  publishing::PublisherCore& core() { return core_; }
  intake::FakeSink& sink() { return sink_; }
  intake::IngestStats stats() const { return intake_->stats(now_); }

  // Of the parts that were sent, those that had been sent before.
  double resent_share() const;
  // What became of each sequence, by the journal.
  std::map<std::uint32_t, Reason> outcomes();

 protected:
  // As they are, without a transport.
  using Message = std::variant<KeyframePart, Gap, SessionEnd, Acknowledgement>;
  // A datagram of a transport.
  struct Datagram {
    const char* channel = nullptr;
    Bytes bytes;
  };

  // What a transport does otherwise: a side sends a message, which others may hear, and the other one takes what came.
  virtual void send(Message message) { carry(std::move(message)); }
  virtual void take(const Datagram&) {}
  virtual void tell(const PoseNews&) {}
  // Each millisecond, before messages are delivered.
  virtual void act() {}
  virtual intake::IntakeOptions options() const { return {}; }
  // Who the daemon takes the robot for.
  virtual intake::Sender sender() const { return {}; }

  void start_daemon();
  // Under way from now on, if it is not lost.
  void carry(std::variant<Message, Datagram> content);
  // The same, never lost, and there after so long.
  void carry_late(std::variant<Message, Datagram> content, std::chrono::milliseconds after);
  // A part, a gap or an end comes to the intake, as of this sender.
  void take_from_robot(const Message& message, const intake::Sender& from);

  double uniform() { return std::uniform_real_distribution<double>(0, 1)(random_); }
  BootId boot() const;
  // Whether the session is in the journal, so that it is known to be this robot's.
  bool has_begun() const { return own() != 0; }
  // Whether this daemon has heard of the session from the robot.
  bool robot_heard() const { return robot_heard_; }
  const std::map<std::uint32_t, Bytes>& spool() const { return spool_; }
  intake::Intake& intake() { return *intake_; }
  intake::SteadyTime now() const { return now_; }

  std::mt19937_64 random_;

 private:
  Keyframe good_keyframe(std::uint32_t sequence) const;
  void push(const Keyframe& keyframe);
  SessionNumber own() const;
  void transmit(const publishing::PublisherCore::Send& send);
  void damage(std::variant<Message, Datagram>& content);
  void deliver();

  const Channel channel_;
  intake::SteadyTime now_{std::chrono::hours(1)};
  intake::FakeSink sink_;
  storage::Budget budget_{std::size_t{256} << 20};
  publishing::PublisherCore core_;
  std::unique_ptr<intake::Intake> intake_;
  std::uint8_t boots_ = 0;
  bool robot_heard_ = false;
  std::size_t parts_sent_ = 0;
  std::map<std::uint32_t, Bytes> spool_;
  std::multimap<intake::SteadyTime, std::variant<Message, Datagram>> under_way_;
};

}  // namespace relmap::testing
