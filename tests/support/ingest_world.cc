#include "tests/support/ingest_world.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "proto/base/crc32c.h"
#include "proto/keyframe/keyframe_samples.h"

namespace relmap::testing {

namespace {
using std::chrono::milliseconds;
constexpr std::uint32_t kPart = 700;
}  // namespace

IngestWorld::IngestWorld(std::uint64_t seed, Channel channel) : random_(seed), channel_(channel), core_(session()) {
  start_daemon();
}

SessionUuid IngestWorld::session() {
  SessionUuid uuid;
  uuid.bytes.fill(9);
  return uuid;
}

Keyframe IngestWorld::good_keyframe(std::uint32_t sequence) const {
  Keyframe k = KeyframeSampler(1).keyframe();
  k.session.uuid = session();
  k.sequence = sequence;
  k.time_us = 1'700'000'000'000'000 + sequence * 100'000LL;
  for (TrackMeasurement& t : k.tracks) t.track.sequence = std::min(t.track.sequence, sequence);
  k.picture.assign(4000, static_cast<std::uint8_t>(sequence));
  std::copy_n("\xff\xd8\xff", 3, k.picture.begin());
  return k;
}

void IngestWorld::push(const Keyframe& keyframe) {
  const Bytes payload = encode_keyframe(keyframe);
  const std::uint32_t crc = crc32c(payload);
  if (const auto gap = core_.skipped(keyframe.sequence)) core_.give_up(*gap);
  core_.push(keyframe.sequence, crc, static_cast<std::uint32_t>(payload.size()));
  spool_[keyframe.sequence] = payload;
}

void IngestWorld::step() {
  now_ += milliseconds(1);
  for (const auto& one : core_.poll(now_, kPart)) transmit(one);
  act();
  deliver();
  EXPECT_LE(budget_.used(), budget_.limit());
  if (uniform() < 0.3) sink_.sync(static_cast<std::size_t>(uniform() * 5) + 1);
  for (const Acknowledgement& ack : intake_->poll(now_)) send(ack);
  for (PoseNews& one : intake_->take_news()) {
    one.boot = boot();
    tell(one);
  }
}

bool IngestWorld::run(int limit_ms) {
  for (int i = 0; i < limit_ms && !core_.all_settled(); ++i) step();
  return core_.all_settled();
}

void IngestWorld::crash() {
  sink_.crash();
  start_daemon();
}

void IngestWorld::start_daemon() {
  ++boots_;
  robot_heard_ = false;
  intake_ = std::make_unique<intake::Intake>(sink_, budget_, boot(), options(), [] {});
  std::erase_if(under_way_, [](const auto& m) {
    const auto* message = std::get_if<Message>(&m.second);
    return message && std::holds_alternative<Acknowledgement>(*message);
  });
}

BootId IngestWorld::boot() const {
  BootId boot{};
  boot[0] = boots_;
  return boot;
}

double IngestWorld::resent_share() const {
  std::size_t once = 0;
  for (const auto& [sequence, payload] : spool_) once += count_parts(payload.size(), kPart);
  return 1 - static_cast<double>(once) / static_cast<double>(parts_sent_);
}

std::map<std::uint32_t, Reason> IngestWorld::outcomes() {
  std::map<std::uint32_t, Reason> all;
  for (const storage::JournalRecord& record : sink_.journal()) {
    if (const auto* k = std::get_if<storage::KeyframeRecord>(&record)) {
      const Keyframe keyframe = *decode_keyframe(k->payload);
      if (keyframe.session.uuid != session()) {
        EXPECT_NE(keyframe.session.robot, sender().robot) << "somebody has begun a session in the robot's name";
        continue;
      }
      const std::uint32_t sequence = keyframe.sequence;
      EXPECT_TRUE(all.emplace(sequence, Reason::OK).second) << "doubled: " << sequence;
      EXPECT_EQ(k->payload, spool_[sequence]);
    } else if (const auto* r = std::get_if<storage::RefusalRecord>(&record); r && r->session == own()) {
      EXPECT_TRUE(all.emplace(r->sequence, r->reason).second) << "doubled: " << r->sequence;
    } else if (const auto* g = std::get_if<storage::GapRecord>(&record); g && g->session == own()) {
      for (std::uint32_t s = g->from; s <= g->to; ++s)
        EXPECT_TRUE(all.emplace(s, g->reason).second) << "doubled: " << s;
    }
  }
  return all;
}

// The session's number in the map; 0: none yet.
SessionNumber IngestWorld::own() const {
  for (const storage::Session& known : sink_.view()->sessions())
    if (known.header.uuid == session()) return known.number;
  return 0;
}

void IngestWorld::transmit(const publishing::PublisherCore::Send& what) {
  if (what.gap) return send(Gap{session(), what.sequence, what.to, what.reason});
  const Bytes& payload = spool_.at(what.sequence);
  const std::uint32_t crc = crc32c(payload);
  const std::uint32_t count = count_parts(payload.size(), kPart);
  for (std::uint32_t i = 0; i < count; ++i)
    if (what.parts.empty() || std::count(what.parts.begin(), what.parts.end(), i)) {
      send(cut_part(session(), what.sequence, payload, crc, kPart, i));
      ++parts_sent_;
    }
}

void IngestWorld::carry(std::variant<Message, Datagram> content) {
  for (int copies = uniform() < channel_.doubled ? 2 : 1; copies > 0; --copies) {
    if (uniform() < channel_.loss) continue;
    std::variant<Message, Datagram> copy = content;
    damage(copy);
    carry_late(std::move(copy), milliseconds(channel_.delay_ms + static_cast<int>(uniform() * channel_.jitter_ms)));
  }
}

void IngestWorld::carry_late(std::variant<Message, Datagram> content, milliseconds after) {
  under_way_.emplace(now_ + after, std::move(content));
}

void IngestWorld::damage(std::variant<Message, Datagram>& content) {
  if (auto* datagram = std::get_if<Datagram>(&content)) {
    if (uniform() < channel_.damaged) datagram->bytes[random_() % datagram->bytes.size()] ^= 0x40;
    return;
  }
  auto* const part = std::get_if<KeyframePart>(&std::get<Message>(content));
  if (!part || uniform() >= channel_.damaged) return;
  switch (static_cast<int>(uniform() * 4)) {
    case 0:
      part->data[static_cast<std::size_t>(uniform() * static_cast<double>(part->data.size()))] ^= 0x40;
      break;
    case 1:
      part->data.pop_back();
      break;
    case 2:
      ++part->sequence;
      break;
    default:
      part->payload_crc ^= 1;
  }
}

void IngestWorld::deliver() {
  while (!under_way_.empty() && under_way_.begin()->first <= now_) {
    const std::variant<Message, Datagram> content = std::move(under_way_.begin()->second);
    under_way_.erase(under_way_.begin());
    if (const auto* datagram = std::get_if<Datagram>(&content)) {
      take(*datagram);
      continue;
    }
    const Message& message = std::get<Message>(content);
    if (const auto* ack = std::get_if<Acknowledgement>(&message))
      core_.acknowledge(*ack, now_);
    else
      take_from_robot(message, sender());
  }
}

void IngestWorld::take_from_robot(const Message& message, const intake::Sender& from) {
  if (const auto* part = std::get_if<KeyframePart>(&message)) intake_->take_part(*part, now_, from);
  if (const auto* gap = std::get_if<Gap>(&message)) (void)intake_->take_gap(*gap, now_, from);
  if (const auto* end = std::get_if<SessionEnd>(&message)) (void)intake_->take_end(*end, now_, from);
  robot_heard_ |= from.robot == sender().robot && !from.anyone;
}

}  // namespace relmap::testing
